//! Infeasible, degenerate and unbounded problems, interruption, determinism and warm starts.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, missing_docs)]

mod standard_problems;

use std::cell::Cell;

use interior_point::{
    BarrierStrategy, BoundMultiplierStart, LinearSolver, NlpError, NlpPhase, NlpResult, NlpSettings, NlpStatus,
    NonlinearProgram, StartPoint, WarmPoint, solve,
};
use standard_problems::sparse::{Sparse, Term, cart_pole};
use standard_problems::{Dual, INF, Small};

const EQ: (f64, f64) = (0.0, 0.0);
const GE: (f64, f64) = (0.0, INF);

fn run(problem: &dyn NonlinearProgram, start: &[f64], settings: &NlpSettings) -> NlpResult {
    solve(problem, &StartPoint::Cold(start.to_vec()), settings, &mut |_| {}, &|| false).unwrap()
}

fn cold(problem: &Small) -> NlpResult {
    run(problem, &problem.start, &NlpSettings::default())
}

fn square(v: Dual) -> Dual {
    v * v
}

fn infeasible() -> Vec<Small> {
    let p = Small::new;
    vec![
        p("parallel lines", &[3.0, -1.0], &[EQ, EQ], &[], |x| {
            (square(x[0]) + square(x[1]), vec![x[0] + x[1] - 1.0, x[0] + x[1] - 2.0])
        }),
        p("circle and far line", &[0.5, 0.5], &[(-INF, 1.0), (3.0, INF)], &[], |x| {
            (x[0], vec![square(x[0]) + square(x[1]), x[0] + x[1]])
        }),
        p("row beyond variable bounds", &[0.2, 0.3], &[(5.0, INF)], &[], |x| (x[0], vec![x[0] + 2.0 * x[1]]))
            .all_bounds(0.0, 1.0),
        p("no real root", &[2.0], &[EQ], &[], |x| (x[0], vec![square(x[0]) + 1.0])),
        p("exp cannot be negative", &[1.0, 1.0], &[EQ], &[], |x| (square(x[1]), vec![x[0].exp() + square(x[1]) + 0.5]))
            .bounds(&[(-3.0, 3.0), (-INF, INF)]),
        p("inequalities that exclude each other", &[0.0, 0.0, 0.0], &[GE, GE, EQ], &[], |x| {
            (x[2], vec![x[0] - square(x[1]) - 1.0, -x[0] - square(x[1]), x[0] + x[1] + x[2]])
        }),
    ]
}

#[test]
fn infeasible_problems_are_reported_infeasible() {
    for problem in infeasible() {
        let r = cold(&problem);
        assert_eq!(r.status, NlpStatus::Infeasible, "{}: {:?} {:?}", problem.name, r.residuals, r.counts);
        assert!(r.residuals.violation > 1e-3, "{}", problem.name);
        assert!(r.iterations < 120, "{}: {} iterations", problem.name, r.iterations);
    }
}

/// The restoration phase has an objective of its own, so the scale of the problem's objective must not change its
/// termination test or its multipliers.
#[test]
fn restoration_phase_ignores_the_scale_of_the_objective() {
    let problem = |weight: f64| {
        let functions: fn(&[Dual]) -> (Dual, Vec<Dual>) = if weight > 1.0 {
            |x| (1e8 * (x[0] + square(x[1])), vec![square(x[0]) + square(x[1]) + 1.0])
        } else {
            |x| (x[0] + square(x[1]), vec![square(x[0]) + square(x[1]) + 1.0])
        };
        Small::new("no real root", &[2.0, 1.0], &[EQ], &[], functions)
    };
    let settings = NlpSettings { gradient_scaling: Some(1.0), ..NlpSettings::default() };
    let [plain, steep] = [1.0, 1e8].map(|weight| run(&problem(weight), &[2.0, 1.0], &settings));
    for r in [&plain, &steep] {
        assert_eq!(r.status, NlpStatus::Infeasible, "{r:?}");
        // The multiplier of a violated row is the weight of its violation, in the units of the scaled row.
        let weight = r.row_multipliers[0].abs();
        assert!((weight - settings.constants.elastic_weight / 4.0).abs() < 1.0, "{weight}");
    }
    assert!(steep.iterations <= plain.iterations + 3, "{} {}", steep.iterations, plain.iterations);
}

#[test]
fn infeasible_sparse_problem_is_reported_by_every_linear_solver() {
    // The cart cannot swing the pole up in at most 5 s with 0.1 N.
    let problem = cart_pole(40, 0.1, 1);
    for linear_solver in [LinearSolver::Supernodal, LinearSolver::Multifrontal] {
        let r = run(&problem, &problem.start, &NlpSettings { linear_solver, ..NlpSettings::default() });
        assert_eq!(r.status, NlpStatus::Infeasible, "{:?} {:?}", r.residuals, r.counts);
    }
}

#[test]
fn hs13_without_constraint_qualification_is_no_false_optimum() {
    let problem = Small::new("HS13", &[-2.0, -2.0], &[GE], &[1.0], |x| {
        (square(x[0] - 2.0) + square(x[1]), vec![(1.0 - x[0]).powi(3) - x[1]])
    })
    .all_bounds(0.0, INF);
    let r = cold(&problem);
    // The optimum (1, 0) is not a KKT point. The solver must stop near it, and within the violation tolerance, which
    // near the cusp leaves x1 a range of 0.01.
    assert!((r.x[0] - 1.0).abs() < 0.02 && r.x[1].abs() < 1e-3, "{r:?}");
    assert!(r.x[1] >= -1e-6 && r.x[1] - (1.0 - r.x[0]).powi(3) <= 1e-6, "{r:?}");
    assert!((r.objective - 1.0).abs() < 0.04, "{r:?}");
}

#[test]
fn complementarity_constraints_and_dependent_gradients_are_solved() {
    // min (x-1)^2 + (y-1)^2 with x y <= 0, x, y >= 0: (1, 0) or (0, 1), multipliers unbounded.
    let mpcc = Small::new("mpcc", &[0.4, 0.6], &[(-INF, 0.0)], &[1.0], |x| {
        (square(x[0] - 1.0) + square(x[1] - 1.0), vec![x[0] * x[1]])
    })
    .all_bounds(0.0, INF);
    let r = cold(&mpcc);
    assert_eq!(r.status, NlpStatus::Converged, "{r:?}");
    assert!((r.objective - 1.0).abs() < 1e-3, "{r:?}");

    // Two tangent circles: the only feasible point has parallel gradients.
    let tangent = Small::new("tangent circles", &[0.3, 0.7], &[(-INF, 1.0), (-INF, 1.0)], &[], |x| {
        (x[1], vec![square(x[0]) + square(x[1]), square(x[0] - 2.0) + square(x[1])])
    });
    let r = cold(&tangent);
    assert!(r.residuals.violation < 1e-6, "{r:?}");
    assert!((r.x[0] - 1.0).abs() < 1e-3, "{r:?}");
}

#[test]
fn redundant_equalities_are_solved() {
    let problem = Small::new("redundant", &[1.0, 1.0, 1.0], &[EQ; 4], &[0.0], |x| {
        let plane = x[0] + x[1] + x[2] - 3.0;
        (square(x[0] - 1.0) + square(x[1] - x[2]), vec![plane, 2.0 * plane, x[0] - x[1], x[1] + x[2] + x[0] - 3.0])
    });
    let r = run(&problem, &[5.0, -2.0, 0.0], &NlpSettings::default());
    assert_eq!(r.status, NlpStatus::Converged, "{r:?}");
    assert!(r.objective.abs() < 1e-8);
    assert!(r.iterations <= 12, "{}", r.iterations);
    let once = cart_pole(60, 20.0, 1);
    let twice = cart_pole(60, 20.0, 2);
    for linear_solver in [LinearSolver::Supernodal, LinearSolver::Multifrontal] {
        let settings = NlpSettings { linear_solver, ..NlpSettings::default() };
        let (a, b) = (run(&once, &once.start, &settings), run(&twice, &twice.start, &settings));
        assert_eq!(a.status, NlpStatus::Converged);
        assert_eq!(b.status, NlpStatus::Converged, "{:?} {:?}", b.residuals, b.counts);
    }
}

#[test]
fn problems_without_rows_are_solved() {
    let free =
        Small::new("quartic", &[3.0, -2.0], &[], &[0.0], |x| (square(x[0] - x[1]) + (x[0] - 1.0).powi(4), vec![]));
    assert_eq!(cold(&free).status, NlpStatus::Converged);
    let boxed =
        Small::new("linear in a box", &[0.5, 0.5], &[], &[-1.0], |x| (x[0] - x[1], vec![])).all_bounds(0.0, 1.0);
    let r = cold(&boxed);
    assert_eq!(r.status, NlpStatus::Converged);
    assert!((r.objective + 1.0).abs() < 1e-6);
    assert!((r.lower_multipliers[0] - 1.0).abs() < 1e-6 && (r.upper_multipliers[1] - 1.0).abs() < 1e-6, "{r:?}");
}

#[test]
fn fixed_variables_and_free_rows_keep_their_index() {
    // x1 fixed at 2; the second row has no bounds.
    let problem = Small::new("fixed", &[0.0, 7.0, 0.0], &[EQ, (-INF, INF)], &[], |x| {
        (square(x[0] - 3.0) + square(x[1]) + square(x[2]), vec![x[0] + x[1] * x[2] - 1.0, x[0] * x[2]])
    })
    .bounds(&[(-INF, INF), (2.0, 2.0), (-INF, INF)]);
    let r = cold(&problem);
    assert_eq!(r.status, NlpStatus::Converged, "{r:?}");
    assert_eq!(r.x[1], 2.0);
    // x0 = 1 - 2 x2: minimise (2 + 2 x2)^2 + x2^2 -> x2 = -0.8.
    assert!((r.x[2] + 0.8).abs() < 1e-7 && (r.x[0] - 2.6).abs() < 1e-7, "{r:?}");
    // Multiplier of the fixed variable: d/dx1 of the Lagrangian, 2 x1 + y x2 with y = -2 (x0 - 3) = 0.8.
    assert!((r.lower_multipliers[1] - r.upper_multipliers[1] - (4.0 - 0.64)).abs() < 1e-6, "{r:?}");
    assert!(r.residuals.dual_infeasibility < 1e-7);
}

#[test]
fn problem_with_only_fixed_variables_is_solved() {
    let problem = Small::new("all fixed", &[0.0], &[(0.0, 4.0)], &[1.0], |x| (x[0], vec![x[0]])).all_bounds(1.0, 1.0);
    let r = cold(&problem);
    assert_eq!(r.status, NlpStatus::Converged, "{r:?}");
    assert_eq!(r.x, [1.0]);
}

#[test]
fn unbounded_objectives_are_not_solutions() {
    let problem = Small::new("unbounded", &[1.0, 1.0], &[GE], &[], |x| (-x[0] - x[1], vec![x[0] - x[1] + 5.0]));
    let r = cold(&problem);
    assert_eq!(r.status, NlpStatus::Unbounded, "{r:?}");
}

#[test]
fn undefined_trial_points_are_rejected() {
    // ln needs x > 0, but x has no bound, so full steps leave the domain.
    let problem = Small::new("logarithms", &[5.0, 5.0], &[EQ], &[], |x| {
        (x[0] * x[0].ln() + x[1] - 3.0 * x[0], vec![x[1].ln() + x[0] - 2.0])
    });
    let r = cold(&problem);
    assert_eq!(r.status, NlpStatus::Converged, "{r:?}");
    assert!(r.residuals.dual_infeasibility < 1e-7);
    let undefined = Small::new("undefined", &[-1.0], &[], &[], |x| (x[0].ln(), vec![]));
    let error = solve(&undefined, &StartPoint::Cold(vec![-1.0]), &NlpSettings::default(), &mut |_| {}, &|| false);
    assert!(matches!(error, Err(NlpError::EvaluationFailed { .. })), "{error:?}");
}

#[test]
fn invalid_input_is_reported_by_name() {
    let problem = Small::new("p", &[0.0], &[EQ], &[], |x| (x[0], vec![x[0]]));
    let go = |problem: &Small, x: Vec<f64>, settings: &NlpSettings| {
        solve(problem, &StartPoint::Cold(x), settings, &mut |_| {}, &|| false)
    };
    let settings = NlpSettings::default();
    assert!(matches!(go(&problem, vec![0.0; 2], &settings), Err(NlpError::InvalidStart(_))));
    assert!(matches!(go(&problem, vec![f64::NAN], &settings), Err(NlpError::InvalidStart(_))));
    let bad = NlpSettings { required_reduction: 1.5, ..settings };
    assert!(matches!(go(&problem, vec![0.0], &bad), Err(NlpError::InvalidSetting { field: "required_reduction", .. })));
    let bad = NlpSettings { tolerance: f64::NAN, ..settings };
    assert!(matches!(go(&problem, vec![0.0], &bad), Err(NlpError::InvalidSetting { field: "tolerance", .. })));
    let crossed = Small::new("p", &[0.0], &[(1.0, -1.0)], &[], |x| (x[0], vec![x[0]]));
    assert!(matches!(go(&crossed, vec![0.0], &settings), Err(NlpError::InvalidProblem(_))));
    let mut blocks = cart_pole(10, 20.0, 1);
    let count = blocks.blocks.as_ref().unwrap().parent.len();
    for parent in [0, count] {
        let mut wrong = cart_pole(10, 20.0, 1);
        wrong.blocks.as_mut().unwrap().parent[0] = Some(parent);
        let start = StartPoint::Cold(wrong.start.clone());
        let error = solve(&wrong, &start, &settings, &mut |_| {}, &|| false).unwrap_err().to_string();
        let reason = format!("the parent of block 0 is {parent}; it must be more than 0 and less than {count}");
        assert!(error.contains(&reason), "{error}");
    }
    blocks.blocks.as_mut().unwrap().block_of_row[3] = 0;
    blocks.blocks.as_mut().unwrap().block_of_row[30] = 0;
    let start = StartPoint::Cold(blocks.start.clone());
    let error = solve(&blocks, &start, &settings, &mut |_| {}, &|| false);
    assert!(matches!(error, Err(NlpError::InvalidProblem(_))), "{error:?}");
}

#[test]
fn cancellation_and_limits_stop_the_solve() {
    let problem = cart_pole(40, 20.0, 1);
    let start = StartPoint::Cold(problem.start.clone());
    let seen = Cell::new(0);
    let r = solve(&problem, &start, &NlpSettings::default(), &mut |_| seen.set(seen.get() + 1), &|| seen.get() >= 5);
    let r = r.unwrap();
    assert_eq!(r.status, NlpStatus::Cancelled);
    assert_eq!(r.iterations, 4);
    let r = run(&problem, &problem.start, &NlpSettings { max_iterations: 3, ..NlpSettings::default() });
    assert_eq!((r.status, r.iterations), (NlpStatus::IterationLimit, 3));
    let r = run(&problem, &problem.start, &NlpSettings { max_seconds: 0.0, ..NlpSettings::default() });
    assert_eq!(r.status, NlpStatus::TimeLimit);
}

#[test]
fn results_are_bit_for_bit_the_same_for_every_number_of_threads() {
    let problem = cart_pole(120, 20.0, 1);
    let solve_with = |linear_solver, threads| {
        let mut trace = Vec::new();
        let settings = NlpSettings { linear_solver, threads, ..NlpSettings::default() };
        let start = StartPoint::Cold(problem.start.clone());
        let r = solve(&problem, &start, &settings, &mut |it| trace.push(*it), &|| false).unwrap();
        assert_eq!(r.status, NlpStatus::Converged);
        (trace, r.x, r.row_multipliers)
    };
    let once = solve_with(LinearSolver::Multifrontal, 1);
    assert!(once == solve_with(LinearSolver::Multifrontal, 1));
    assert!(once == solve_with(LinearSolver::Multifrontal, 2));
    assert!(once == solve_with(LinearSolver::Multifrontal, 3));
    let supernodal = solve_with(LinearSolver::Supernodal, 1);
    assert!(supernodal == solve_with(LinearSolver::Supernodal, 1));
    let (a, b) = (once.0.last().unwrap().objective, supernodal.0.last().unwrap().objective);
    assert!((a - b).abs() < 1e-7, "{a} {b}");
}

#[test]
fn warm_starts_need_few_iterations() {
    let mut problem = cart_pole(120, 20.0, 1);
    let settings = NlpSettings::default();
    let first = run(&problem, &problem.start, &settings);
    assert_eq!(first.status, NlpStatus::Converged);
    // The same problem again.
    let again = |problem: &Sparse, warm: WarmPoint| {
        solve(problem, &StartPoint::Warm(warm), &settings, &mut |_| {}, &|| false).unwrap()
    };
    let r = again(&problem, first.warm_point());
    assert_eq!(r.status, NlpStatus::Converged);
    assert!(r.iterations <= 3, "{}", r.iterations);
    // Tighter force limit.
    for j in (4..605).step_by(5) {
        problem.lower[j] = -19.8;
        problem.upper[j] = 19.8;
    }
    let r = again(&problem, first.warm_point());
    assert_eq!(r.status, NlpStatus::Converged);
    assert!(r.iterations <= 12, "{}", r.iterations);
    let cold = run(&problem, &problem.start, &settings);
    assert!((cold.objective - r.objective).abs() < 1e-6, "{} {}", cold.objective, r.objective);
}

#[test]
fn barrier_strategies_and_initial_barriers_reach_the_same_optimum() {
    let problem = cart_pole(60, 20.0, 1);
    let mut first = None;
    for (barrier_strategy, mu_initial) in
        [(BarrierStrategy::Monotone, 0.1), (BarrierStrategy::Monotone, 1e-3), (BarrierStrategy::Adaptive, 0.1)]
    {
        for bound_multiplier_start in [BoundMultiplierStart::One, BoundMultiplierStart::Centred] {
            let settings =
                NlpSettings { barrier_strategy, mu_initial, bound_multiplier_start, ..NlpSettings::default() };
            let r = run(&problem, &problem.start, &settings);
            assert_eq!(r.status, NlpStatus::Converged, "{settings:?} {:?}", r.counts);
            let first = *first.get_or_insert(r.objective);
            assert!((r.objective - first).abs() < 1e-7, "{settings:?}: {} {first}", r.objective);
        }
    }
}

#[test]
fn gradient_scaling_reports_unscaled_multipliers() {
    // min 1e4 x^2 + y with 1e3 (x + y) = 1e3: L = f + lambda g.
    let problem = Small::new("scaled", &[3.0, 0.0], &[EQ, (-1e5, INF)], &[], |x| {
        (1e4 * square(x[0]) + x[1], vec![1e3 * (x[0] + x[1]) - 1e3, 1e4 * x[1]])
    });
    let plain = cold(&problem);
    let scaled =
        run(&problem, &problem.start, &NlpSettings { gradient_scaling: Some(100.0), ..NlpSettings::default() });
    assert_eq!((plain.status, scaled.status), (NlpStatus::Converged, NlpStatus::Converged));
    assert!((plain.row_multipliers[0] + 1e-3).abs() < 1e-8, "{plain:?}");
    assert!((scaled.row_multipliers[0] + 1e-3).abs() < 1e-8, "{scaled:?}");
    assert!(scaled.residuals.dual_infeasibility < 1e-5);
}

#[test]
fn observer_gets_every_iterate_of_both_phases() {
    let problem = &infeasible()[1];
    let mut numbers = Vec::new();
    let mut phases = Vec::new();
    let start = StartPoint::Cold(problem.start.clone());
    let r = solve(
        problem,
        &start,
        &NlpSettings::default(),
        &mut |it| {
            numbers.push(it.number);
            phases.push(it.phase);
        },
        &|| false,
    );
    let r = r.unwrap();
    assert_eq!(numbers.first(), Some(&0));
    assert!(numbers.windows(2).all(|w| w[1] == w[0] || w[1] == w[0] + 1), "{numbers:?}");
    assert_eq!(numbers.last(), Some(&r.iterations));
    let entered = phases.windows(2).filter(|p| *p == [NlpPhase::Regular, NlpPhase::Restoration]).count();
    assert_eq!(entered, r.counts.restoration_phases);
}

#[test]
fn settings_round_trip_through_json_and_reject_unknown_fields() {
    let settings = NlpSettings { tolerance: 1e-7, threads: 2, ..NlpSettings::default() };
    let text = serde_json::to_string(&settings).unwrap();
    assert_eq!(serde_json::from_str::<NlpSettings>(&text).unwrap(), settings);
    assert!(serde_json::from_str::<NlpSettings>("{\"tolerence\": 1}").is_err());
    assert_eq!(serde_json::from_str::<NlpSettings>("{}").unwrap(), NlpSettings::default());
}

#[test]
fn sparse_problem_without_elimination_blocks_is_solved() {
    let mut problem = cart_pole(60, 20.0, 1);
    let with = run(&problem, &problem.start, &NlpSettings::default());
    problem.blocks = None;
    let without = run(&problem, &problem.start, &NlpSettings::default());
    assert_eq!(without.status, NlpStatus::Converged, "{:?}", without.counts);
    assert!((with.objective - without.objective).abs() < 1e-6);
}

#[test]
fn linear_objective_with_curved_rows_is_solved() {
    // Only rows give curvature: the KKT matrix has zero diagonals everywhere.
    let n = 50;
    let rows: Vec<Term> = (0..n - 1).map(|k| Term::new(vec![k, k + 1], |x| x[1] - x[0] - 0.1 * x[0] * x[1])).collect();
    let objective = (0..n).map(|k| Term::new(vec![k], |x| x[0])).collect();
    let bounds = vec![EQ; n - 1];
    let mut problem = Sparse::new(vec![0.5; n], objective, rows, bounds);
    problem.lower.fill(0.01);
    let r = run(&problem, &problem.start, &NlpSettings::default());
    assert_eq!(r.status, NlpStatus::Converged, "{r:?}");
    assert!((r.x[0] - 0.01).abs() < 1e-6);
}

#[test]
fn separable_problem_with_diagonal_matrix_is_solved() {
    let n = 300;
    let objective = (0..n).map(|k| Term::new(vec![k], move |x| square(x[0] - (k % 7) as f64))).collect();
    let mut problem = Sparse::new(vec![1.0; n], objective, vec![], vec![]);
    problem.upper.fill(5.0);
    let r = run(&problem, &problem.start, &NlpSettings::default());
    assert_eq!(r.status, NlpStatus::Converged, "{r:?}");
    assert!((r.objective - 42.0).abs() < 1e-4, "{}", r.objective);
}

#[test]
fn empty_problem_is_solved() {
    let problem = Small::new("empty", &[], &[], &[], |_| (Dual::constant(3.0), vec![]));
    let r = cold(&problem);
    assert_eq!((r.status, r.objective), (NlpStatus::Converged, 3.0));
}

/// With regularised rows a direction can be an ascent direction at a feasible point because of a wrong multiplier
/// alone.
#[test]
fn wrong_multiplier_does_not_trigger_inertia_correction() {
    let problem = Small::new("square over a point", &[0.0], &[EQ], &[], |x| (0.5 * square(x[0] + 1.0), vec![x[0]]));
    let warm = WarmPoint {
        x: vec![0.0],
        row_multipliers: vec![-2.0],
        lower_multipliers: vec![0.0],
        upper_multipliers: vec![0.0],
        ..WarmPoint::default()
    };
    let mut regularised = 0.0_f64;
    let result = solve(
        &problem,
        &StartPoint::Warm(warm),
        &NlpSettings::default(),
        &mut |record| regularised = regularised.max(record.delta_w),
        &|| false,
    )
    .unwrap();
    assert_eq!((result.status, result.counts.solver_fallbacks, regularised), (NlpStatus::Converged, 0, 0.0));
    assert!(result.iterations <= 2, "{}", result.iterations);
    assert!((result.row_multipliers[0] + 1.0).abs() < 1e-6, "{:?}", result.row_multipliers);
}

/// Negative curvature along the direction back to a violated row is compatible with the right inertia, as for [-1 1;
/// 1 0].
#[test]
fn ascent_towards_a_violated_row_does_not_trigger_inertia_correction() {
    let problem = Small::new("hill through a point", &[1.0], &[EQ], &[], |x| (-0.5 * square(x[0]), vec![x[0]]));
    let mut regularised = 0.0_f64;
    let result = solve(
        &problem,
        &StartPoint::Cold(vec![1.0]),
        &NlpSettings::default(),
        &mut |record| regularised = regularised.max(record.delta_w),
        &|| false,
    )
    .unwrap();
    assert_eq!((result.status, result.counts.solver_fallbacks, regularised), (NlpStatus::Converged, 0, 0.0));
    assert!(result.x[0].abs() < 1e-6 && result.iterations <= 2, "{} {}", result.x[0], result.iterations);
}
