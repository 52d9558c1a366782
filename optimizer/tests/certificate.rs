//! Certificates of the golden gaits, and of gaits with deliberate errors.

#![allow(clippy::unwrap_used)]

mod golden_gaits;

use gait_optimizer::certificate::{Certificate, STRIDES, certify};
use gait_optimizer::{Gait, ModelError};
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
        assert!(map.fixed_point_distance < 5e-3, "{}", map.fixed_point_distance);
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
        ("C4 forward hip velocity in SS1", |gait| gait.settings.limits.phase_rate_min_m_s = 1.0),
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
    assert!(certify(&gait).unwrap_err().to_string().contains("DS3_R: u has 8 entries, expected 9"));
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
    assert!(certify(&gait).unwrap_err().to_string().contains("DS2_R: impulse has None entries, expected Some(4)"));
    let mut gait = whole;
    gait.domains[4].q[2][3] = f64::NAN;
    assert!(certify(&gait).unwrap_err().to_string().contains("DS2_L: a number is not finite"));
}
