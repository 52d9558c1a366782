//! Tests of energy, momentum and statics, independent of formulas.

use crate::random::Random;
use crate::walker::{GRAVITY, State, Walker};
use gait_optimizer::body::{InverseDynamics, PointState, WalkerModel};
use gait_optimizer::gait_problem::row_names::RowPlace;
use gait_optimizer::gait_problem::{GaitProgram, PointVariables, RowKind};
use gait_optimizer::{Device, GaitSettings, ReferenceGait, Subject, TunedBounds};
use interior_point::NonlinearProgram;
use nalgebra::{DMatrix, DVector, SMatrix, SVector};
use num_dual::Dual64;

type Vector9 = SVector<f64, 9>;
type Matrix9 = SMatrix<f64, 9, 9>;

/// The model of the crate, and the second implementation that measures energy and momentum.
struct Twin {
    model: WalkerModel,
    walker: Walker,
}

fn twins() -> Vec<Twin> {
    [(1, 1.727, 65.7), (2, 1.803, 75.0)]
        .into_iter()
        .map(|(subject, height, mass)| Twin {
            model: WalkerModel::new(&Subject::builtin(subject).unwrap(), &Device::ampro3().unwrap()).unwrap(),
            walker: Walker::new(height, mass),
        })
        .collect()
}

impl Twin {
    fn mass(&self, q: &[f64; 9]) -> Matrix9 {
        let rows = InverseDynamics::new(&self.model).mass_matrix(q);
        Matrix9::from_fn(|i, j| rows[i][j])
    }

    /// h(q, qd), gravity included.
    fn bias(&self, q: &[f64; 9], qd: &[f64; 9]) -> Vector9 {
        Vector9::from(InverseDynamics::new(&self.model).rows(&PointState::new(q, qd, &[0.0; 9])))
    }

    fn energy(&self, q: &[f64; 9], qd: &[f64; 9]) -> f64 {
        let [kinetic, potential] = self.walker.energy(&State::new(q, qd, &[0.0; 9]));
        kinetic + potential
    }

    /// Jacobian rows of foot points (index, axis) by dual numbers.
    fn contact_jacobian(&self, q: &[f64; 9], contacts: &[(usize, usize)]) -> DMatrix<f64> {
        let mut result = DMatrix::zeros(contacts.len(), 9);
        for j in 0..9 {
            let moved: [Dual64; 9] = std::array::from_fn(|i| Dual64::new(q[i], if i == j { 1.0 } else { 0.0 }));
            let state = State::new(&moved, &[Dual64::from(0.0); 9], &[Dual64::from(0.0); 9]);
            for (row, contact) in contacts.iter().enumerate() {
                result[(row, j)] = state.position(&self.walker.foot_point(contact.0))[contact.1].eps;
            }
        }
        result
    }

    /// Accelerations without torques, with the listed foot points fixed: `M qdd + h = J^T lambda`,
    /// `J qdd + Jdot qd = 0`.
    fn unforced(&self, q: &[f64; 9], qd: &[f64; 9], held: &[(usize, usize)]) -> [f64; 9] {
        let jacobian = self.contact_jacobian(q, held);
        let size = 9 + held.len();
        let mut system = DMatrix::zeros(size, size);
        system.view_mut((0, 0), (9, 9)).copy_from(&self.mass(q));
        system.view_mut((0, 9), (9, held.len())).copy_from(&(-jacobian.transpose()));
        system.view_mut((9, 0), (held.len(), 9)).copy_from(&jacobian);
        let bias = self.bias(q, qd);
        let drift = State::new(q, qd, &[0.0; 9]);
        let rhs = DVector::from_fn(size, |i, _| {
            if i < 9 {
                -bias[i]
            } else {
                let (point, axis) = held[i - 9];
                -drift.acceleration(&self.walker.foot_point(point))[axis]
            }
        });
        let solution = system.lu().solve(&rhs).unwrap();
        std::array::from_fn(|i| solution[i])
    }

    /// Integrates by the classical Runge-Kutta method of order 4.
    fn integrate(
        &self,
        mut q: [f64; 9],
        mut qd: [f64; 9],
        held: &[(usize, usize)],
        seconds: f64,
        steps: usize,
    ) -> ([f64; 9], [f64; 9]) {
        let h = seconds / steps as f64;
        let add =
            |a: &[f64; 9], b: &[f64; 9], factor: f64| -> [f64; 9] { std::array::from_fn(|i| a[i] + factor * b[i]) };
        for _ in 0..steps {
            let a1 = self.unforced(&q, &qd, held);
            let v2 = add(&qd, &a1, 0.5 * h);
            let a2 = self.unforced(&add(&q, &qd, 0.5 * h), &v2, held);
            let v3 = add(&qd, &a2, 0.5 * h);
            let a3 = self.unforced(&add(&q, &v2, 0.5 * h), &v3, held);
            let v4 = add(&qd, &a3, h);
            let a4 = self.unforced(&add(&q, &v3, h), &v4, held);
            for i in 0..9 {
                q[i] += h / 6.0 * (qd[i] + 2.0 * v2[i] + 2.0 * v3[i] + v4[i]);
                qd[i] += h / 6.0 * (a1[i] + 2.0 * a2[i] + 2.0 * a3[i] + a4[i]);
            }
        }
        (q, qd)
    }
}

fn close(what: &str, a: f64, b: f64, tolerance: f64) {
    assert!((a - b).abs() <= tolerance, "{what}: {a} {b}, difference {:e}", a - b);
}

#[test]
fn mass_matrix_is_symmetric_positive_definite_and_gives_the_kinetic_energy() {
    let mut random = Random::new(1);
    for twin in twins() {
        for _ in 0..50 {
            let (q, qd) = (random.array(2.0), random.array(5.0));
            let mass = twin.mass(&q);
            assert!((mass - mass.transpose()).amax() < 1e-12);
            assert!(mass.cholesky().is_some());
            let v = Vector9::from(qd);
            let [kinetic, _] = twin.walker.energy(&State::new(&q, &qd, &[0.0; 9]));
            close("kinetic energy", 0.5 * (v.transpose() * mass * v)[0], kinetic, 1e-11 * kinetic);
            // The translation block is the total mass.
            close("total mass", mass[(0, 0)], twin.model.total_mass, 1e-12);
            close("total mass", mass[(1, 1)], twin.walker.total_mass(), 1e-11);
            close("no coupling of x and z", mass[(0, 1)], 0.0, 1e-12);
        }
    }
}

#[test]
fn mechanical_power_is_the_rate_of_energy() {
    let mut random = Random::new(2);
    for twin in twins() {
        for _ in 0..50 {
            let (q, qd, qdd): ([f64; 9], [f64; 9], [f64; 9]) =
                (random.array(2.0), random.array(5.0), random.array(50.0));
            let force = InverseDynamics::new(&twin.model).rows(&PointState::new(&q, &qd, &qdd));
            let power: f64 = force.iter().zip(&qd).map(|(f, v)| f * v).sum();
            let size: f64 = force.iter().zip(&qd).map(|(f, v)| (f * v).abs()).sum();
            // dE/dt along q' = qd, qd' = qdd.
            let moving = State::new(
                &std::array::from_fn(|i| Dual64::new(q[i], qd[i])),
                &std::array::from_fn(|i| Dual64::new(qd[i], qdd[i])),
                &[Dual64::from(0.0); 9],
            );
            let [kinetic, potential] = twin.walker.energy(&moving);
            close("power", power, (kinetic + potential).eps, 1e-11 * size);
            // The base rows are Newton's law of the whole body, and angular momentum changes by the moment about the
            // origin of gravity and of the force at the hip, and by the torque that leans the torso.
            let momentum = twin.walker.momentum(&moving);
            close("force x", force[0], momentum[0].eps, 1e-10 * size.max(1.0));
            close("force z", force[1], momentum[1].eps + twin.walker.total_mass() * GRAVITY, 1e-10 * size.max(1.0));
            let weight = twin.walker.total_mass() * GRAVITY;
            let moment =
                q[0] * force[1] - q[1] * force[0] - force[2] - twin.walker.centre_of_mass(&moving)[0].re * weight;
            close("moment", moment, momentum[2].eps, 1e-10 * size.max(1.0));
        }
    }
}

#[test]
fn free_flight_conserves_energy_and_momentum() {
    for twin in twins() {
        let q = [0.0, 1.2, 0.1, 0.4, 0.3, -0.1, -0.2, 0.5, 0.1];
        let qd = [1.1, 0.8, 0.5, -2.0, 3.0, 1.0, 2.5, -1.5, 2.0];
        let seconds = 0.4;
        let (end, rate) = twin.integrate(q, qd, &[], seconds, 400);
        let before = twin.energy(&q, &qd);
        close("energy", twin.energy(&end, &rate), before, 1e-8 * before);
        let (start, finish) = (State::new(&q, &qd, &[0.0; 9]), State::new(&end, &rate, &[0.0; 9]));
        let (p0, p1) = (twin.walker.momentum(&start), twin.walker.momentum(&finish));
        let mass = twin.walker.total_mass();
        close("momentum x", p1[0], p0[0], 1e-8);
        close("momentum z", p1[1], p0[1] - mass * GRAVITY * seconds, 1e-8);
        // Angular momentum about the centre of mass.
        let about = |state: &State<f64>, p: [f64; 3]| {
            let c = twin.walker.centre_of_mass(state);
            p[2] - (c[0] * p[1] - c[1] * p[0])
        };
        close("angular momentum", about(&finish, p1), about(&start, p0), 1e-8);
        // The centre of mass falls on its parabola.
        let (c0, c1) = (twin.walker.centre_of_mass(&start), twin.walker.centre_of_mass(&finish));
        close("centre x", c1[0], c0[0] + p0[0] / mass * seconds, 1e-9);
        close("centre z", c1[1], c0[1] + p0[1] / mass * seconds - 0.5 * GRAVITY * seconds * seconds, 1e-9);
    }
}

#[test]
fn unforced_motion_about_a_fixed_toe_conserves_energy() {
    for twin in twins() {
        // Stance on the right toe (point 3): velocities projected onto the contact.
        let held = [(3, 0), (3, 1)];
        let q = [0.0, 0.9, 0.05, 0.3, 0.4, 0.0, -0.15, 0.1, 0.1];
        let wish = DVector::from_row_slice(&[1.0, 0.1, 0.2, 1.0, -1.0, 0.3, -0.8, 0.2, -0.4]);
        let jacobian = twin.contact_jacobian(&q, &held);
        let gram = &jacobian * jacobian.transpose();
        let qd = &wish - jacobian.transpose() * gram.lu().solve(&(&jacobian * &wish)).unwrap();
        let qd: [f64; 9] = std::array::from_fn(|i| qd[i]);
        let (end, rate) = twin.integrate(q, qd, &held, 0.2, 800);
        let before = twin.energy(&q, &qd);
        close("energy", twin.energy(&end, &rate), before, 1e-8 * before);
        let moved = (0..9).map(|i| (end[i] - q[i]).abs()).fold(0.0, f64::max);
        assert!(moved > 0.1, "the walker should swing: {moved}");
        for axis in 0..2 {
            let toe = twin.walker.foot_point(3);
            let position = |q: &[f64; 9]| State::new(q, &[0.0; 9], &[0.0; 9]).position(&toe)[axis];
            close("toe stays", position(&end), position(&q), 1e-8);
        }
    }
}

fn program(subject: u32) -> GaitProgram {
    GaitProgram::new(
        &Subject::builtin(subject).unwrap(),
        &Device::ampro3().unwrap(),
        &TunedBounds::default(),
        false,
        &GaitSettings::default(),
        &ReferenceGait::builtin().unwrap(),
    )
    .unwrap()
}

fn standing() -> PointVariables {
    PointVariables {
        q: [0.0; 9],
        qd: [0.0; 9],
        qdd: [0.0; 9],
        u: [0.0; 6],
        force: [0.0; 5],
        fibre_length: [1.0; 10],
        fibre_velocity: [0.0; 10],
        activation: [0.0; 10],
    }
}

/// The (row, component) of a kind at a point or transition.
fn rows_of(program: &GaitProgram, place: RowPlace, kind: RowKind) -> Vec<(usize, usize)> {
    let names = program.rows.names.iter().enumerate();
    names.filter(|(_, n)| n.place == place && n.kind == kind).map(|(i, n)| (i, n.component)).collect()
}

#[test]
fn impacts_are_plastic_lose_energy_and_balance_momentum() {
    let mut random = Random::new(4);
    for (subject, twin) in (1..).zip(twins()) {
        let program = program(subject);
        // The contacts after right heel strike: right heel, left toe.
        let contacts = [(2, 0), (2, 1), (1, 0), (1, 1)];
        for _ in 0..20 {
            let (q, before): ([f64; 9], [f64; 9]) = (random.array(0.5), random.array(3.0));
            let mass = twin.mass(&q);
            let jacobian = twin.contact_jacobian(&q, &contacts);
            let mut system = DMatrix::zeros(13, 13);
            system.view_mut((0, 0), (9, 9)).copy_from(&mass);
            system.view_mut((0, 9), (9, 4)).copy_from(&(-jacobian.transpose()));
            system.view_mut((9, 0), (4, 9)).copy_from(&jacobian);
            let momentum = mass * Vector9::from(before);
            let rhs = DVector::from_fn(13, |i, _| if i < 9 { momentum[i] } else { 0.0 });
            let solution = system.lu().solve(&rhs).unwrap();
            let after: [f64; 9] = std::array::from_fn(|i| solution[i]);
            let impulse: [f64; 4] = std::array::from_fn(|i| solution[9 + i]);

            // Kinetic energy falls by that of the jump (Carnot's theorem).
            let jump = Vector9::from(after) - Vector9::from(before);
            let kinetic = |v: &[f64; 9]| twin.walker.energy(&State::new(&q, v, &[0.0; 9]))[0];
            let lost = kinetic(&before) - kinetic(&after);
            close("Carnot", lost, 0.5 * (jump.transpose() * mass * jump)[0], 1e-9 * kinetic(&before));
            assert!(lost > 0.0);
            // Linear and angular momentum change by the impulses and their moments.
            let state = |v: &[f64; 9]| State::new(&q, v, &[0.0; 9]);
            let (p0, p1) = (twin.walker.momentum(&state(&before)), twin.walker.momentum(&state(&after)));
            let (heel, toe) = (
                state(&before).position(&twin.walker.foot_point(2)),
                state(&before).position(&twin.walker.foot_point(1)),
            );
            close("impulse x", p1[0] - p0[0], impulse[0] + impulse[2], 1e-8);
            close("impulse z", p1[1] - p0[1], impulse[1] + impulse[3], 1e-8);
            let moment = heel[0] * impulse[1] - heel[1] * impulse[0] + toe[0] * impulse[3] - toe[1] * impulse[2];
            close("moment of the impulses", p1[2] - p0[2], moment, 1e-8);

            // The rows of the gait problem vanish, and detect a wrong impulse.
            let layout = &program.layout;
            let mut x = vec![0.0; layout.variables];
            for domain in &layout.domains {
                x[domain.duration] = 1.0;
                if let Some(end) = domain.phase_end {
                    x[end] = 1.0;
                }
            }
            x[layout.stride_length] = 1.0;
            let last = layout.domains[7].last();
            layout.set_point_variables(&mut x, 7, last, &PointVariables { q, qd: before, ..standing() });
            layout.set_point_variables(&mut x, 0, 0, &PointVariables { q, qd: after, ..standing() });
            let first = layout.domains[0].impulse.unwrap();
            for c in 0..4 {
                x[first + c] = impulse[c] / layout.scale[first + c];
            }
            let mut g = vec![0.0; program.rows()];
            program.constraints(&x, &mut g);
            let impact = rows_of(&program, RowPlace::Transition { domain: 7 }, RowKind::Impact);
            let at_rest = rows_of(&program, RowPlace::Point { domain: 0, point: 0 }, RowKind::ContactVelocity);
            assert_eq!((impact.len(), at_rest.len()), (9, 4));
            for &(row, _) in impact.iter().chain(&at_rest) {
                close("row", g[row], 0.0, 1e-9);
            }
            x[first + 1] += 1.0 / layout.scale[first + 1];
            program.constraints(&x, &mut g);
            let wrong = impact.iter().map(|&(row, _)| g[row].abs()).fold(0.0, f64::max);
            assert!(wrong > 0.1, "an impulse that is 1 N s off leaves {wrong}");
        }
    }
}

#[test]
fn ground_carries_the_weight_in_upright_standing() {
    for (subject, twin) in (1..).zip(twins()) {
        let program = program(subject);
        let height = [1.727, 1.803][subject as usize - 1];
        let mut point = standing();
        point.q[1] = 0.530 * height;
        let state = State::new(&point.q, &point.qd, &point.qdd);
        // Both feet are flat on the ground.
        for foot in 0..4 {
            close("height", state.position(&twin.walker.foot_point(foot))[1], 0.0, 1e-12);
        }
        // SS2 of the right step: one flat foot carries the whole weight.
        let contacts = [(3, 0), (2, 1), (3, 1)];
        let jacobian = twin.contact_jacobian(&point.q, &contacts);
        let bias = twin.bias(&point.q, &point.qd);
        let mut system = DMatrix::zeros(9, 9);
        for i in 0..6 {
            system[(3 + i, i)] = 1.0;
        }
        system.view_mut((0, 6), (9, 3)).copy_from(&jacobian.transpose());
        let solution = system.lu().solve(&DVector::from_fn(9, |i, _| bias[i])).unwrap();
        for i in 0..6 {
            point.u[i] = solution[i];
        }
        for c in 0..3 {
            point.force[c] = solution[6 + c];
        }
        let weight = twin.walker.total_mass() * GRAVITY;
        close("no shear", point.force[0], 0.0, 1e-9);
        close("the normal forces are the weight", point.force[1] + point.force[2], weight, 1e-9);
        // The centre of pressure is under the centre of mass.
        let along = |foot: usize| state.position(&twin.walker.foot_point(foot))[0];
        let pressure = (point.force[1] * along(2) + point.force[2] * along(3)) / weight;
        close("centre of pressure", pressure, twin.walker.centre_of_mass(&state)[0], 1e-12);
        // The swing leg hangs straight: its knee and ankle torques are due to small offsets only.
        assert!(point.u[1].abs() < 10.0 && point.u[2].abs() < 10.0, "{:?}", point.u);
        // The equation of motion of the gait problem vanishes, and detects an error of 1 N.
        let layout = &program.layout;
        let mut x = vec![0.5; layout.variables];
        layout.set_point_variables(&mut x, 2, 1, &point);
        let mut g = vec![0.0; program.rows()];
        program.constraints(&x, &mut g);
        let rows = rows_of(&program, RowPlace::Point { domain: 2, point: 1 }, RowKind::Dynamics);
        assert_eq!(rows.len(), 9);
        for &(row, _) in &rows {
            close("equation of motion", g[row], 0.0, 1e-10);
        }
        point.force[1] += 1.0;
        layout.set_point_variables(&mut x, 2, 1, &point);
        program.constraints(&x, &mut g);
        let wrong = rows.iter().map(|&(row, _)| g[row].abs()).fold(0.0, f64::max);
        close("a newton too much", wrong, 0.01, 1e-9);
    }
}
