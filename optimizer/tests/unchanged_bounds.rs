//! The values of tuned bounds with which a gait stays a solution, against solves.

#![allow(clippy::unwrap_used)]

use gait_optimizer::{
    CancelToken, GaitProblem, SolveOptions, SolveOutcome, SolveStatus, Subject, TunedBounds, WarmStart, solve,
};

/// Values of Table I, except the loosest.
const STRICTER: [&[f64]; TunedBounds::COUNT] = [
    &[15.0],
    &[70.0, 80.0],
    &[0.4, 0.5],
    &[1.2, 1.3],
    &[0.013, 0.026, 0.039],
    &[0.0, 0.1, 0.2, 0.3, 0.4],
    &[20.0, 35.0],
    &[20.0, 30.0],
];

fn solved(bounds: [f64; TunedBounds::COUNT], warm: Option<&WarmStart>) -> SolveOutcome {
    let mut problem = GaitProblem::new(Subject::builtin(1).unwrap(), false).unwrap();
    problem.bounds = TunedBounds::from_array(bounds).unwrap();
    let options = SolveOptions { initial_guesses: 1, ..SolveOptions::default() };
    let outcome = solve(&problem, warm, &options, &mut |_| {}, &CancelToken::new()).unwrap();
    assert_eq!(outcome.report.status, SolveStatus::Converged, "{bounds:?}");
    outcome
}

#[test]
fn gait_is_kept_bit_for_bit_with_exactly_the_bounds_of_its_intervals() {
    let loosest = TunedBounds::default().to_array();
    let actions = [
        [15.0, 90.0, 0.3, 1.4, 0.013, 0.5, 35.0, 20.0],
        [20.0, 80.0, 0.4, 1.2, 0.0, 0.2, 20.0, 30.0],
        [20.0, 90.0, 0.4, 1.4, 0.0, 0.2, 50.0, 40.0],
    ];
    let (mut kept, mut left) = (0, 0);
    for action in actions {
        let known = solved(action, None);
        let intervals = &known.report.unchanged_bounds;
        assert!(intervals.iter().map(|interval| interval.bound.as_str()).eq(TunedBounds::NAMES));
        for (interval, value) in intervals.iter().zip(action) {
            assert!(interval.contains(value), "{interval:?} {value}");
        }
        let mut all = action;
        for place in 0..TunedBounds::COUNT {
            for &value in STRICTER[place].iter().chain([&loosest[place]]).filter(|value| **value != action[place]) {
                let mut moved = action;
                moved[place] = value;
                let again = solved(moved, Some(&known.warm_start));
                if intervals[place].contains(value) {
                    assert_eq!((again.report.iterations, &again.warm_start), (0, &known.warm_start), "{moved:?}");
                    all[place] = value;
                    kept += 1;
                } else {
                    assert!(again.report.iterations > 0, "{moved:?}");
                    left += 1;
                }
            }
        }
        // The intervals hold together.
        let again = solved(all, Some(&known.warm_start));
        assert_eq!((again.report.iterations, &again.warm_start), (0, &known.warm_start), "{all:?}");
    }
    assert!(kept >= 15 && left >= 15, "{kept} {left}");
}
