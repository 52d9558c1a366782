//! The entry point: checks, start, iteration, result.

use std::time::Instant;

use crate::barrier;
use crate::factorisation::{self, KktMatrix, check_blocks};
use crate::formulation::{Formulation, RowForm, entries};
use crate::iterate::{Iterate, IterationEnd, SolveSession, StepRecord};
use crate::newton_system::NewtonSystem;
use crate::nonlinear_program::NonlinearProgram;
use crate::primal_dual::PrimalDual;
use crate::settings::{BoundMultiplierStart, NlpSettings};
use crate::starting_point::{StartPoint, WarmPoint};
use crate::status::{NlpCounts, NlpError, NlpIteration, NlpResult, NlpStatus, Residuals, Timing};

/// Minimises f(x) subject to the bounds of `problem` from `start`.
///
/// `observer` gets every iterate, the start included; `cancel` is called once per iteration.
///
/// # Errors
/// [`NlpError`] when settings, problem or start are invalid or a function is not finite at the start. Every other
/// outcome is an [`NlpStatus`].
pub fn solve(
    problem: &dyn NonlinearProgram,
    start: &StartPoint,
    settings: &NlpSettings,
    observer: &mut dyn FnMut(&NlpIteration),
    cancel: &dyn Fn() -> bool,
) -> Result<NlpResult, NlpError> {
    let started = Instant::now();
    settings.validate()?;
    let mut form = Formulation::new(problem, settings)?;
    if let Some(blocks) = problem.elimination_blocks() {
        check_blocks(&form, blocks)?;
    }
    check_start(&form, start)?;

    let multiplier = settings.constants.warm_multiplier_push;
    let mu = settings.mu_initial;
    let bound = match start {
        StartPoint::Cold(_) => settings.bound_push,
        StartPoint::Warm(_) => settings.warm_bound_push,
    };
    let point = place(&mut form, start, settings, StartDistances { bound, multiplier });
    let mut run = Iterate::new(form, point, mu);
    run.evaluate();
    check_evaluations(&run)?;

    let analysis = Instant::now();
    let matrix = KktMatrix::new(&run.form);
    let solver = factorisation::choose(&run.form, &matrix, settings)?;
    let analysis = analysis.elapsed().as_secs_f64();
    let mut session = SolveSession {
        settings,
        observer,
        cancel,
        started,
        newton: NewtonSystem::new(matrix, solver),
        iterations: 0,
        counts: NlpCounts::default(),
        last_step: StepRecord::default(),
    };
    match start {
        StartPoint::Cold(_) => {
            for j in 0..run.form.length() {
                let first = |slack: f64| match (slack.is_finite(), settings.bound_multiplier_start) {
                    (false, _) => 0.0,
                    (true, BoundMultiplierStart::One) => 1.0,
                    (true, BoundMultiplierStart::Centred) => mu / slack,
                };
                run.point.zl[j] = first(run.at.slack_lower[j]);
                run.point.zu[j] = first(run.at.slack_upper[j]);
            }
            run.estimate_multipliers(&mut session);
        }
        StartPoint::Warm(_) => {
            let average = barrier::average_complementarity(&run.point, &run.at).unwrap_or(mu);
            run.mu = average.clamp(barrier::smallest_mu(settings, run.form.objective_scale), mu);
        }
    }
    run.begin_filter();
    let ending = run.iterate(&mut session, None);
    Ok(report(&mut run, &session, ending, analysis))
}

/// Least distances of a start from the boundary of the feasible set.
#[derive(Debug, Clone, Copy)]
pub(crate) struct StartDistances {
    /// Distance from a bound, relative to its magnitude and to the distance between two bounds.
    pub bound: f64,
    /// Smallest bound multiplier of a warm point.
    pub multiplier: f64,
}

/// The point of a start within its bounds, in the scaling that it determines. Without multipliers for a cold start.
pub(crate) fn place(
    form: &mut Formulation,
    start: &StartPoint,
    settings: &NlpSettings,
    pushes: StartDistances,
) -> PrimalDual {
    let x = match start {
        StartPoint::Cold(x) => x,
        StartPoint::Warm(warm) => &warm.x,
    };
    let within = |value: f64, lower: f64, upper: f64| pushed(value, lower, upper, pushes.bound);
    let mut point = PrimalDual::zeros(form);
    for j in 0..form.n {
        point.w[j] = form.fixed[j].unwrap_or_else(|| within(x[j], form.lower[j], form.upper[j]));
    }
    if let Some(limit) = settings.gradient_scaling {
        form.scale_by_gradients(&point.w, limit);
    }
    // Slacks start at g(x) or at those of the warm point.
    let mut c = vec![0.0; form.m];
    form.constraints(&point.w, &mut c);
    for i in 0..form.m {
        if let RowForm::Inequality(k) = form.rows[i] {
            let j = form.n + k;
            let value = match start {
                StartPoint::Warm(warm) if !warm.slacks.is_empty() => warm.slacks[i] * form.row_scale[i],
                _ => c[i],
            };
            point.w[j] = within(value, form.lower[j], form.upper[j]);
        }
    }
    if let StartPoint::Warm(warm) = start {
        take_multipliers(form, warm, pushes.multiplier, &mut point);
    }
    point
}

/// `value`, moved to at least min(push max(1, |bound|), push (u - l)) from its bounds (WB06 section 3.6).
fn pushed(value: f64, lower: f64, upper: f64, push: f64) -> f64 {
    let width = push * (upper - lower);
    let mut value = value;
    if lower.is_finite() {
        value = value.max(lower + (push * lower.abs().max(1.0)).min(width));
    }
    if upper.is_finite() {
        value = value.min(upper - (push * upper.abs().max(1.0)).min(width));
    }
    value
}

fn take_multipliers(form: &Formulation, warm: &WarmPoint, least: f64, point: &mut PrimalDual) {
    let f = form.objective_scale;
    for j in 0..form.n {
        if form.lower[j].is_finite() {
            point.zl[j] = (warm.lower_multipliers[j] * f).max(least);
        }
        if form.upper[j].is_finite() {
            point.zu[j] = (warm.upper_multipliers[j] * f).max(least);
        }
    }
    for i in 0..form.m {
        let scale = f / form.row_scale[i];
        let y = warm.row_multipliers[i];
        point.y[i] = y * scale;
        if let RowForm::Inequality(k) = form.rows[i] {
            let j = form.n + k;
            let given = |list: &[f64], otherwise: f64| list.get(i).copied().unwrap_or(otherwise.max(0.0));
            if form.lower[j].is_finite() {
                point.zl[j] = (given(&warm.slack_lower_multipliers, -y) * scale).max(least);
            }
            if form.upper[j].is_finite() {
                point.zu[j] = (given(&warm.slack_upper_multipliers, y) * scale).max(least);
            }
        }
    }
}

pub(crate) fn check_start(form: &Formulation, start: &StartPoint) -> Result<(), NlpError> {
    let check = |name: &str, values: &[f64], expected: usize| {
        if values.len() != expected {
            return Err(NlpError::InvalidStart(format!("{name} has length {}; it must be {expected}", values.len())));
        }
        match values.iter().position(|v| !v.is_finite()) {
            Some(i) => Err(NlpError::InvalidStart(format!("{name}[{i}] is {}; it must be finite", values[i]))),
            None => Ok(()),
        }
    };
    match start {
        StartPoint::Cold(x) => check("x", x, form.n),
        StartPoint::Warm(warm) => {
            check("x", &warm.x, form.n)?;
            check("row_multipliers", &warm.row_multipliers, form.m)?;
            check("lower_multipliers", &warm.lower_multipliers, form.n)?;
            check("upper_multipliers", &warm.upper_multipliers, form.n)?;
            for (name, list) in [
                ("slacks", &warm.slacks),
                ("slack_lower_multipliers", &warm.slack_lower_multipliers),
                ("slack_upper_multipliers", &warm.slack_upper_multipliers),
            ] {
                if !list.is_empty() {
                    check(name, list, form.m)?;
                }
            }
            Ok(())
        }
    }
}

fn check_evaluations(run: &Iterate) -> Result<(), NlpError> {
    let objective = [run.objective];
    let parts: [(&'static str, &[f64]); 4] = [
        ("the objective", &objective),
        ("a constraint", &run.c),
        ("the objective's gradient", &run.gradient),
        ("the Jacobian", &run.at.jacobian),
    ];
    for (what, values) in parts {
        if let Some(index) = values.iter().position(|v| !v.is_finite()) {
            return Err(NlpError::EvaluationFailed { what, index });
        }
    }
    Ok(())
}

fn report(run: &mut Iterate, session: &SolveSession, ending: IterationEnd, analysis: f64) -> NlpResult {
    let scaled_residuals = run.current_optimality().scaled();
    let form = &run.form;
    let (n, m) = (form.n, form.m);
    let x = run.point.w[..n].to_vec();
    let f = form.objective_scale;
    let row_multipliers: Vec<f64> = (0..m).map(|i| run.point.y[i] * form.row_scale[i] / f).collect();
    let slack_multipliers = |z: &[f64]| -> Vec<f64> {
        let of = |i: usize| match form.rows[i] {
            RowForm::Inequality(k) => z[n + k] * form.row_scale[i] / f,
            _ => 0.0,
        };
        (0..m).map(of).collect()
    };
    let (slack_lower_multipliers, slack_upper_multipliers) =
        (slack_multipliers(&run.point.zl), slack_multipliers(&run.point.zu));
    let mut lower_multipliers: Vec<f64> = run.point.zl[..n].iter().map(|z| z / f).collect();
    let mut upper_multipliers: Vec<f64> = run.point.zu[..n].iter().map(|z| z / f).collect();

    // Evaluated again in the units of the problem.
    let program = form.program;
    let objective = program.objective(&x);
    let mut lagrangian = vec![0.0; n];
    program.gradient(&x, &mut lagrangian);
    let mut jacobian = vec![0.0; program.jacobian_pattern().row_indices.len()];
    program.jacobian(&x, &mut jacobian);
    for (q, i, j) in entries(program.jacobian_pattern()) {
        lagrangian[j] += jacobian[q] * row_multipliers[i];
    }
    for j in 0..n {
        if form.fixed[j].is_some() {
            // The multiplier of a fixed variable balances its gradient.
            lower_multipliers[j] = lagrangian[j].max(0.0);
            upper_multipliers[j] = (-lagrangian[j]).max(0.0);
        }
        lagrangian[j] += upper_multipliers[j] - lower_multipliers[j];
    }
    let mut g = vec![0.0; m];
    program.constraints(&x, &mut g);
    let (mut lower, mut upper) = (vec![0.0; n], vec![0.0; n]);
    program.variable_bounds(&mut lower, &mut upper);
    let (mut row_lower, mut row_upper) = (vec![0.0; m], vec![0.0; m]);
    program.row_bounds(&mut row_lower, &mut row_upper);
    let slacks = run.row_slacks();
    let mut residuals = Residuals::default();
    let outside = |v: f64, l: f64, u: f64| (l - v).max(v - u).max(0.0);
    let product = |distance: f64, z: f64| if distance.is_finite() { (distance * z).abs() } else { 0.0 };
    for j in 0..n {
        residuals.violation = residuals.violation.max(outside(x[j], lower[j], upper[j]));
        residuals.dual_infeasibility = residuals.dual_infeasibility.max(lagrangian[j].abs());
        residuals.complementarity = residuals
            .complementarity
            .max(product(x[j] - lower[j], lower_multipliers[j]))
            .max(product(upper[j] - x[j], upper_multipliers[j]));
    }
    for i in 0..m {
        residuals.violation = residuals.violation.max(outside(g[i], row_lower[i], row_upper[i]));
        if let RowForm::Inequality(_) = form.rows[i] {
            let balance = -row_multipliers[i] - slack_lower_multipliers[i] + slack_upper_multipliers[i];
            residuals.dual_infeasibility = residuals.dual_infeasibility.max(balance.abs());
            residuals.complementarity = residuals
                .complementarity
                .max(product(slacks[i] - row_lower[i], slack_lower_multipliers[i]))
                .max(product(row_upper[i] - slacks[i], slack_upper_multipliers[i]));
        }
    }
    let mut counts = session.counts;
    counts.factorisations = session.newton.tally.factorisations;
    counts.backsolves = session.newton.tally.backsolves;
    counts.constraint_evaluations = form.tally.constraints;
    counts.factor_entries = session.newton.factor_entries();
    counts.solver_fallbacks = session.newton.solver_fallbacks();
    NlpResult {
        status: match ending {
            IterationEnd::Converged => NlpStatus::Converged,
            IterationEnd::Infeasible => NlpStatus::Infeasible,
            IterationEnd::Stalled | IterationEnd::Left => NlpStatus::Stalled,
            IterationEnd::Unbounded => NlpStatus::Unbounded,
            IterationEnd::IterationLimit => NlpStatus::IterationLimit,
            IterationEnd::TimeLimit => NlpStatus::TimeLimit,
            IterationEnd::Cancelled => NlpStatus::Cancelled,
        },
        x,
        row_multipliers,
        lower_multipliers,
        upper_multipliers,
        slacks,
        slack_lower_multipliers,
        slack_upper_multipliers,
        objective,
        residuals,
        scaled_residuals,
        mu: run.mu,
        iterations: session.iterations,
        counts,
        timing: Timing {
            evaluation: form.tally.seconds,
            analysis,
            factorisation: session.newton.tally.factor_seconds,
            backsolves: session.newton.tally.solve_seconds,
            total: session.started.elapsed().as_secs_f64(),
        },
    }
}
