//! Every tuned bound limits the gait problem and the certificate.

#![allow(clippy::unwrap_used)]

mod golden_gaits;

use gait_optimizer::certificate::certify;
use gait_optimizer::gait_problem::GaitProgram;
use gait_optimizer::{Gait, GaitSettings, ReferenceGait, TunedBounds};
use golden_gaits::{golden, golden_gait};

/// The default bounds with one of them at its tightest value. a3 and a4 stay apart.
fn tightened(bound: usize) -> TunedBounds {
    let usual = TunedBounds::default();
    let (lowest, highest) = TunedBounds::RANGES[bound];
    let tightest = match TunedBounds::NAMES[bound] {
        "a3" => usual.a4 - 0.01,
        "a4" => usual.a3 + 0.01,
        _ if TunedBounds::IS_LOWER[bound] => highest,
        _ => lowest,
    };
    let mut values = usual.to_array();
    values[bound] = tightest;
    TunedBounds::from_array(values).unwrap()
}

#[test]
fn bounds_are_set_by_name() {
    for (bound, name) in TunedBounds::NAMES.into_iter().enumerate() {
        let (_, highest) = TunedBounds::RANGES[bound];
        let mut bounds = TunedBounds::default();
        bounds.set(name, highest).unwrap();
        let mut expected = TunedBounds::default().to_array();
        expected[bound] = highest;
        assert_eq!(bounds.to_array(), expected, "{name}");
    }
}

#[test]
fn gait_beyond_a_tightened_bound_violates_the_problem() {
    let golden = golden(1, false);
    let (problem, _) = golden_gait(1, false);
    let violated = |bounds: &TunedBounds| {
        let settings = GaitSettings::reference_problem();
        let reference = ReferenceGait::builtin().unwrap();
        let program =
            GaitProgram::new(&problem.subject, &problem.device, bounds, false, &settings, &reference).unwrap();
        program.violations(&golden.x).first().is_some_and(|worst| worst.amount > 1e-3)
    };
    assert!(!violated(&TunedBounds::default()));
    for (bound, name) in TunedBounds::NAMES.into_iter().enumerate() {
        assert!(violated(&tightened(bound)), "{name} does not limit the gait problem");
    }
}

#[test]
fn gait_beyond_a_tightened_bound_fails_its_certificate() {
    let (_, gait) = golden_gait(1, false);
    for (bound, name) in TunedBounds::NAMES.into_iter().enumerate() {
        let certificate = certify(&Gait { bounds: tightened(bound), ..gait.clone() }).unwrap();
        let names_it = |words: &&str| words.split(|c: char| !c.is_alphanumeric()).any(|word| word == name);
        let failures = certificate.failures.iter().map(String::as_str);
        assert!(failures.clone().any(|words| names_it(&words)), "{name}: {:?}", certificate.failures);
    }
}
