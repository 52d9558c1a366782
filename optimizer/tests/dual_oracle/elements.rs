//! Property tests: elements of the gait problem match dual numbers for random arguments.

use crate::muscles;
use crate::rows::bezier;
use crate::walker::{GRAVITY, State, Walker};
use gait_optimizer::body::dynamics::LinkHessian;
use gait_optimizer::body::{FootPoint, InverseDynamics, PointState, Side, WalkerModel};
use gait_optimizer::muscle::{CurveValue, MUSCLES, force_length, force_velocity, tendon_force};
use gait_optimizer::walking::basis;
use gait_optimizer::{Device, Subject};
use num_dual::{Dual2_64, Dual64, HyperDual64};
use proptest::array::{uniform6, uniform9};
use proptest::prelude::*;

fn close(what: &str, ours: f64, dual: f64, tolerance: f64) {
    assert!((ours - dual).abs() <= tolerance * dual.abs().max(1.0), "{what}: ours {ours}, dual {dual}");
}

fn curve(what: &str, ours: CurveValue, dual: Dual2_64) {
    close(what, ours.value, dual.re, 1e-12);
    close(&format!("{what}, first derivative"), ours.first, dual.v1, 1e-10);
    close(&format!("{what}, second derivative"), ours.second, dual.v2, 1e-9);
}

fn variable(x: f64) -> Dual2_64 {
    Dual2_64::new(x, 1.0, 0.0)
}

fn walkers() -> (WalkerModel, Walker) {
    let model = WalkerModel::new(&Subject::builtin(1).unwrap(), &Device::ampro3().unwrap()).unwrap();
    (model, Walker::new(1.727, 65.7))
}

fn dual(re: [f64; 9], eps: [f64; 9]) -> [Dual64; 9] {
    std::array::from_fn(|i| Dual64::new(re[i], eps[i]))
}

fn unit(i: usize) -> [f64; 9] {
    std::array::from_fn(|j| if i == j { 1.0 } else { 0.0 })
}

proptest! {
    #[test]
    fn muscle_curves_match_dual_numbers(x in 0.2..1.8_f64, nu in -1.2..1.2_f64, strain in -0.2..0.12_f64) {
        curve("force over length", force_length(x), muscles::force_length(variable(x)));
        curve("force over velocity", force_velocity(nu), muscles::force_velocity(variable(nu)));
        // The plain form loses digits below the slack length, so derivatives are compared above it only.
        let dual = muscles::tendon_force(variable(strain));
        if strain > -0.02 {
            curve("tendon force", tendon_force(strain), dual);
        } else {
            prop_assert!(tendon_force(strain).value >= 0.0 && tendon_force(strain).value < 1e-5);
            close("tendon force", tendon_force(strain).value, dual.re, 1e-12);
        }
    }

    #[test]
    fn muscle_geometry_matches_dual_numbers(q in uniform9(-1.2..1.2_f64)) {
        for (muscle, theirs) in MUSCLES.iter().zip(muscles::table()) {
            let mut attachments: Vec<_> = muscle.attachments.iter().flatten().collect();
            attachments.sort_by_key(|a| a.coordinate);
            let mut joints = theirs.joints.clone();
            joints.sort_by_key(|j| j.0);
            prop_assert_eq!(attachments.len(), joints.len());
            for (attachment, joint) in attachments.into_iter().zip(&joints) {
                let angle = q[joint.0];
                let ours = attachment.at(angle);
                let length = muscles::length_change(joint, variable(angle));
                let arm = muscles::arm(joint, variable(angle));
                for (what, a, b) in [
                    ("length", ours.length, length.re),
                    ("length'", ours.length_first, length.v1),
                    ("length''", ours.length_second, length.v2),
                    ("arm", ours.arm, arm.re),
                    ("arm'", ours.arm_first, arm.v1),
                    ("arm''", ours.arm_second, arm.v2),
                ] {
                    close(&format!("{} {what}", muscle.name), a, b, 1e-13);
                }
            }
        }
    }

    #[test]
    fn bezier_curves_match_dual_numbers(alpha in uniform6(-4.0..4.0_f64), s in -0.3..1.3_f64) {
        let along = bezier(&alpha.map(Dual2_64::from), variable(s));
        let weights = basis(s);
        let sum = |order: usize| -> f64 { alpha.iter().zip(&weights[order]).map(|(a, b)| a * b).sum() };
        close("value", sum(0), along[0].re, 1e-11);
        close("slope", sum(1), along[0].v1, 1e-11);
        close("curvature", sum(2), along[0].v2, 1e-10);
        close("curve of the first differences", along[1].re, along[0].v1, 1e-11);
        close("curve of the second differences", along[2].re, along[0].v2, 1e-10);
    }

    #[test]
    fn foot_points_match_dual_numbers(q in uniform9(-1.5..1.5_f64), qd in uniform9(-5.0..5.0_f64), qdd in uniform9(-50.0..50.0_f64)) {
        let (model, walker) = walkers();
        let ours = PointState::new(&q, &qd, &qdd);
        for (index, (point, side)) in [
            (FootPoint::Heel, Side::Left),
            (FootPoint::Toe, Side::Left),
            (FootPoint::Heel, Side::Right),
            (FootPoint::Toe, Side::Right),
        ]
        .into_iter()
        .enumerate()
        {
            let contact = model.contact_point(point, side);
            let chain = walker.foot_point(index);
            // Velocity is the time derivative of position, acceleration of velocity.
            let moving = State::new(&dual(q, qd), &dual(qd, qdd), &[Dual64::from(0.0); 9]);
            let (position, velocity) = (moving.position(&chain), moving.velocity(&chain));
            for axis in 0..2 {
                close("position", ours.contact_position(&contact)[axis], position[axis].re, 1e-12);
                close("velocity", ours.contact_velocity(&contact)[axis], position[axis].eps, 1e-12);
                close("acceleration", ours.contact_acceleration(&contact)[axis], velocity[axis].eps, 1e-12);
            }
        }
    }

    #[test]
    fn equations_of_motion_match_dual_numbers(
        q in uniform9(-1.5..1.5_f64),
        qd in uniform9(-5.0..5.0_f64),
        qdd in uniform9(-50.0..50.0_f64),
        multipliers in uniform9(-1.0..1.0_f64),
        d in uniform9(-1.0..1.0_f64),
        e in uniform9(-1.0..1.0_f64),
    ) {
        let (model, walker) = walkers();
        let dynamics = InverseDynamics::new(&model);
        let state = PointState::new(&q, &qd, &qdd);
        let zero = [0.0; 9];
        let along = |a: [f64; 9], b: [f64; 9], c: [f64; 9]| {
            walker.inverse_dynamics(&State::new(&dual(q, a), &dual(qd, b), &dual(qdd, c)), GRAVITY)
        };
        let ours = dynamics.rows(&state);
        let jacobian = dynamics.jacobian(&state);
        let mass = dynamics.mass_matrix(&q);
        for j in 0..9 {
            let by_acceleration = along(zero, zero, unit(j));
            for i in 0..9 {
                close("inverse dynamics", ours[i], by_acceleration[i].re, 1e-11);
                close("mass matrix", mass[i][j], by_acceleration[i].eps, 1e-11);
                close("by acceleration", jacobian.mass[i][j], by_acceleration[i].eps, 1e-11);
            }
        }
        for j in 0..7 {
            let (by_angle, by_rate) = (along(unit(2 + j), zero, zero), along(zero, unit(2 + j), zero));
            for i in 0..9 {
                close("by angle", jacobian.angle[i][j], by_angle[i].eps, 1e-10);
                close("by rate", jacobian.rate[i][j], by_rate[i].eps, 1e-10);
            }
        }
        // The dynamics do not depend on position and velocity of the hip.
        for j in 0..2 {
            let (by_base, by_base_rate) = (along(unit(j), zero, zero), along(zero, unit(j), zero));
            for i in 0..9 {
                prop_assert_eq!(by_base[i].eps, 0.0);
                prop_assert_eq!(by_base_rate[i].eps, 0.0);
            }
        }
        // Second derivatives with respect to posture and rates.
        let mut link = LinkHessian::default();
        dynamics.add_hessian(&state, &multipliers, &mut link);
        let hessian = link.generalised();
        let hyper = |re: [f64; 9], one: [f64; 9], two: [f64; 9]| -> [HyperDual64; 9] {
            std::array::from_fn(|i| HyperDual64::new(re[i], one[i], two[i], 0.0))
        };
        let second = |rows: [HyperDual64; 9]| -> f64 {
            rows.iter().zip(&multipliers).map(|(row, lambda)| lambda * row.eps1eps2).sum()
        };
        let bilinear = |h: &[[f64; 7]; 7], symmetric: bool| -> f64 {
            let mut sum = 0.0;
            for i in 0..7 {
                for j in 0..7 {
                    let upper = if symmetric && j > i { h[j][i] } else { h[i][j] };
                    sum += d[2 + i] * upper * e[2 + j];
                }
            }
            sum
        };
        let (one, two) = (d, e);
        let angle_angle = State::new(&hyper(q, one, two), &hyper(qd, zero, zero), &hyper(qdd, zero, zero));
        close("angle, angle", bilinear(&hessian.angle_angle, true), second(walker.inverse_dynamics(&angle_angle, GRAVITY)), 1e-9);
        let angle_rate = State::new(&hyper(q, one, zero), &hyper(qd, zero, two), &hyper(qdd, zero, zero));
        close("angle, rate", bilinear(&hessian.angle_rate, false), second(walker.inverse_dynamics(&angle_rate, GRAVITY)), 1e-9);
        let rate_rate = State::new(&hyper(q, zero, zero), &hyper(qd, one, two), &hyper(qdd, zero, zero));
        close("rate, rate", bilinear(&hessian.rate_rate, true), second(walker.inverse_dynamics(&rate_rate, GRAVITY)), 1e-9);
        let only_angles: [f64; 9] = std::array::from_fn(|i| if i < 2 { 0.0 } else { two[i] });
        let acceleration = State::new(&hyper(q, one, zero), &hyper(qd, zero, zero), &hyper(qdd, zero, only_angles));
        close("angle, acceleration", bilinear(&hessian.angle_acceleration, false), second(walker.inverse_dynamics(&acceleration, GRAVITY)), 1e-9);
    }
}
