//! Certificates of the golden gaits, and of gaits with deliberate errors.

#![allow(clippy::unwrap_used)]

mod golden_gaits;

use gait_optimizer::body::WalkerModel;
use gait_optimizer::certificate::{Certificate, CertifiedGait, Difference, FixedPointDistance, STRIDES, certify};
use gait_optimizer::{DomainTrajectory, Gait, GaitResults, ModelError, ReferenceGait};
use golden_gaits::golden_gait;

fn certificate(gait: &Gait) -> Certificate {
    certify(gait).unwrap()
}

fn objects_to(certificate: &Certificate, word: &str) -> bool {
    !certificate.passed && certificate.failures.iter().any(|failure| failure.contains(word))
}

#[test]
fn golden_gaits_pass() {
    for (subject, muscles) in [(1, false), (1, true), (2, false), (2, true)] {
        let (_, gait) = golden_gait(subject, muscles);
        let certificate = certificate(&gait);
        assert!(certificate.passed, "subject {subject} muscles {muscles}: {:#?}", certificate.failures);
        let map = certificate.return_map.unwrap();
        assert!(map.is_stable());
        assert!(map.fixed_point_residual < 1e-7, "{}", map.fixed_point_residual);
        // The collocation error in SS1.
        let FixedPointDistance { height_m, angle_rad, velocity_m_s, angular_velocity_rad_s } = map.fixed_point_distance;
        for distance in [height_m, angle_rad, velocity_m_s, angular_velocity_rad_s] {
            assert!(distance > 0.0 && distance < 5e-3, "{:?}", map.fixed_point_distance);
        }
        // Both methods resolve even a multiplier of 3e-7.
        assert!(map.disagreement() < 1e-5, "{} {}", map.largest, map.largest_by_differences);
        assert!(map.differences_resolve < 1e-4 * map.largest, "{} {}", map.largest, map.differences_resolve);
        let free = certificate.free_hip_return_map.unwrap();
        // With a free hip velocity, the multiplier of the zero dynamics is stable and clearly above the rounding error.
        assert!((0.3..0.9).contains(&free.largest), "{}", free.largest);
        assert!(free.disagreement() < 1e-5, "{} {}", free.largest, free.largest_by_differences);
        let pushes = certificate.pushes.unwrap();
        assert!(pushes.forwards_m_s > 0.05 && pushes.backwards_m_s > 0.05, "{pushes:?}");
        let orbit = certificate.checks.iter().find(|c| c.name.starts_with("orbit error, angles")).unwrap();
        assert!(orbit.value.unwrap() < 1e-4 && orbit.place.starts_with("stride"), "{orbit:?} of {STRIDES}");
    }
}

#[test]
fn certificate_is_deterministic_and_round_trips_through_json() {
    let (_, gait) = golden_gait(1, false);
    let first = certificate(&gait);
    assert!(first == certificate(&gait), "differs");
    let text = serde_json::to_string(&first).unwrap();
    assert!(first == serde_json::from_str(&text).unwrap(), "differs");
}

#[test]
fn changed_torque_is_detected_at_its_node() {
    let (_, mut gait) = golden_gait(1, false);
    gait.domains[3].u[4][1] += 1.0;
    let certificate = certificate(&gait);
    assert!(objects_to(&certificate, "C1 equations of motion, moments, at nodes"));
    let check = certificate.checks.iter().find(|c| c.name.starts_with("C1 equations of motion, moments, at")).unwrap();
    assert!((check.value.unwrap() - 1.0).abs() < 1e-6 && check.place.starts_with("SS1_R"), "{check:?}");
}

#[test]
fn changed_bezier_curve_is_detected_and_leaves_the_orbit() {
    let (_, mut gait) = golden_gait(1, false);
    gait.domains[7].bezier[4][5] += 0.05;
    let certificate = certificate(&gait);
    assert!(objects_to(&certificate, "C2 virtual constraints"));
    let left = certificate.fall.is_some() || objects_to(&certificate, "orbit error");
    assert!(left, "{:#?}", certificate.failures);
}

#[test]
fn impulse_inconsistent_with_the_velocity_jump_is_detected() {
    let (_, mut gait) = golden_gait(1, false);
    gait.domains[1].impulse.as_mut().unwrap()[0] += 0.01;
    assert!(objects_to(&certificate(&gait), "C2 impulses of the impacts: 0.01 N s (DS2_R"));
}

#[test]
fn violated_tuned_bound_is_detected() {
    let (_, mut gait) = golden_gait(2, false);
    gait.bounds.a7 = 10.0;
    assert!(objects_to(&certificate(&gait), "C4 joint angles"));
}

#[test]
fn each_violated_limit_is_detected() {
    type Change = fn(&mut Gait);
    let changes: [(&str, Change); 6] = [
        ("C3 friction cone of heel strikes", |gait| gait.settings.limits.impact_friction = 0.1),
        ("C3 impulses beyond their limit", |gait| gait.settings.limits.impulse_max_n_s = 10.0),
        ("C3 forward hip velocity in SS1", |gait| gait.settings.limits.phase_rate_min_m_s = 1.0),
        ("C5-C8 activations, fibre lengths", |gait| gait.settings.limits.fibre_length_min = 0.7),
        ("C3 load of contacts before they lift off", |gait| gait.settings.naturalness.trailing_load_share = 0.5),
        ("C3 load of contacts before they lift off", |gait| gait.settings.limits.liftoff_force_n = 200.0),
    ];
    let (_, whole) = golden_gait(1, true);
    assert!(certificate(&whole).passed);
    for (name, change) in changes {
        let mut gait = whole.clone();
        change(&mut gait);
        let found = certificate(&gait);
        assert!(objects_to(&found, name), "{name}: {:?}", found.failures);
    }
}

#[test]
fn every_changed_limit_is_named_although_the_gait_keeps_it() {
    type Change = fn(&mut Gait);
    let changes: [(&str, Change); 15] = [
        ("device.knee_torque_limit_n_m is 300.0 (built-in: ", |gait| gait.device.knee_torque_limit_n_m = 300.0),
        ("device.ankle_torque_limit_n_m is 300.0 (built-in: ", |gait| gait.device.ankle_torque_limit_n_m = 300.0),
        ("device.joint_speed_limit_rad_s is 50.0 (built-in: ", |gait| gait.device.joint_speed_limit_rad_s = 50.0),
        ("device.ankle_min_rad is -1.2 (built-in: ", |gait| gait.device.ankle_min_rad = -1.2),
        ("device.ankle_max_rad is 1.2 (built-in: ", |gait| gait.device.ankle_max_rad = 1.2),
        ("settings.limits.friction is 1.0 (built-in: 0.6)", |gait| gait.settings.limits.friction = 1.0),
        ("settings.limits.impact_friction is 1.0 (built-in: 0.6)", |gait| gait.settings.limits.impact_friction = 1.0),
        ("settings.limits.toe_touchdown_m_s is 0.0 (built-in: 0.1)", |gait| {
            gait.settings.limits.toe_touchdown_m_s = 0.0;
        }),
        ("settings.limits.heel_touchdown_m_s is 0.0 (built-in: 0.1)", |gait| {
            gait.settings.limits.heel_touchdown_m_s = 0.0;
        }),
        ("settings.limits.hip_torque_n_m is 999.0 (built-in: 200.0)", |gait| {
            gait.settings.limits.hip_torque_n_m = 999.0;
        }),
        ("settings.limits.clearance_min_m is 0.0 (built-in: 0.005)", |gait| gait.settings.limits.clearance_min_m = 0.0),
        ("settings.limits.liftoff_force_n is 0.0 (built-in: 20.0)", |gait| gait.settings.limits.liftoff_force_n = 0.0),
        ("settings.limits.knee_min_rad is 0.0 (built-in: 0.02)", |gait| gait.settings.limits.knee_min_rad = 0.0),
        ("settings.limits.duration_max_s.ds3 is 1.0 (built-in: 0.3)", |gait| {
            gait.settings.limits.duration_max_s.ds3 = 1.0;
        }),
        ("settings.limits.contact_force_max_n is 9000.0 (built-in: 3000.0)", |gait| {
            gait.settings.limits.contact_force_max_n = 9000.0;
        }),
    ];
    let (_, whole) = golden_gait(1, true);
    let certified = |gait: &Gait| CertifiedGait::of(gait).unwrap();
    let before = certified(&whole);
    assert!(before.differences.iter().all(|one| one.name == "settings.regularisation.activation_bend"), "{before:?}");
    assert!(before.muscles);
    for (difference, change) in changes {
        let mut gait = whole.clone();
        change(&mut gait);
        let after = certified(&gait);
        let names: Vec<String> = after.differences.iter().map(Difference::in_words).collect();
        assert!(names.iter().any(|name| name.starts_with(difference)), "{difference}: {names:?}");
        assert_eq!(names.len(), before.differences.len() + 1);
        assert_ne!(after.gait_sha256, before.gait_sha256, "{difference}");
    }
}

#[test]
fn gait_without_its_muscles_is_certified_as_one_without_muscles() {
    let (_, mut gait) = golden_gait(1, true);
    gait.muscles = false;
    gait.domains.iter_mut().for_each(|domain| domain.muscles = None);
    let certificate = certificate(&gait);
    let certified = certificate.certified.unwrap();
    assert!(!certified.muscles && certified.walker_in_words().ends_with("without muscles"), "{certified:?}");
    assert!(certificate.checks.iter().all(|check| !check.name.contains("C5")), "{:?}", certificate.checks);
}

/// Effort of a stride with the magnitudes of the joint powers, by Simpson's rule over the nodes, J.
fn effort_at_nodes_j(gait: &Gait) -> f64 {
    let of_domain = |domain: &DomainTrajectory| {
        let last = domain.q.len() - 1;
        let power_w = |k: usize| (0..6).map(|i| (domain.u[k][i] * domain.qd[k][3 + i]).abs()).sum::<f64>();
        let weight = |k: usize| {
            if k == 0 || k == last {
                1.0
            } else if k % 2 == 1 {
                4.0
            } else {
                2.0
            }
        };
        let sum: f64 = (0..=last).map(|k| weight(k) * power_w(k)).sum();
        domain.duration_s * sum / (3.0 * last as f64)
    };
    gait.domains.iter().map(of_domain).sum()
}

#[test]
fn cost_of_transport_of_certificate_and_report_has_the_magnitudes_of_the_joint_powers() {
    for (subject, muscles) in [(1, false), (2, true)] {
        let (_, gait) = golden_gait(subject, muscles);
        let cost = CertifiedGait::of(&gait).unwrap().cost_of_transport;
        let model = WalkerModel::new(&gait.subject, &gait.device).unwrap();
        let per_joule = 1.0 / (model.total_mass * 9.81 * gait.stride_length_m);
        let at_nodes = effort_at_nodes_j(&gait) * per_joule;
        // Simpson's rule over the nodes misses the kinks of the magnitudes between them.
        assert!((cost - at_nodes).abs() < 0.05 * at_nodes, "{cost} {at_nodes}");
        let results = GaitResults::of(&gait, &ReferenceGait::builtin().unwrap()).unwrap();
        assert_eq!(results.cost_of_transport.to_bits(), cost.to_bits());
    }
}

#[test]
fn changed_fibre_length_is_detected_at_every_node() {
    let (_, whole) = golden_gait(1, true);
    for point in [0, 7, 12] {
        let mut gait = whole.clone();
        gait.domains[3].muscles.as_mut().unwrap().fibre_length[point][5] += 1e-3;
        let found = certificate(&gait);
        assert!(objects_to(&found, "C8 fibre lengths") || objects_to(&found, "C5-C7"), "{point}: {:?}", found.failures);
    }
}

#[test]
fn violated_muscle_equilibrium_is_detected() {
    let (_, mut gait) = golden_gait(1, true);
    for activation in &mut gait.domains[6].muscles.as_mut().unwrap().activation {
        activation[5] = 0.0;
    }
    assert!(objects_to(&certificate(&gait), "C5-C7"));
}

#[test]
fn walker_without_heel_strike_falls() {
    let (_, mut gait) = golden_gait(1, false);
    // The swing leg stays bent in SS1_R, so the heel does not land.
    for (output, row) in gait.domains[3].outputs.clone().into_iter().zip(&mut gait.domains[3].bezier) {
        if output == 4 {
            for coefficient in &mut row[3..] {
                *coefficient += 0.6;
            }
        }
    }
    let certificate = certificate(&gait);
    assert!(objects_to(&certificate, "falls"), "{:#?}", certificate.failures);
    assert!(certificate.return_map.is_none() && certificate.pushes.is_none());
}

#[test]
fn incomplete_gait_is_rejected_with_the_field() {
    let (_, whole) = golden_gait(1, false);
    let mut gait = whole.clone();
    gait.domains.pop();
    assert!(matches!(certify(&gait), Err(ModelError::OutOfRange { field, .. }) if field == "number of domains"));
    let mut gait = whole.clone();
    gait.domains[1].u.pop();
    assert!(certify(&gait).unwrap_err().to_string().contains("DS3_R: u has 8 entries; it must have 9"));
    let mut gait = whole.clone();
    gait.domains[3].time_s.iter_mut().for_each(|time| *time += 1.0);
    let refused = certify(&gait).unwrap_err().to_string();
    assert!(refused.contains("SS1_R: time_s[0] is 1.") && refused.contains("from the durations"), "{refused}");
    for (change, field) in [
        ((|gait| gait.stride_time_s = -4.0) as fn(&mut Gait), "stride_time_s"),
        (|gait| gait.format_version = 2, "format_version"),
        (|gait| gait.speed_m_s = 99.0, "speed_m_s"),
    ] {
        let mut gait = whole.clone();
        change(&mut gait);
        assert!(certify(&gait).unwrap_err().to_string().starts_with(field));
    }
    let mut gait = whole.clone();
    gait.domains[0].impulse = None;
    assert!(certify(&gait).unwrap_err().to_string().contains("DS2_R: impulse is absent; it must have 4 entries"));
    let mut gait = whole;
    gait.domains[4].q[2][3] = f64::NAN;
    assert!(certify(&gait).unwrap_err().to_string().contains("DS2_L: a number is not finite"));
}
