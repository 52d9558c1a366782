//! Tests of the golden gaits: solutions of the same problem by an independent implementation (`tests/data/README.md`).

#![allow(clippy::unwrap_used, clippy::panic, clippy::expect_used)]

mod golden_gaits;

use gait_optimizer::activation_alternations::activation_alternations;
use gait_optimizer::gait::{kept_clearance_m, progress};
use gait_optimizer::gait_problem::gait_of;
use gait_optimizer::gait_rmse::gait_rmse;
use gait_optimizer::walking::CYCLE;
use gait_optimizer::{
    CancelToken, GaitProblem, GaitSettings, InitialGuess, SolveOptions, SolveStatus, Subject, solve_from_guesses,
};
use golden_gaits::{golden, golden_gait, golden_with, numbers};
use interior_point::{BoundMultiplierStart, NlpSettings, NlpStatus, NonlinearProgram, StartPoint};

#[test]
fn golden_gaits_satisfy_all_rows() {
    for (subject, muscles) in [(1, false), (1, true), (2, false), (2, true)] {
        let golden = golden(subject, muscles);
        let mut g = vec![0.0; golden.program.rows()];
        golden.program.constraints(&golden.x, &mut g);
        for (i, name) in golden.program.rows.names.iter().enumerate() {
            let (low, high) = (golden.program.rows.lower[i], golden.program.rows.upper[i]);
            let violation = (low - g[i]).max(g[i] - high).max(0.0);
            assert!(violation < 1e-6, "subject {subject} muscles {muscles} {}: {violation}", name.label());
        }
        let (mut lower, mut upper) = (vec![0.0; golden.x.len()], vec![0.0; golden.x.len()]);
        golden.program.variable_bounds(&mut lower, &mut upper);
        for i in 0..golden.x.len() {
            let violation = (lower[i] - golden.x[i]).max(golden.x[i] - upper[i]);
            assert!(violation < 1e-6, "subject {subject} muscles {muscles} variable {i}: {violation}");
        }
        let objective = golden.program.objective(&golden.x);
        let theirs = golden.data["obj"].as_f64().unwrap();
        assert!((objective - theirs).abs() < 1e-10, "{objective} {theirs}");
    }
}

#[test]
fn golden_gaits_satisfy_the_default_clearance() {
    for (subject, muscles) in [(1, false), (1, true), (2, false), (2, true)] {
        let (_, gait) = golden_gait(subject, muscles);
        let least = gait.settings.limits.clearance_min_m;
        let kept = kept_clearance_m(&gait).unwrap().unwrap();
        assert!(gait.bounds.a5 < least && kept > least - 1e-6 && kept < 0.05, "{subject} {muscles}: {kept}");
    }
}

/// Largest number of iterations of a solve that starts at its solution.
const HANDFUL: usize = 5;

/// Settings to start at a golden gait: the barrier parameter is the last one of the other solver (tolerance / 11).
fn from_a_golden_gait() -> NlpSettings {
    NlpSettings {
        tolerance: 1e-6,
        mu_initial: 1e-6 / 11.0,
        bound_push: 1e-9,
        bound_multiplier_start: BoundMultiplierStart::Centred,
        ..NlpSettings::default()
    }
}

#[test]
fn solver_stays_at_the_golden_gaits() {
    for (subject, muscles) in [(1, false), (1, true), (2, false), (2, true)] {
        let golden = golden(subject, muscles);
        let settings = NlpSettings { max_iterations: HANDFUL, ..from_a_golden_gait() };
        let result = interior_point::solve(
            &golden.program,
            &StartPoint::Cold(golden.x.clone()),
            &settings,
            &mut |_| {},
            &|| false,
        )
        .unwrap();
        println!(
            "s{subject} {muscles} {:?} {} iterations {:?} {:?}",
            result.status, result.iterations, result.timing, result.counts
        );
        assert_eq!(result.status, NlpStatus::Converged);
        let theirs = golden.data["obj"].as_f64().unwrap();
        assert!((result.objective - theirs).abs() < 1e-6 * theirs, "{} {theirs}", result.objective);
    }
}

#[test]
fn golden_gaits_have_the_expected_gait_rmse() {
    for (subject, muscles) in [(1, false), (1, true), (2, false), (2, true)] {
        let golden = golden(subject, muscles);
        let (problem, gait) = golden_gait(subject, muscles);
        let rmse = gait_rmse(&gait, &problem.reference);
        let theirs = golden.data["gait_rmse"].as_f64().unwrap();
        assert!((rmse.total - theirs).abs() < 1e-9, "subject {subject} muscles {muscles}: {} {theirs}", rmse.total);
        for (ours, theirs) in rmse.parts.iter().zip(numbers(&golden.data["gait_rmse_parts"])) {
            assert!((ours - theirs).abs() < 1e-9, "{ours} {theirs}");
        }
    }
}

#[test]
fn golden_gaits_have_phases_from_zero_to_one_and_their_hip_velocity() {
    for (subject, muscles) in [(1, false), (2, true)] {
        let (_, gait) = golden_gait(subject, muscles);
        let made = progress(&gait).unwrap();
        let mut made = &made[..];
        for (domain, trajectory) in CYCLE.iter().zip(&gait.domains) {
            let points;
            (points, made) = made.split_at(trajectory.q.len());
            let (first, last) = (points[0].phase, points[points.len() - 1].phase);
            assert!(first.abs() < 1e-5 && (last - 1.0).abs() < 1e-5, "{}: {first} {last}", trajectory.name);
            let Some(index) = domain.hip_velocity_index() else { continue };
            for point in points {
                let off = point.hip_velocity_m_s - gait.hip_velocity_m_s[index];
                assert!(off.abs() < 1e-5, "{}: {off} m/s", trajectory.name);
            }
        }
        assert!(made.is_empty());
    }
}

/// Activations of the golden gaits alternate from node to node, because their problem has no weight on the bend.
#[test]
fn activations_do_not_alternate_with_the_default_weights() {
    for subject in [1, 2] {
        let (problem, zigzag) = golden_gait(subject, true);
        assert!(activation_alternations(&zigzag) >= 10, "{}", activation_alternations(&zigzag));
        let golden = golden_with(&problem.settings, subject, true);
        let settings = from_a_golden_gait();
        let result =
            interior_point::solve(&golden.program, &StartPoint::Cold(golden.x), &settings, &mut |_| {}, &|| false)
                .unwrap();
        assert_eq!(result.status, NlpStatus::Converged);
        let gait = gait_of(&problem, &golden.program, &result.x);
        assert_eq!(activation_alternations(&gait), 0, "after {} iterations", result.iterations);
        let theirs = golden.data["obj"].as_f64().unwrap();
        assert!(result.objective > theirs && result.objective < 1.01 * theirs, "{} {theirs}", result.objective);
    }
}

/// A row of `tests/data/iterations.csv`, which `examples/iteration_spread.rs` writes.
#[derive(serde::Deserialize)]
struct PerturbedStart {
    subject: u32,
    muscles: bool,
    guess: String,
    status: String,
    iterations: f64,
}

/// Mean of the iterations of a cold start under different rounding errors, and their variance, which is that of all
/// starts of the variant: the perturbations of a single start can miss another way to the same gait.
fn spread(rows: &[PerturbedStart], subject: u32, muscles: bool, guess: &str) -> (f64, f64) {
    let start = |row: &PerturbedStart| (row.subject, row.guess.clone());
    let mut starts: Vec<(u32, String)> = rows.iter().filter(|row| row.muscles == muscles).map(start).collect();
    starts.sort();
    starts.dedup();
    let mean_and_variance = |wanted: &(u32, String)| {
        let of_start = rows.iter().filter(|row| row.muscles == muscles && start(row) == *wanted);
        let counts: Vec<f64> = of_start.map(|row| row.iterations).collect();
        assert!(counts.len() > 30, "{wanted:?} {muscles}: {}", counts.len());
        let mean = counts.iter().sum::<f64>() / counts.len() as f64;
        let squares: f64 = counts.iter().map(|count| (count - mean).powi(2)).sum();
        (mean, squares / (counts.len() - 1) as f64)
    };
    let variances = starts.iter().map(|start| mean_and_variance(start).1).sum::<f64>() / starts.len() as f64;
    (mean_and_variance(&(subject, guess.to_owned())).0, variances)
}

/// Four standard deviations above the mean.
fn limit((mean, variance): (f64, f64)) -> f64 {
    mean + 4.0 * variance.sqrt()
}

/// The limits come from the distribution over rounding errors, because a processor with other vector instructions rounds
/// differently. A change of the solver that moves the distribution comes with a new file of iterations.
#[test]
fn cold_starts_take_at_most_the_expected_iterations() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data/iterations.csv");
    let rows: Vec<PerturbedStart> = csv::Reader::from_path(path).unwrap().deserialize().map(Result::unwrap).collect();
    assert!(rows.iter().all(|row| row.status == "Converged"));
    let guesses = [InitialGuess::NATURAL, InitialGuess::EARLY_RISE];
    let starts = [(1, false), (2, false), (1, true), (2, true)].map(|(s, m)| guesses.map(|guess| (s, m, guess)));
    let long = !skipped_tests::long_tests_are_skipped(" to run more than two starts");
    let (mut taken, mut expected) = (0.0, (0.0, 0.0));
    for (subject, muscles, guess) in starts.into_iter().flatten().take(if long { 8 } else { 2 }) {
        let problem = GaitProblem::new(Subject::builtin(subject).unwrap(), muscles).unwrap();
        let problem = GaitProblem { settings: GaitSettings::reference_problem(), ..problem };
        let options = SolveOptions::default();
        let outcome = solve_from_guesses(&problem, &[guess], &options, &mut |_| {}, &CancelToken::new()).unwrap();
        let report = outcome.report;
        let spread = spread(&rows, subject, muscles, &guess.label());
        println!("subject {subject} muscles {muscles} {}: {} of {spread:?}", guess.label(), report.iterations);
        assert_eq!(report.status, SolveStatus::Converged);
        let iterations = report.iterations as f64;
        assert!(iterations <= limit(spread), "{}: {iterations} of {spread:?}", guess.label());
        taken += iterations;
        expected = (expected.0 + spread.0, expected.1 + spread.1);
    }
    // The starts are independent, so their variances add up.
    assert!(taken <= limit(expected), "{taken} of {expected:?} together");
}
