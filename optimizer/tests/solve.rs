//! Tests of `solve` and `explain` with the real gait problem, on a coarse mesh and without muscles.

#![allow(clippy::unwrap_used, clippy::panic, clippy::expect_used)]

use gait_optimizer::body::{Axis, Side};
use gait_optimizer::certificate::certify;
use gait_optimizer::explanation::explain;
use gait_optimizer::gait::progress_error_m;
use gait_optimizer::settings::Naturalness;
use gait_optimizer::solve::StartedFrom;
use gait_optimizer::{
    CancelToken, Gait, GaitProblem, GaitResults, GaitSettings, LocalOptimumChoice, Mesh, SolveOptions, SolveOutcome,
    SolveStatus, Subject, TunedBounds, WarmStart, solve,
};
use std::sync::LazyLock;

fn problem(bounds: &str) -> GaitProblem {
    let mut problem = GaitProblem::new(Subject::builtin(1).unwrap(), false).unwrap();
    problem.settings = GaitSettings { mesh: Mesh { ds2: 3, ds3: 3, ss2: 4, ss1: 4 }, ..GaitSettings::default() };
    problem.bounds = TunedBounds::parse(bounds).unwrap();
    problem
}

fn solved(problem: &GaitProblem, warm: Option<&WarmStart>, max_iterations: usize) -> SolveOutcome {
    let options = SolveOptions { max_iterations, ..SolveOptions::default() };
    solve(problem, warm, &options, &mut |_| {}, &CancelToken::new()).unwrap()
}

static COLD: LazyLock<SolveOutcome> = LazyLock::new(|| solved(&problem(""), None, 400));

#[test]
fn warm_start_converges_after_a_cold_solve() {
    let report = &COLD.report;
    assert_eq!((report.status, report.started_from), (SolveStatus::Converged, StartedFrom::Cold));
    assert!(report.max_violation <= 1e-6 && COLD.violations.is_empty());
    let optimality = report.optimality.unwrap();
    assert!(optimality.dual_infeasibility <= 1e-6 && optimality.complementarity <= 1e-6, "{optimality:?}");
    assert!(report.cost_of_transport > 0.01 && report.cost_of_transport < 0.2, "{}", report.cost_of_transport);
    assert!(report.gait_rmse_rad > 0.1 && report.gait_rmse_rad < 3.0, "{}", report.gait_rmse_rad);
    assert_eq!(COLD.gait.domains.len(), 8);
    // The two initial guesses end in one or two local optima.
    let local_optima: Vec<_> = report.solver_runs.iter().map(|a| (a.local_optimum, a.objective)).collect();
    assert_eq!(local_optima[0].0, Some(1));
    assert_eq!(
        local_optima[1].0 == Some(1),
        (local_optima[1].1 / local_optima[0].1 - 1.0).abs() < 1e-4,
        "{local_optima:?}"
    );

    let warm = solved(&problem("a5=0.013"), Some(&COLD.warm_start), 400);
    assert_eq!((warm.report.status, warm.report.started_from), (SolveStatus::Converged, StartedFrom::Warm));
    assert!(warm.report.iterations < report.iterations, "{} {}", warm.report.iterations, report.iterations);
    let runs = &warm.report.solver_runs;
    assert_eq!(runs[0].strategy, "warm start");
    assert!(runs.iter().rev().map(|a| a.chosen).eq((0..runs.len()).map(|i| i == 0)));
}

#[test]
fn results_of_a_gait_are_those_of_its_report_and_every_other_value_differs() {
    let reference = problem("").reference;
    for outcome in [&*COLD, &solved(&problem(""), None, 3)] {
        let results = GaitResults::of(&outcome.gait, &reference).unwrap();
        let stated = GaitResults::of_report(&outcome.report);
        assert_eq!(results, stated);
        let scaled = |value: &mut f64| *value *= 1.0 + 1e-6;
        let changes: [fn(&mut GaitResults) -> &mut f64; 7] = [
            |f| &mut f.cost_of_transport,
            |f| &mut f.gait_rmse_rad,
            |f| &mut f.gait_rmse_parts_rad[4],
            |f| &mut f.speed_m_s,
            |f| &mut f.stride_length_m,
            |f| &mut f.durations_s[7],
            |f| &mut f.vhip_m_s[3],
        ];
        for value in changes {
            let mut other = stated;
            scaled(value(&mut other));
            let (_, changed, computed) = other.difference(&results).unwrap();
            assert!(changed > computed, "{other:?}");
        }
    }
}

/// The gait with other results, and times that match them.
fn with_results(gait: &Gait, change: impl Fn(&mut Gait)) -> Gait {
    let mut changed = gait.clone();
    change(&mut changed);
    let mut start = 0.0;
    for domain in &mut changed.domains {
        let gaps = (domain.time_s.len() - 1) as f64;
        domain.time_s = (0..domain.q.len()).map(|k| start + domain.duration_s * k as f64 / gaps).collect();
        start += domain.duration_s;
    }
    changed.stride_time_s = start;
    changed.speed_m_s = changed.stride_length_m / start;
    changed
}

#[test]
fn results_of_a_gait_that_differ_from_its_motion_are_detected() {
    let gait = &COLD.gait;
    let hip_is_off = progress_error_m(gait).unwrap();
    assert!(hip_is_off < 2e-6, "{hip_is_off}");
    for d in 0..8 {
        let longer = with_results(gait, |gait| gait.domains[d].duration_s += 2e-5);
        longer.validate().unwrap();
        let hip_is_off = progress_error_m(&longer).unwrap();
        assert!(hip_is_off > 1e-5, "domain {d}: {hip_is_off}");
    }
    // The certificate compares the others with the motion at the nodes.
    let objects = |change: fn(&mut Gait), failure: &str| {
        let failures = certify(&with_results(gait, change)).unwrap().failures;
        assert!(failures.iter().any(|words| words.starts_with(failure)), "{failures:?}");
    };
    objects(|gait| gait.stride_length_m *= 1.0 + 1e-5, "C2 continuity of the stride");
    objects(|gait| gait.hip_velocity_m_s[3] *= 1.0 + 1e-5, "C2 hip velocity, at nodes");
}

/// The failures of the certificate between the nodes.
fn failures_between_points(outcome: &SolveOutcome) -> Vec<String> {
    let certificate = certify(&outcome.gait).unwrap();
    certificate.failures.into_iter().filter(|words| words.contains("between nodes")).collect()
}

#[test]
fn bounds_hold_between_the_nodes() {
    // On the default mesh: a coarser one leaves contacts a millimetre away between its points.
    let bounds = "a1=20,a2=90,a3=0.5,a4=1.3,a5=0.039,a6=0.5,a7=50,a8=30";
    let problem = GaitProblem { settings: GaitSettings::default(), ..problem(bounds) };
    let run = |warm: Option<&WarmStart>, tightening_rounds: usize| {
        let options = SolveOptions { tightening_rounds, threads: 2, ..SolveOptions::default() };
        solve(&problem, warm, &options, &mut |_| {}, &CancelToken::new()).unwrap()
    };
    let at_points = run(None, 0);
    assert_eq!((at_points.report.status, at_points.report.tightened_bounds), (SolveStatus::Converged, 0));
    assert!(!failures_between_points(&at_points).is_empty(), "nothing to tighten");

    let kept = run(Some(&at_points.warm_start), 4);
    assert_eq!(kept.report.status, SolveStatus::Converged);
    assert!(kept.report.tightened_bounds > 0 && kept.report.max_violation <= 1e-6);
    assert_eq!(failures_between_points(&kept), Vec::<String>::new());
    let last = kept.report.solver_runs.last().unwrap();
    assert!(last.chosen && last.strategy.contains("tightened"), "{last:?}");
    let dearer = kept.report.objective / at_points.report.objective - 1.0;
    assert!((0.0..0.01).contains(&dearer), "{dearer}");

    // A warm start keeps the tightened bounds, so the gait does not change.
    let again = run(Some(&kept.warm_start), 4);
    assert_eq!((again.report.iterations, again.report.tightened_bounds), (0, kept.report.tightened_bounds));
    assert_eq!(again.gait, kept.gait);
}

/// The force under the trailing toe at the first and last node of a double-support domain, N.
fn trailing_force(outcome: &SolveOutcome, domain: usize) -> (f64, f64) {
    let domain = &outcome.gait.domains[domain];
    let row = domain.contact_rows.iter().position(|r| r.axis == Axis::Z && r.side == Side::Left).unwrap();
    let forces = &domain.contact_forces;
    (forces[0][row], forces.last().unwrap()[row])
}

#[test]
fn naturalness_terms_are_met() {
    let mut natural = problem("");
    natural.settings.naturalness = Naturalness { reference_weight: 0.1, trailing_load_share: 0.4 };
    let found = solved(&natural, Some(&COLD.warm_start), 400);
    assert_eq!(found.report.status, SolveStatus::Converged);
    assert!(found.report.gait_rmse_rad < COLD.report.gait_rmse_rad, "nearer to the reference");
    assert!(found.report.cost_of_transport > COLD.report.cost_of_transport, "nothing is for free");
    // 0.4 of the weight of subject 1 with the device at heel strike, half of it at the end of DS2, and 0 at toe-off.
    let load = 0.4 * 73.15 * 9.81;
    let (ds2, ds3) = (trailing_force(&found, 0), trailing_force(&found, 1));
    assert!(ds2.0 > 0.999 * load && ds2.1 > 0.499 * load && ds3.0 > 0.499 * load, "{ds2:?} {ds3:?} {load}");
    assert!(ds3.1.abs() < 1e-3, "{ds3:?}");
    let free = (trailing_force(&COLD, 0), trailing_force(&COLD, 1));
    assert!(
        free.0.1 < 0.5 * load || free.1.0 < 0.5 * load,
        "without the term the weight transfers early: {free:?} {load}"
    );
}

/// No posture satisfies these bounds, so the QP of the initial guess is infeasible. The solve continues with its
/// relaxation.
#[test]
fn bounds_without_a_posture_are_solved_from_a_relaxed_guess() {
    let strategies = [
        "warm start",
        "cold, direct",
        "cold, direct, early heel rise",
        "cold, direct, exact Hessian from the start",
        "cold, direct, stride time 1.1 s, stride length 1.25 m",
        "cold, direct, early heel rise, stride time 1.1 s, stride length 1.25 m",
        "cold, direct, more regularisation",
        "cold, direct, adaptive barrier",
        "cold, direct, early restoration",
        "cold, direct, heel rise early on the right, early on the left",
        "cold, direct, heel rise late on the right, early on the left",
        "cold, direct, heel rise late on the right, late on the left",
    ];
    for (bounds, retry, tried) in [("a6=0,a7=10,a8=10", true, 12), ("a7=5,a8=5", false, 3)] {
        let run = |warm: Option<&WarmStart>, retry: bool| {
            let options = SolveOptions { max_iterations: 15, retry, ..SolveOptions::default() };
            solve(&problem(bounds), warm, &options, &mut |_| {}, &CancelToken::new()).unwrap()
        };
        let cold = run(None, false);
        assert_eq!(cold.report.status, SolveStatus::IterationLimit);
        assert!(cold.report.iterations >= 15 && !cold.violations.is_empty() && cold.report.max_violation > 1e-6);

        let warm = run(Some(&COLD.warm_start), retry).report;
        assert_ne!(warm.status, SolveStatus::Converged);
        assert!(warm.solver_runs.iter().map(|a| a.strategy.as_str()).eq(strategies[..tried].iter().copied()));
        assert_eq!(warm.solver_runs.iter().filter(|a| a.chosen).count(), 1);
        assert!(warm.max_violation <= cold.report.max_violation, "the better of the two is kept");
    }
}

/// A gait converges at the same violation whatever the tolerance of the solve.
#[test]
fn unfinished_solve_lists_violations_below_its_tolerance() {
    let tolerance = 1e-3;
    let options = SolveOptions { tolerance, time_limit_s: Some(0.0), retry: false, ..SolveOptions::default() };
    let small = [1e-7, 1e-6, 1e-5, 1e-4].into_iter().find_map(|moved| {
        let mut warm = COLD.warm_start.clone();
        warm.point.x.iter_mut().for_each(|x| *x += moved);
        let outcome = solve(&problem(""), Some(&warm), &options, &mut |_| {}, &CancelToken::new()).unwrap();
        let is_small = (1e-6..tolerance).contains(&outcome.report.max_violation);
        (outcome.report.status != SolveStatus::Converged && is_small).then_some(outcome)
    });
    let small = small.expect("no solve ended close to a gait");
    assert!(!small.violations.is_empty(), "{:?}", small.report.max_violation);
    assert!(small.violations.iter().all(|violation| violation.amount > 1e-6), "{:?}", small.violations);
}

#[test]
fn unusable_warm_start_is_a_solver_run_with_a_reason() {
    let mut warm = COLD.warm_start.clone();
    warm.point.x[7] = f64::NAN;
    let runs = solved(&problem(""), Some(&warm), 5).report.solver_runs;
    assert_eq!((runs[0].status, runs[0].iterations), (SolveStatus::Stalled, 0));
    assert_eq!(runs[0].reason, "invalid start: x[7] is NaN; it must be finite");
    assert!(runs[1].iterations > 0 && runs[1].reason.is_empty());
}

#[test]
fn cold_start_without_retry_tries_its_guesses_only() {
    let options = SolveOptions { max_iterations: 3, retry: false, ..SolveOptions::default() };
    let outcome = solve(&problem(""), None, &options, &mut |_| {}, &CancelToken::new()).unwrap();
    assert_ne!(outcome.report.status, SolveStatus::Converged);
    assert_eq!(outcome.report.solver_runs.len(), options.initial_guesses);
}

#[test]
fn numbered_local_optimum_is_the_outcome_of_a_cold_start() {
    let with = |choice| SolveOptions { initial_guesses: 4, local_optimum_choice: choice, ..SolveOptions::default() };
    let solved =
        |warm: Option<&WarmStart>, choice| solve(&problem(""), warm, &with(choice), &mut |_| {}, &CancelToken::new());
    let number = |outcome: &SolveOutcome| {
        outcome.report.solver_runs.iter().find(|run| run.chosen).and_then(|run| run.local_optimum).unwrap()
    };
    let lowest = solved(None, LocalOptimumChoice::LowestObjective).unwrap();
    let other = lowest.other_local_optima.first().expect("several local optima");
    let numbered = |number| LocalOptimumChoice::Numbered { number };
    let second = solved(None, numbered(other.local_optimum)).unwrap();
    assert_eq!(number(&second), other.local_optimum);
    // Tightening of bounds between nodes changes a gait a little.
    let distance = |rmse: f64| (second.report.gait_rmse_rad - rmse).abs();
    assert!(distance(other.gait_rmse_rad) < distance(lowest.report.gait_rmse_rad), "{:?}", second.report);
    assert!(second.other_local_optima.iter().any(|found| found.local_optimum == number(&lowest)));

    let reached = 1 + lowest.other_local_optima.len();
    let missing = solved(None, numbered(reached + 1)).unwrap_err().to_string();
    assert!(missing.contains(&format!("local optima 1 to {reached}, but not number {}", reached + 1)), "{missing}");
    // The number belongs to cold starts.
    let warm = solved(Some(&second.warm_start), numbered(reached + 1)).unwrap();
    assert_eq!(warm.report.started_from, StartedFrom::Warm);
}

#[test]
fn warm_start_is_transferred_between_meshes() {
    let mut finer = problem("");
    finer.settings.mesh = Mesh { ds2: 6, ds3: 6, ss2: 8, ss1: 8 };
    let fine = solved(&finer, Some(&COLD.warm_start), 400);
    assert_eq!((fine.report.status, fine.report.started_from), (SolveStatus::Converged, StartedFrom::Warm));
    assert_eq!(fine.report.solver_runs[0].strategy, "warm start from another mesh");
    let guesses = &COLD.report.solver_runs[..SolveOptions::default().initial_guesses];
    let cold: usize = guesses.iter().map(|a| a.iterations).min().unwrap();
    let moved = fine.report.solver_runs[0].iterations;
    assert!(moved < cold, "{moved} {cold}");
    assert_eq!(fine.warm_start.mesh, finer.settings.mesh);
}

#[test]
fn warm_start_inconsistent_with_its_mesh_is_rejected_with_a_reason() {
    let mut warm = COLD.warm_start.clone();
    warm.mesh.ss1 += 1;
    let error = solve(&problem(""), Some(&warm), &SolveOptions::default(), &mut |_| {}, &CancelToken::new());
    let message = error.unwrap_err().to_string();
    assert!(message.contains(" variables; the problem has "), "{message}");
}

#[test]
fn converged_solve_has_no_explanation() {
    let explanation =
        explain(&problem(""), (&*COLD).into(), &SolveOptions::default(), &mut |_| {}, &CancelToken::new());
    assert_eq!(explanation.unwrap(), None);
}

#[test]
fn explanation_names_relaxations_that_give_a_gait() {
    if skipped_tests::long_tests_are_skipped("") {
        return;
    }
    let bounds = "a2=40,a3=0.5,a4=1.2,a5=0.1,a6=0,a7=15,a8=15";
    let conflict = problem(bounds);
    let options = SolveOptions { max_iterations: 400, retry: false, ..SolveOptions::default() };
    let outcome = solve(&conflict, None, &options, &mut |_| {}, &CancelToken::new()).unwrap();
    assert_ne!(outcome.report.status, SolveStatus::Converged);
    let mut asked = Vec::new();
    let mut progress = |question: &str| asked.push(question.to_owned());
    let explanation =
        explain(&conflict, (&outcome).into(), &options, &mut progress, &CancelToken::new()).unwrap().unwrap();
    assert_eq!(asked.len(), 1 + explanation.relaxations.len() + explanation.together.len());
    let cancel = CancelToken::new();
    let mut cancel_at_relaxations = |question: &str| {
        if question.contains("relaxation") {
            cancel.cancel();
        }
    };
    let stopped =
        explain(&conflict, (&outcome).into(), &options, &mut cancel_at_relaxations, &cancel).unwrap().unwrap();
    assert!(stopped.stopped_early && stopped.relaxations.is_empty() && !explanation.stopped_early);
    assert_eq!(stopped.conflicts, explanation.conflicts);
    assert!(stopped.sentences()[1].starts_with("This explanation was stopped early"));
    assert!(explanation.at_limit.iter().any(|a| a.bound == "a5" && a.domains.iter().all(|d| d.starts_with("SS"))));
    let first: Vec<&str> = explanation.conflicts[0].bounds.iter().map(|given| given.bound.as_str()).collect();
    assert!(!first.is_empty() && explanation.conflicts[0].starts > 1);
    assert!(explanation.relaxations.iter().all(|r| first.contains(&r.bound.as_str())), "nothing else can help");
    assert_eq!(explanation.relaxations.len(), first.len());
    for joint in explanation.together.iter().filter(|joint| joint.warm_start.is_some()) {
        let mut relaxed = conflict.clone();
        for one in &joint.bounds {
            relaxed.bounds.set(&one.bound, one.to.unwrap()).unwrap();
        }
        let again = solved(&relaxed, joint.warm_start.as_ref(), 400).report;
        assert_eq!((again.status, again.started_from), (SolveStatus::Converged, StartedFrom::Warm), "{joint:?}");
    }
    let help = explanation.relaxations.iter().any(|r| r.to.is_some());
    assert!(help || explanation.together.iter().any(|joint| joint.bounds.iter().all(|one| one.to.is_some())));
    for relaxation in &explanation.relaxations {
        assert_eq!(relaxation.to.is_some(), relaxation.warm_start.is_some());
        let Some(to) = relaxation.to else { continue };
        let mut relaxed = conflict.clone();
        relaxed.bounds.set(&relaxation.bound, to).unwrap();
        let again = solved(&relaxed, relaxation.warm_start.as_ref(), 400).report;
        let found = (again.status, again.started_from);
        assert_eq!(found, (SolveStatus::Converged, StartedFrom::Warm), "{} = {to}", relaxation.bound);
    }
}

/// On the default mesh, on which the linear algebra uses its threads.
#[test]
fn one_and_two_threads_give_the_same_bits_within_the_expected_iterations() {
    let problem = GaitProblem::new(Subject::builtin(1).unwrap(), false).unwrap();
    let with = |threads: usize| {
        let options = SolveOptions { threads, initial_guesses: 1, ..SolveOptions::default() };
        solve(&problem, None, &options, &mut |_| {}, &CancelToken::new()).unwrap()
    };
    let (one, two) = (with(1), with(2));
    assert_eq!(one.report.status, SolveStatus::Converged);
    // Vector instructions of other processors round differently, so the limit has a margin.
    assert!(one.report.iterations <= 115, "{}", one.report.iterations);
    assert_eq!(one.report.iterations, two.report.iterations);
    assert_eq!(one.report.objective.to_bits(), two.report.objective.to_bits());
    assert_eq!(one.warm_start, two.warm_start);
    assert_eq!(one.gait, two.gait);
}

/// The solver widens bounds by 1e-8 and projects its result onto them, which must preserve a tight tolerance.
#[test]
fn tightest_allowed_tolerance_is_reached() {
    let problem = GaitProblem::new(Subject::builtin(1).unwrap(), false).unwrap();
    for tolerance in [1e-8, 1e-10] {
        let options = SolveOptions { tolerance, initial_guesses: 1, retry: false, ..SolveOptions::default() };
        let report = solve(&problem, None, &options, &mut |_| {}, &CancelToken::new()).unwrap().report;
        assert_eq!(report.status, SolveStatus::Converged, "{tolerance}");
        assert!(report.max_violation < 1e-7, "{tolerance}: {}", report.max_violation);
        let optimality = report.optimality.unwrap();
        assert!(optimality.dual_infeasibility <= tolerance, "{tolerance}: {optimality:?}");
    }
}
