//! The benchmark problems match check values of their definition.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, missing_docs, unreachable_pub, dead_code)]

#[path = "../examples/regret/problems.rs"]
mod problems;

use gait_learner::ActionIndex;
use problems::{Problem, hartmann_maximum};

#[test]
fn table1_matches_its_check_values() {
    let expected = [
        (2656, [0, 1, 1, 0, 1, 1, 0, 1], 4377.498987, 20),
        (8071, [1, 1, 0, 1, 1, 2, 2, 1], 4127.228589, 6),
        (2882, [0, 1, 1, 1, 1, 2, 0, 2], 4275.107504, 3),
        (6841, [1, 0, 1, 1, 2, 4, 0, 1], 4186.387713, 40),
        (10187, [1, 2, 0, 2, 0, 3, 2, 2], 4519.428665, 46),
    ];
    for (seed, (argmax, levels, sum, near)) in (0..).zip(expected) {
        let problem = Problem::named("table1", seed, None).unwrap();
        assert_eq!(problem.space.len(), 11_664);
        assert_eq!(problem.converged.iter().filter(|&&c| c).count(), 7581);
        let best = (0..11_664).max_by(|&i, &j| problem.utility[i].total_cmp(&problem.utility[j])).unwrap();
        assert_eq!(best, argmax, "seed {seed}");
        assert_eq!(problem.space.levels(ActionIndex(best as u64)), levels);
        assert!((problem.utility.iter().sum::<f64>() - sum).abs() < 1e-6, "seed {seed}");
        assert_eq!(problem.utility.iter().filter(|&&u| u > 0.95).count(), near);
    }
}

#[test]
fn hartmann_grids_match_their_maxima() {
    let (raw, at) = hartmann_maximum(3);
    assert!((raw - 3.8610).abs() < 5e-5 && at.iter().zip([0.1, 0.55, 0.85]).all(|(a, b)| (a - b).abs() < 1e-9));
    let (raw, at) = hartmann_maximum(6);
    assert!((raw - 2.9489).abs() < 5e-5);
    assert!(at.iter().zip([0.4, 0.8, 0.8, 0.6, 0.2, 0.0]).all(|(a, b)| (a - b).abs() < 1e-9));
    assert_eq!(Problem::named("hart3", 0, None).unwrap().space.len(), 9261);
    assert_eq!(Problem::named("hart6", 0, None).unwrap().space.len(), 46_656);
}
