//! The muscle states of the initial guess: forces by non-negative least squares, then tendon, fibre and activation.

use crate::gait_problem::{GaitProgram, PointVariables};
use crate::muscle::{MUSCLE_COUNT, Muscle, force_length, force_velocity};
use clarabel::algebra::CscMatrix;
use clarabel::solver::{DefaultSettingsBuilder, DefaultSolver, IPSolver, SolverStatus, SupportedConeT};

/// Force to which the redundancy is resolved, F_max.
const REST_FORCE: f64 = 0.02;
/// Weight of the distance from that force, relative to torque errors of 100 N m.
const REST_WEIGHT: f64 = 0.03 * 0.03;
/// Range of the forces, F_max.
const FORCE_RANGE: (f64, f64) = (1e-3, 1.2);
/// Tendon strain at F_max.
const REFERENCE_STRAIN: f64 = 0.04;

/// Converts a point without muscles (`x_plain` of `plain`) to the layout of `program` and adds the muscle states. If
/// no force distribution is found, the muscles are at rest.
pub fn guess(program: &GaitProgram, plain: &GaitProgram, x_plain: &[f64]) -> Vec<f64> {
    let mut x = program.adopt_globals(plain, x_plain);
    for (d, domain) in program.layout.domains.iter().enumerate() {
        let mut points: Vec<PointVariables> =
            (0..domain.points).map(|k| plain.layout.point_variables(x_plain, d, k)).collect();
        let mut forces = Vec::with_capacity(points.len());
        for point in &mut points {
            let force = distribute(&program.muscles, point).unwrap_or([REST_FORCE; MUSCLE_COUNT]);
            for m in 0..MUSCLE_COUNT {
                let muscle = &program.muscles[m];
                let tendon = muscle.slack_length_m * (1.0 + REFERENCE_STRAIN * force[m].sqrt());
                point.fibre_length[m] =
                    ((muscle.unit_length(&point.q) - tendon) / muscle.optimal_length_m).clamp(0.35, 1.55);
            }
            forces.push(force);
        }
        let step = program.layout.value(&x, domain.duration) / (domain.points - 1) as f64;
        for k in 0..points.len() {
            let (before, after) = (k.saturating_sub(1), (k + 1).min(points.len() - 1));
            for m in 0..MUSCLE_COUNT {
                let speed = 0.5 * program.muscles[m].max_speed;
                let change = points[after].fibre_length[m] - points[before].fibre_length[m];
                let velocity = (change / (step * (after - before).max(1) as f64)).clamp(-speed, speed);
                points[k].fibre_velocity[m] = velocity;
                let capacity = force_length(points[k].fibre_length[m]).value
                    * force_velocity(velocity / program.muscles[m].max_speed).value;
                points[k].activation[m] = (forces[k][m] / capacity.max(0.05)).clamp(0.01, 0.95);
            }
        }
        for (k, point) in points.iter().enumerate() {
            program.layout.set_point_variables(&mut x, d, k, point);
        }
    }
    x
}

/// Minimises `|(A F - u)/100|^2 + w |F - rest|^2` over F >= 0 in units of F_max; u are the four torques of the muscles.
fn distribute(muscles: &[Muscle; MUSCLE_COUNT], point: &PointVariables) -> Option<[f64; MUSCLE_COUNT]> {
    let mut a = [[0.0; MUSCLE_COUNT]; 4];
    for (m, muscle) in muscles.iter().enumerate() {
        for attachment in muscle.attachments.iter().flatten() {
            let arm = attachment.at(point.q[attachment.coordinate]).arm;
            a[attachment.coordinate - 3][m] += arm * muscle.max_force_n / 100.0;
        }
    }
    let mut p = vec![vec![0.0; MUSCLE_COUNT]; MUSCLE_COUNT];
    let mut c = vec![0.0; MUSCLE_COUNT];
    for m in 0..MUSCLE_COUNT {
        for other in m..MUSCLE_COUNT {
            p[m][other] = 2.0 * (0..4).map(|row| a[row][m] * a[row][other]).sum::<f64>();
        }
        p[m][m] += 2.0 * REST_WEIGHT;
        c[m] = -2.0 * REST_WEIGHT * REST_FORCE - 2.0 * (0..4).map(|row| a[row][m] * point.u[row] / 100.0).sum::<f64>();
    }
    let settings = DefaultSettingsBuilder::default().verbose(false).max_iter(100).build().ok()?;
    let minus_identity = CscMatrix::new(
        MUSCLE_COUNT,
        MUSCLE_COUNT,
        (0..=MUSCLE_COUNT).collect(),
        (0..MUSCLE_COUNT).collect(),
        vec![-1.0; MUSCLE_COUNT],
    );
    let quadratic = CscMatrix::from(&p);
    let cones = [SupportedConeT::NonnegativeConeT(MUSCLE_COUNT)];
    let mut solver =
        DefaultSolver::new(&quadratic, &c, &minus_identity, &[0.0; MUSCLE_COUNT], &cones, settings).ok()?;
    solver.solve();
    let solved = matches!(solver.solution.status, SolverStatus::Solved | SolverStatus::AlmostSolved);
    solved.then(|| std::array::from_fn(|m| solver.solution.x[m].clamp(FORCE_RANGE.0, FORCE_RANGE.1)))
}
