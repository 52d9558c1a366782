//! The rows of the gait problem, as name and value.

use crate::domains::{Domain, Kind, target};
use crate::muscles::{self, Muscle};
use crate::variables::{DomainVariables, GaitVariables, Point};
use crate::walker::{GRAVITY, State, Walker};
use crate::{Scalar, constant};
use gait_optimizer::gait_problem::row_names::RowPlace;
use gait_optimizer::gait_problem::{RowKind, RowName};

/// Parameters of the rows.
pub(crate) struct Problem {
    pub(crate) walker: Walker,
    pub(crate) domains: Vec<Domain>,
    pub(crate) muscles: Vec<Muscle>,
    pub(crate) friction: f64,
    pub(crate) impact_friction: f64,
    pub(crate) clearance: f64,
}

/// Rows in the order of this implementation.
pub(crate) struct Rows<D> {
    pub(crate) list: Vec<(RowName, D)>,
    place: RowPlace,
}

impl<D: Scalar> Rows<D> {
    fn add(&mut self, kind: RowKind, component: usize, value: D) {
        self.list.push((RowName { place: self.place, kind, component }, value));
    }

    fn at(&mut self, domain: usize, point: usize) {
        self.place = RowPlace::Point { domain, point };
    }
}

/// All rows.
pub(crate) fn all<D: Scalar>(problem: &Problem, gait: &GaitVariables<D>) -> Vec<(RowName, D)> {
    let mut rows = Rows { list: Vec::new(), place: RowPlace::Stride };
    for d in 0..8 {
        for k in 0..problem.domains[d].points() {
            rows.at(d, k);
            point_rows(problem, gait, d, k, &mut rows);
        }
        integration_rows(problem, gait, d, &mut rows);
        transition_rows(problem, gait, d, &mut rows);
    }
    rows.place = RowPlace::Stride;
    rows.add(RowKind::StepLength, 0, gait.right_step);
    rows.add(RowKind::StepLength, 1, gait.stride - gait.right_step);
    let mut time = constant::<D>(0.0);
    for domain in &gait.domains {
        time += domain.duration;
    }
    rows.add(RowKind::Speed, 0, gait.stride / time);
    rows.list
}

fn point_rows<D: Scalar>(problem: &Problem, gait: &GaitVariables<D>, d: usize, k: usize, rows: &mut Rows<D>) {
    let (domain, variables) = (&problem.domains[d], &gait.domains[d]);
    let point = &variables.points[k];
    let state = State::new(&point.q, &point.qd, &point.qdd);
    motion(problem, domain, point, &state, rows);
    contacts(problem, gait, d, k, &state, rows);
    outputs(problem, domain, variables, k, rows);
    hip(problem, gait, d, k, rows);
    if let Some(fibres) = &point.fibres {
        muscle_rows(problem, point, fibres, rows);
    }
    friction(problem, domain, point, rows);
    heights(problem, gait, d, k, &state, rows);
}

/// Equation of motion.
fn motion<D: Scalar>(problem: &Problem, domain: &Domain, point: &Point<D>, state: &State<D>, rows: &mut Rows<D>) {
    let mut residual = problem.walker.inverse_dynamics(state, GRAVITY);
    for i in 0..6 {
        residual[3 + i] -= point.u[i];
    }
    for (contact, force) in domain.contacts.iter().zip(&point.force) {
        let mut vector = [constant::<D>(0.0); 2];
        vector[contact.1] = *force;
        let by_contact = state.generalised_force(&problem.walker.foot_point(contact.0), &vector);
        for i in 0..9 {
            residual[i] -= by_contact[i];
        }
    }
    for i in 0..9 {
        rows.add(RowKind::Dynamics, i, residual[i] / 100.0);
    }
}

/// Contact points are fixed.
fn contacts<D: Scalar>(
    problem: &Problem,
    gait: &GaitVariables<D>,
    d: usize,
    k: usize,
    state: &State<D>,
    rows: &mut Rows<D>,
) {
    let domain = &problem.domains[d];
    for (c, &contact) in domain.contacts.iter().enumerate() {
        let chain = problem.walker.foot_point(contact.0);
        rows.add(RowKind::ContactAcceleration, c, state.acceleration(&chain)[contact.1] / 10.0);
        if k > 0 || domain.opens_with_impact() {
            rows.add(RowKind::ContactVelocity, c, state.velocity(&chain)[contact.1]);
        }
        let guard = match domain.kind {
            Kind::Ds2 => c < 2,
            Kind::Ds3 => c == 2,
            Kind::Ss2 | Kind::Ss1 => false,
        };
        if k > 0 || guard {
            let goal = target(&problem.walker, domain, contact, gait.right_step, gait.stride);
            rows.add(RowKind::ContactPosition, c, state.position(&chain)[contact.1] - goal);
        }
    }
}

const BINOMIAL_5: [f64; 6] = [1.0, 5.0, 10.0, 10.0, 5.0, 1.0];

/// `sum_i alpha_i C(n, i) s^i (1 - s)^(n - i)` by its definition.
fn bernstein<D: Scalar>(alpha: &[D], binomial: &[f64], s: D) -> D {
    let n = i32::try_from(alpha.len()).unwrap() - 1;
    let rest = constant::<D>(1.0) - s;
    let mut sum = constant::<D>(0.0);
    for (i, (a, c)) in (0..).zip(alpha.iter().zip(binomial)) {
        sum += *a * power(s, i) * power(rest, n - i) * *c;
    }
    sum
}

/// Integer power by products: `0^0 = 1` also in the derivatives.
fn power<D: Scalar>(base: D, exponent: i32) -> D {
    let mut product = constant::<D>(1.0);
    for _ in 0..exponent {
        product *= base;
    }
    product
}

/// Bezier curve of degree 5 and its first two derivatives by s, the derivatives as curves of the differences.
pub(crate) fn bezier<D: Scalar>(alpha: &[D; 6], s: D) -> [D; 3] {
    let first: Vec<D> = (0..5).map(|i| (alpha[i + 1] - alpha[i]) * 5.0).collect();
    let second: Vec<D> = (0..4).map(|i| (first[i + 1] - first[i]) * 4.0).collect();
    [
        bernstein(alpha, &BINOMIAL_5, s),
        bernstein(&first, &[1.0, 4.0, 6.0, 4.0, 1.0], s),
        bernstein(&second, &[1.0, 3.0, 3.0, 1.0], s),
    ]
}

/// Virtual constraints.
fn outputs<D: Scalar>(
    problem: &Problem,
    domain: &Domain,
    variables: &DomainVariables<D>,
    k: usize,
    rows: &mut Rows<D>,
) {
    let point = &variables.points[k];
    let phase = |q: &[D; 9]| problem.walker.hip_phase(domain.stance, q);
    let (s, sd, sdd) = match variables.phase_end {
        // The phase depends on the state.
        Some(end) => {
            let width = end - variables.phase_start;
            ((phase(&point.q) - variables.phase_start) / width, phase(&point.qd) / width, phase(&point.qdd) / width)
        }
        // On the zero dynamics the phase is the relative time.
        None => (
            constant::<D>(k as f64 / (domain.points() - 1) as f64),
            constant::<D>(1.0) / variables.duration,
            constant::<D>(0.0),
        ),
    };
    for (j, &output) in domain.outputs.iter().enumerate() {
        let [y, slope, curvature] = bezier(&variables.bezier[j], s);
        rows.add(RowKind::OutputPosition, j, point.q[output] - y);
        rows.add(RowKind::OutputVelocity, j, point.qd[output] - slope * sd);
        let error = point.qdd[output] - curvature * sd * sd - slope * sdd;
        rows.add(RowKind::OutputAcceleration, j, error / 10.0);
    }
}

/// Hip phase, hip velocity.
fn hip<D: Scalar>(problem: &Problem, gait: &GaitVariables<D>, d: usize, k: usize, rows: &mut Rows<D>) {
    let (domain, variables) = (&problem.domains[d], &gait.domains[d]);
    let point = &variables.points[k];
    let phase = |q: &[D; 9]| problem.walker.hip_phase(domain.stance, q);
    let Some(index) = domain.hip_velocity else {
        if k == 0 {
            rows.add(RowKind::HipPhase, 0, phase(&point.q) - variables.phase_start);
        }
        if k == domain.points() - 1 {
            rows.add(RowKind::PhaseEnd, 0, phase(&point.q) - variables.phase_end.unwrap());
        }
        rows.add(RowKind::PhaseRate, 0, phase(&point.qd));
        return;
    };
    let velocity = gait.hip_velocities[index];
    let time = variables.duration * (k as f64 / (domain.points() - 1) as f64);
    rows.add(RowKind::HipPhase, 0, phase(&point.q) - variables.phase_start - velocity * time);
    if k > 0 || domain.opens_with_impact() {
        rows.add(RowKind::HipVelocity, 0, phase(&point.qd) - velocity);
    }
    rows.add(RowKind::HipAcceleration, 0, phase(&point.qdd) / 10.0);
}

/// Force equilibrium of fibre and tendon; torques of the muscle-driven joints.
fn muscle_rows<D: Scalar>(problem: &Problem, point: &Point<D>, fibres: &[[D; 10]; 3], rows: &mut Rows<D>) {
    let mut driven = [constant::<D>(0.0); 4];
    for (m, muscle) in problem.muscles.iter().enumerate() {
        let [length, velocity, activation] = [fibres[0][m], fibres[1][m], fibres[2][m]];
        let tendon = muscles::tendon_force(muscles::strain(muscle, &point.q, length));
        let active = activation * muscles::force_length(length) * muscles::force_velocity(velocity / muscle.speed);
        rows.add(RowKind::MuscleForce, m, active - tendon);
        for joint in &muscle.joints {
            driven[joint.0 - 3] += muscles::arm(joint, point.q[joint.0]) * tendon * muscle.force;
        }
    }
    for i in 0..4 {
        rows.add(RowKind::MuscleTorque, i, (point.u[i] - driven[i]) / 100.0);
    }
}

/// Friction cone of each foot on the ground, stance foot first.
fn friction<D: Scalar>(problem: &Problem, domain: &Domain, point: &Point<D>, rows: &mut Rows<D>) {
    let mut component = 0;
    for side in [domain.stance, 1 - domain.stance] {
        let (mut sums, mut touching) = ([constant::<D>(0.0); 2], false);
        for (contact, force) in domain.contacts.iter().zip(&point.force) {
            if contact.0 / 2 == side {
                sums[contact.1] += *force;
                touching = true;
            }
        }
        if touching {
            rows.add(RowKind::Friction, component, (sums[1] * problem.friction - sums[0]) / 500.0);
            rows.add(RowKind::Friction, component + 1, (sums[1] * problem.friction + sums[0]) / 500.0);
            component += 2;
        }
    }
}

/// Heights of the points in the air, and vertical velocity of the point that lands next.
fn heights<D: Scalar>(
    problem: &Problem,
    gait: &GaitVariables<D>,
    d: usize,
    k: usize,
    state: &State<D>,
    rows: &mut Rows<D>,
) {
    let domain = &problem.domains[d];
    let last = k == domain.points() - 1;
    let (stance, swing) = (domain.stance, 1 - domain.stance);
    for point in 0..4 {
        if domain.contacts.iter().any(|contact| contact.0 == point) {
            continue;
        }
        let made_zero = match domain.kind {
            Kind::Ds2 => last && point == 2 * stance + 1,
            Kind::Ds3 => false,
            Kind::Ss2 => k == 0 && point == 2 * swing + 1,
            Kind::Ss1 => (k == 0 && point == 2 * stance) || (last && point == 2 * swing),
        };
        if made_zero {
            continue;
        }
        let z = state.position(&problem.walker.foot_point(point))[1];
        let single_support = matches!(domain.kind, Kind::Ss2 | Kind::Ss1);
        if single_support && point / 2 == swing {
            let sigma = k as f64 / (domain.points() - 1) as f64;
            let (elapsed, total) = if domain.kind == Kind::Ss2 {
                let (own, next) = (gait.domains[d].duration, gait.domains[d + 1].duration);
                (own * sigma, own + next)
            } else {
                let (before, own) = (gait.domains[d - 1].duration, gait.domains[d].duration);
                (before + own * sigma, before + own)
            };
            let w = elapsed / total;
            let bump = w * (constant::<D>(1.0) - w) * 4.0;
            rows.add(RowKind::Clearance, point, z * 10.0 - bump * bump * (10.0 * problem.clearance));
        } else {
            rows.add(RowKind::Height, point, z * 10.0);
        }
    }
    let landing = match domain.kind {
        Kind::Ds2 => Some(2 * stance + 1),
        Kind::Ss1 => Some(2 * swing),
        Kind::Ds3 | Kind::Ss2 => None,
    };
    if let (true, Some(point)) = (last, landing) {
        rows.add(RowKind::TouchdownSpeed, point, state.velocity(&problem.walker.foot_point(point))[1]);
    }
}

/// Hermite-Simpson defects (midpoint, endpoint) over one interval of length h.
fn defects<D: Scalar>(z: [D; 3], f: [D; 3], h: D) -> [D; 2] {
    [z[1] - ((z[0] + z[2]) * 0.5 + h * 0.125 * (f[0] - f[2])), z[2] - (z[0] + h / 6.0 * (f[0] + f[1] * 4.0 + f[2]))]
}

/// Integration of the hip phase in SS1 and of the fibre lengths everywhere.
fn integration_rows<D: Scalar>(problem: &Problem, gait: &GaitVariables<D>, d: usize, rows: &mut Rows<D>) {
    let (domain, variables) = (&problem.domains[d], &gait.domains[d]);
    let h = variables.duration / domain.intervals as f64;
    for interval in 0..domain.intervals {
        let points: [&Point<D>; 3] = std::array::from_fn(|i| &variables.points[2 * interval + i]);
        let mut add = |kinds: [RowKind; 2], component, z, f| {
            for (i, defect) in defects(z, f, h).into_iter().enumerate() {
                rows.at(d, 2 * interval + 1 + i);
                rows.add(kinds[i], component, defect);
            }
        };
        if domain.kind == Kind::Ss1 {
            let [z, f, a] = [
                points.map(|p| problem.walker.hip_phase(domain.stance, &p.q)),
                points.map(|p| problem.walker.hip_phase(domain.stance, &p.qd)),
                points.map(|p| problem.walker.hip_phase(domain.stance, &p.qdd)),
            ];
            add([RowKind::MidpointPhase, RowKind::EndpointPhase], 0, z, f);
            add([RowKind::MidpointPhaseRate, RowKind::EndpointPhaseRate], 0, f, a);
        }
        if let [Some(a), Some(b), Some(c)] = points.map(|p| p.fibres.as_ref()) {
            for m in 0..problem.muscles.len() {
                let [z, f] = [0, 1].map(|i| [a[i][m], b[i][m], c[i][m]]);
                add([RowKind::MidpointFibre, RowKind::EndpointFibre], m, z, f);
            }
        }
    }
}

/// Resets to the next domain.
fn transition_rows<D: Scalar>(problem: &Problem, gait: &GaitVariables<D>, d: usize, rows: &mut Rows<D>) {
    let next = (d + 1) % 8;
    let before = &gait.domains[d].points[problem.domains[d].points() - 1];
    let after = &gait.domains[next].points[0];
    rows.place = RowPlace::Transition { domain: d };
    for i in 0..9 {
        let shift = if i == 0 && next == 0 { gait.stride } else { constant(0.0) };
        rows.add(RowKind::PositionReset, i, after.q[i] - (before.q[i] - shift));
    }
    let jump: [D; 9] = std::array::from_fn(|i| after.qd[i] - before.qd[i]);
    if problem.domains[next].opens_with_impact() {
        // Inverse dynamics at rest without gravity is M times the "acceleration".
        let state = State::new(&after.q, &[constant(0.0); 9], &jump);
        let mut momentum = problem.walker.inverse_dynamics(&state, 0.0);
        let impulse = &gait.domains[next].impulse;
        for (contact, value) in problem.domains[next].contacts.iter().zip(impulse) {
            let mut vector = [constant::<D>(0.0); 2];
            vector[contact.1] = *value;
            let by_contact = state.generalised_force(&problem.walker.foot_point(contact.0), &vector);
            for i in 0..9 {
                momentum[i] -= by_contact[i];
            }
        }
        for i in 0..9 {
            rows.add(RowKind::Impact, i, momentum[i] / 5.0);
        }
        if problem.domains[next].kind == Kind::Ds2 {
            let normal = impulse[1] * problem.impact_friction;
            rows.add(RowKind::ImpactFriction, 0, (normal - impulse[0]) / 20.0);
            rows.add(RowKind::ImpactFriction, 1, (normal + impulse[0]) / 20.0);
        }
    } else {
        for i in 0..9 {
            rows.add(RowKind::VelocityReset, i, jump[i] / 3.0);
        }
    }
    if let (Some(before), Some(after)) = (&before.fibres, &after.fibres) {
        for m in 0..problem.muscles.len() {
            rows.add(RowKind::FibreReset, m, after[0][m] - before[0][m]);
        }
    }
}
