//! The standard set: every problem converges to a known optimum in the recorded number of iterations.
#![allow(clippy::unwrap_used, missing_docs)]

mod standard_problems;

use interior_point::{
    BarrierStrategy, LinearSolver, NlpResult, NlpSettings, NlpStatus, NonlinearProgram, StartPoint, solve,
};
use standard_problems::sparse::{Sparse, cart_pole, gait_sized};
use standard_problems::swing_up::SwingUp;
use standard_problems::{Small, hock_schittkowski, optimal_control, sets};

fn misses(settings: &NlpSettings, golden: Option<&[(&str, usize)]>) -> Vec<String> {
    let mut misses = Vec::new();
    for problem in hock_schittkowski::all() {
        let start = StartPoint::Cold(problem.start.clone());
        let r = solve(&problem, &start, settings, &mut |_| {}, &|| false).unwrap();
        let name = problem.name;
        if r.status != NlpStatus::Converged || !problem.is_optimum(r.objective) {
            misses.push(format!("{name}: {:?} f = {}", r.status, r.objective));
        }
        if let Some(golden) = golden {
            let expected = golden.iter().find(|g| g.0 == name).map_or(0, |g| g.1);
            // Rounding on another machine may change the count by two iterations or a tenth.
            if r.iterations > expected + (expected / 10).max(2) {
                misses.push(format!("{name}: {} iterations, expected {expected}", r.iterations));
            }
        }
    }
    misses
}

include!("standard_problems/golden_iterations.rs");

#[test]
fn standard_set_converges_with_golden_iteration_counts() {
    let none: Vec<String> = Vec::new();
    assert_eq!(misses(&NlpSettings::default(), Some(GOLDEN)), none);
}

#[test]
fn standard_set_converges_with_gradient_scaling() {
    let none: Vec<String> = Vec::new();
    assert_eq!(misses(&NlpSettings { gradient_scaling: Some(100.0), ..NlpSettings::default() }, None), none);
}

#[test]
fn standard_set_converges_with_the_multifrontal_solver() {
    let none: Vec<String> = Vec::new();
    assert_eq!(
        misses(&NlpSettings { linear_solver: LinearSolver::Multifrontal, ..NlpSettings::default() }, None),
        none
    );
}

#[test]
fn standard_set_converges_with_the_adaptive_barrier() {
    // HS33 ends at (2, 0, 2) with f = 2: a KKT point without being a minimum (along x1 = x3 = t the objective is
    // (t - 2)^3 + 2), which first-order conditions cannot tell apart.
    let misses = misses(&NlpSettings { barrier_strategy: BarrierStrategy::Adaptive, ..NlpSettings::default() }, None);
    let others: Vec<&String> = misses.iter().filter(|m| !m.starts_with("HS33: Converged f = 1.9999")).collect();
    assert!(others.is_empty(), "{others:?}");
}

/// Largest violation of the KKT conditions at a result, from the functions of the problem alone: bounds of variables and
/// rows, signs and complementarity of the multipliers, gradient of the Lagrangian. The last two are relative to the
/// size of the multipliers.
fn kkt_violation(problem: &Small, r: &NlpResult) -> f64 {
    let (n, m) = (problem.start.len(), problem.row_lower.len());
    let (mut gradient, mut rows, mut jacobian) = (vec![0.0; n], vec![0.0; m], vec![0.0; n * m]);
    problem.gradient(&r.x, &mut gradient);
    problem.constraints(&r.x, &mut rows);
    problem.jacobian(&r.x, &mut jacobian);
    let multipliers = r.row_multipliers.iter().chain(&r.lower_multipliers).chain(&r.upper_multipliers);
    let size = multipliers.fold(1.0_f64, |size, y| size.max(y.abs()));
    let mut worst = 0.0_f64;
    let mut pair = |value: f64, (low, high): (f64, f64), (at_low, at_high): (f64, f64)| {
        worst = worst.max(low - value).max(value - high).max(-at_low / size).max(-at_high / size);
        for (distance, multiplier) in [(value - low, at_low), (high - value, at_high)] {
            // Without a bound the multiplier is zero.
            let product = if distance.is_finite() { distance.abs().min(1.0) * multiplier } else { multiplier };
            worst = worst.max(product.abs() / size);
        }
    };
    for i in 0..m {
        let y = r.row_multipliers[i];
        let bounds = (problem.row_lower[i], problem.row_upper[i]);
        pair(rows[i], bounds, ((-y).max(0.0), y.max(0.0)));
    }
    for j in 0..n {
        pair(r.x[j], (problem.lower[j], problem.upper[j]), (r.lower_multipliers[j], r.upper_multipliers[j]));
    }
    for j in 0..n {
        let of_rows: f64 = (0..m).map(|i| r.row_multipliers[i] * jacobian[j * m + i]).sum();
        let slope = gradient[j] + of_rows - r.lower_multipliers[j] + r.upper_multipliers[j];
        worst = worst.max(slope.abs() / size);
    }
    worst
}

/// Random starts whose solve ends at a local minimum of the violation, although each problem is feasible.
const LOCALLY_INFEASIBLE: [&str; 2] = ["HS63 from start 0", "HS104 from start 0"];

#[test]
fn solves_from_random_starts_end_at_kkt_points() {
    let mut infeasible = Vec::new();
    for problem in hock_schittkowski::all() {
        for (start, x) in sets::random_starts(&problem).into_iter().enumerate() {
            let r = solve(&problem, &StartPoint::Cold(x), &NlpSettings::default(), &mut |_| {}, &|| false).unwrap();
            let name = format!("{} from start {start}", problem.name);
            if r.status == NlpStatus::Infeasible {
                infeasible.push(name);
                continue;
            }
            assert_eq!(r.status, NlpStatus::Converged, "{name}");
            let violation = kkt_violation(&problem, &r);
            assert!(violation < 2e-6, "{name}: {violation}, {r:?}");
        }
    }
    assert_eq!(infeasible, LOCALLY_INFEASIBLE);
}

#[test]
fn sparse_problems_keep_their_iteration_counts_with_every_solver() {
    // name, problem, optimum, iterations
    let golden: Vec<(&str, Sparse, f64, usize)> = vec![
        ("cart-pole 50", cart_pole(50, 20.0, 1), 2.288286949, 37),
        ("cart-pole 100", cart_pole(100, 20.0, 1), 2.284912413, 46),
        ("gait-sized 2 x 5", gait_sized(2, 5), 159.43500783, 20),
    ];
    for (name, problem, optimum, iterations) in &golden {
        for linear_solver in [LinearSolver::Auto, LinearSolver::Supernodal, LinearSolver::Multifrontal] {
            let settings = NlpSettings { linear_solver, threads: 2, ..NlpSettings::default() };
            let start = StartPoint::Cold(problem.start.clone());
            let r = solve(problem, &start, &settings, &mut |_| {}, &|| false).unwrap();
            assert_eq!(r.status, NlpStatus::Converged, "{name} {linear_solver:?}");
            let limit = iterations + (iterations / 10).max(2);
            assert!(
                r.iterations <= limit,
                "{name} {linear_solver:?}: {} iterations, used to be {iterations}",
                r.iterations
            );
            assert!((r.objective - optimum).abs() < 1e-6 * optimum.abs(), "{name} {linear_solver:?}: {}", r.objective);
        }
    }
}

/// The largest number of iterations of the optimal control problems with any factorisation. The path of the hang glider
/// depends on rounding: 293 iterations with fronts, 300 with supernodes, 377 with delayed pivots.
const CONTROL_ITERATIONS: [(&str, usize); 7] = [
    ("hanging chain", 7),
    ("particle steering", 14),
    ("catalyst mixing", 19),
    ("Goddard rocket", 53),
    ("robot arm", 24),
    ("hang glider", 377),
    ("gas oil cracking", 16),
];

#[test]
fn optimal_control_problems_reach_their_published_optima() {
    let mut misses = Vec::new();
    for (problem, (name, iterations)) in optimal_control::all().iter().zip(CONTROL_ITERATIONS) {
        assert_eq!(problem.name, name);
        let start = StartPoint::Cold(problem.program.start.clone());
        let r = solve(&problem.program, &start, &NlpSettings::default(), &mut |_| {}, &|| false).unwrap();
        let reached = r.status == NlpStatus::Converged && problem.is_optimum(r.objective);
        if !reached || r.iterations > iterations + (iterations / 10).max(2) {
            misses.push(format!("{name}: {:?} f = {} in {} iterations", r.status, r.objective, r.iterations));
        }
    }
    assert!(misses.is_empty(), "{misses:#?}");
}

/// The objectives are those of IPOPT (`optimizer/benches/casadi/cart_pole.py`); at 220 steps that of this solver.
const SWING_UPS: [(usize, f64, usize); 4] =
    [(100, 11181.317719, 88), (200, 22245.725103, 111), (220, 24463.895135, 107), (300, 33336.600907, 119)];

fn swing_up(problem: &SwingUp, linear_solver: LinearSolver, (optimum, within): (f64, f64), iterations: usize) -> usize {
    let settings = NlpSettings { linear_solver, ..NlpSettings::default() };
    let r = solve(problem, &StartPoint::Cold(problem.start()), &settings, &mut |_| {}, &|| false).unwrap();
    let name = format!("optimum {optimum}, {linear_solver:?}");
    assert_eq!(r.status, NlpStatus::Converged, "{name}");
    assert!(r.iterations <= iterations + iterations / 10, "{name}: {} iterations", r.iterations);
    assert!((r.objective - optimum).abs() < within * optimum, "{name}: {}", r.objective);
    r.counts.solver_fallbacks
}

#[test]
fn cart_pole_swing_ups_reach_the_objectives_of_ipopt() {
    for (steps, optimum, iterations) in SWING_UPS {
        swing_up(&SwingUp::new(steps), LinearSolver::Auto, (optimum, 1e-9), iterations);
    }
}

/// Without delayed pivots the inertia is wrong near the solution, and 200, 220 and 300 steps reach the iteration limit.
#[test]
fn inaccurate_fronts_are_detected_and_pivots_delayed() {
    for (steps, optimum, iterations) in SWING_UPS {
        let problem = SwingUp::with_ill_conditioned_fronts(steps);
        // Doubtful factors are part of the path until they are noticed: it may be longer and end in another optimum
        // near by (24463.146 at 220 steps).
        let fallbacks = swing_up(&problem, LinearSolver::Auto, (optimum, 1e-4), iterations + iterations / 10);
        assert!(fallbacks > 0 || steps == 100, "{steps} steps: {fallbacks} fallbacks");
        swing_up(&problem, LinearSolver::DelayedPivots, (optimum, 1e-9), iterations);
    }
}
