//! Walker and muscles match the values of an independent implementation (`tests/data/README.md`).

#![allow(clippy::unwrap_used, clippy::panic, clippy::expect_used)]

use gait_optimizer::body::{FootPoint, InverseDynamics, PointState, Side, WalkerModel};
use gait_optimizer::muscle::{MUSCLES, force_length, force_velocity, tendon_force};
use gait_optimizer::walking::{CYCLE, impact, kinetic_energy};
use gait_optimizer::{Device, Subject};
use serde_json::Value;

fn fixture(number: u32) -> Value {
    let path = format!("{}/tests/data/subject{number}.json", env!("CARGO_MANIFEST_DIR"));
    serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap()
}

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|v| v.as_f64().unwrap()).collect()
}

fn nine(value: &Value) -> [f64; 9] {
    numbers(value).try_into().unwrap()
}

fn close(what: &str, ours: f64, theirs: f64, tolerance: f64) {
    let scale = theirs.abs().max(1.0);
    assert!((ours - theirs).abs() <= tolerance * scale, "{what}: ours {ours}, fixture {theirs}");
}

#[test]
fn dynamics_contacts_and_impacts_match_independent_values() {
    for number in [1, 2] {
        let data = fixture(number);
        let model = WalkerModel::new(&Subject::builtin(number).unwrap(), &Device::ampro3().unwrap()).unwrap();
        let dynamics = InverseDynamics::new(&model);
        for (k, state) in data["states"].as_array().unwrap().iter().enumerate() {
            let (q, qd, qdd) = (nine(&state["q"]), nine(&state["dq"]), nine(&state["ddq"]));
            let mass = dynamics.mass_matrix(&q);
            let upper = numbers(&state["M_upper"]);
            let mut at = 0;
            for i in 0..9 {
                for j in i..9 {
                    close(&format!("state {k} M[{i}][{j}]"), mass[i][j], upper[at], 1e-9);
                    close(&format!("state {k} M[{j}][{i}]"), mass[j][i], upper[at], 1e-9);
                    at += 1;
                }
            }
            let bias = dynamics.rows(&PointState::new(&q, &qd, &[0.0; 9]));
            let full = dynamics.rows(&PointState::new(&q, &qd, &qdd));
            for i in 0..9 {
                close(&format!("state {k} h[{i}]"), bias[i], numbers(&state["h"])[i], 1e-9);
                close(&format!("state {k} inv_dyn[{i}]"), full[i], numbers(&state["inv_dyn"])[i], 1e-9);
            }
            for (name, point, side) in [
                ("heelL", FootPoint::Heel, Side::Left),
                ("toeL", FootPoint::Toe, Side::Left),
                ("heelR", FootPoint::Heel, Side::Right),
                ("toeR", FootPoint::Toe, Side::Right),
            ] {
                let contact = model.contact_point(point, side);
                let chain = contact.chain();
                let expected = &state["points"][name];
                let instant = PointState::new(&q, &qd, &[0.0; 9]);
                for axis in 0..2 {
                    let position = numbers(&expected["pos"])[axis];
                    close(&format!("{name} pos"), chain.position(&q)[axis], position, 1e-9);
                    close(&format!("{name} pos"), instant.contact_position(&contact)[axis], position, 1e-9);
                    let drift = numbers(&expected["Jdot_dq"])[axis];
                    close(&format!("{name} Jdot_dq"), instant.contact_acceleration(&contact)[axis], drift, 1e-9);
                    let row = numbers(&expected["J"][axis]);
                    for j in 0..9 {
                        close(&format!("{name} J"), chain.jacobian(&q)[axis][j], row[j], 1e-9);
                    }
                    let velocity: f64 = (0..9).map(|j| row[j] * qd[j]).sum();
                    close(&format!("{name} vel"), instant.contact_velocity(&contact)[axis], velocity, 1e-9);
                    close(&format!("{name} vel"), chain.velocity(&q, &qd)[axis], velocity, 1e-9);
                }
            }
        }
    }
}

#[test]
fn muscles_match_independent_values() {
    for number in [1, 2] {
        let data = fixture(number);
        for state in data["states"].as_array().unwrap() {
            let q = nine(&state["q"]);
            for muscle in &MUSCLES {
                let expected = &state["muscles"][muscle.name];
                let f = |key: &str| expected[key].as_f64().unwrap();
                close(muscle.name, muscle.unit_length(&q), f("l_mtu"), 1e-9);
                for attachment in muscle.attachments.iter().flatten() {
                    let value = attachment.at(q[attachment.coordinate]);
                    let joint = ["px", "pz", "torso", "hipL", "kneeL", "ankleL", "hipR"][attachment.coordinate];
                    let short = &joint[..joint.len() - 1];
                    let pick = |key: &str| {
                        let table = &expected[key];
                        table[joint].as_f64().or_else(|| table[short].as_f64()).unwrap_or_else(|| panic!("{table}"))
                    };
                    close(muscle.name, value.length_first, pick("dl_dq"), 1e-9);
                    close(muscle.name, value.arm, pick("arms"), 1e-9);
                }
                let fl = force_length(f("lce"));
                close("fl", fl.value, f("fl"), 1e-9);
                close("dfl", fl.first, f("dfl"), 1e-9);
                let fv = force_velocity(f("nu"));
                close("fv", fv.value, f("fv"), 1e-9);
                close("dfv", fv.first, f("dfv"), 1e-9);
                let fse = tendon_force(0.04 * f("x"));
                close("fse", fse.value, f("fse"), 1e-9);
                close("dfse", fse.first * 0.04, f("dfse"), 1e-9);
                close("Fce", f("act") * muscle.max_force_n * fl.value * fv.value, f("Fce"), 1e-9);
            }
        }
    }
}

#[test]
fn impacts_match_independent_values() {
    for number in [1, 2] {
        let data = fixture(number);
        let model = WalkerModel::new(&Subject::builtin(number).unwrap(), &Device::ampro3().unwrap()).unwrap();
        for (k, state) in data["states"].as_array().unwrap().iter().enumerate() {
            let (q, qd) = (nine(&state["q"]), nine(&state["dq"]));
            for domain in CYCLE.into_iter().filter(|d| d.opens_with_impact()) {
                let expected = &state["impacts"][domain.name()];
                let ours = impact(&model, domain, &q, &qd).unwrap();
                for (i, value) in numbers(&expected["dq_plus"]).into_iter().enumerate() {
                    close(&format!("state {k} {} dq+[{i}]", domain.name()), ours.velocity_after[i], value, 1e-8);
                }
                for (i, value) in numbers(&expected["Lambda"]).into_iter().enumerate() {
                    close(&format!("state {k} {} Lambda[{i}]", domain.name()), ours.impulse[i], value, 1e-8);
                }
                // A plastic impact dissipates energy.
                let (before, after) =
                    (kinetic_energy(&model, &q, &qd), kinetic_energy(&model, &q, &ours.velocity_after));
                assert!(after <= before * (1.0 + 1e-12), "state {k}: {before} J to {after} J");
            }
        }
    }
}
