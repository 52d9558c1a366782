//! The restoration phase: minimise rho |c(w)|_1 + zeta/2 |D (x - x_R)|^2 within the bounds, with elastic variables
//! c(w) - p + n = 0, p, n >= 0 (WB06 section 3.3). As p and n are row variables, the KKT pattern stays the same.
//!
//! The solve returns to the problem when the violation is reduced enough and the filter accepts the point.
//! Convergence to a point with a violation above tolerance means local infeasibility; any other ending is
//! inconclusive.

use crate::barrier;
use crate::formulation::{EvaluationTally, Formulation, Objective, RowForm, RowVariable};
use crate::fraction_to_boundary;
use crate::iterate::{Iterate, IterationEnd, SolveSession};
use crate::primal_dual::{PrimalDual, largest};
use crate::settings::{BoundMultiplierStart, NlpSettings};

/// Up to a hundred times the tolerance a violation can be a remainder of the termination of the phase itself, so the
/// point counts as feasible. Larger tolerances than this do not extend that range.
const NEAR_TOLERANCE: f64 = 1e-4;

/// A phase that converges without progress means infeasibility if the violation exceeds its tolerance by this factor.
const LEFT_OVER: f64 = 10.0;

/// Elastic variables (p, n) that minimise rho (p + n) - mu (ln p + ln n) subject to c = p - n (WB06 eqs. 32, 33).
fn best_elastics(c: f64, mu: f64, rho: f64) -> (f64, f64) {
    // The smaller one is computed without cancellation.
    let half = (mu - rho * c.abs()) / (2.0 * rho);
    let root = (half * half + mu * c.abs() / (2.0 * rho)).sqrt();
    let small = if half >= 0.0 { half + root } else { mu * c.abs() / (2.0 * rho) / (root - half) };
    if c >= 0.0 { (c + small, small) } else { (small, small - c) }
}

fn elastic_formulation<'p>(base: &Formulation<'p>, w: &[f64], mu: f64, rho: f64) -> Formulation<'p> {
    let mut form = base.clone();
    form.tally = EvaluationTally::default();
    // The elastic objective is not scaled, so neither are the multipliers and tolerances of the phase.
    form.objective_scale = 1.0;
    let first = form.row_variables.len();
    for i in 0..form.m {
        if form.rows[i] != RowForm::Free {
            for sign in [-1.0, 1.0] {
                form.row_variables.push(RowVariable { row: i, sign });
                form.lower.push(0.0);
                form.upper.push(f64::INFINITY);
            }
        }
    }
    let reference = w[..form.n].to_vec();
    let weight = reference.iter().map(|x| 1.0 / x.abs().max(1.0)).collect();
    form.objective = Objective::Restoration { first, rho, zeta: mu.sqrt(), reference, weight };
    form
}

/// Adds the current point to the filter and builds the first iterate of the restoration phase; `None` where it cannot
/// be evaluated.
pub(crate) fn begin<'p>(run: &mut Iterate<'p>, session: &mut SolveSession) -> Option<Iterate<'p>> {
    let settings = session.settings;
    session.counts.restoration_phases += 1;
    let (theta, phi) = (run.theta(), run.phi());
    run.filter.add(theta, phi);

    let rho = settings.constants.elastic_weight;
    let mu = run.mu.max(largest(&run.c));
    let form = elastic_formulation(&run.form, &run.point.w, mu, rho);
    let length = run.form.length();
    let mut point = PrimalDual::zeros(&form);
    point.w[..length].copy_from_slice(&run.point.w);
    for j in 0..length {
        point.zl[j] = run.point.zl[j].min(rho);
        point.zu[j] = run.point.zu[j].min(rho);
    }
    for (k, a) in form.row_variables.iter().enumerate().skip(length - form.n) {
        let (p, q) = best_elastics(run.c[a.row], mu, rho);
        let t = if a.sign < 0.0 { p } else { q };
        point.w[form.n + k] = t;
        point.zl[form.n + k] = mu / t;
    }
    let mut phase = Iterate::new(form, point, mu);
    phase.evaluate();
    if !phase.is_finite() {
        return None;
    }
    phase.begin_filter();
    phase.estimate_multipliers(session);
    Some(phase)
}

/// The test that ends the restoration phase: the violation is reduced from `theta` by the required factor, and the
/// filter of the problem accepts the point.
pub(crate) fn may_leave(run: &mut Iterate, settings: &NlpSettings, theta: f64) -> impl FnMut(&[f64]) -> bool {
    let length = run.form.length();
    let mut c = vec![0.0; run.form.m];
    let (form, filter, mu) = (&mut run.form, &run.filter, run.mu);
    move |w: &[f64]| {
        let w = &w[..length];
        form.constraints(w, &mut c);
        let now: f64 = c.iter().map(|v| v.abs()).sum();
        if now > settings.required_reduction * theta {
            return false;
        }
        let phi = form.objective(w) + barrier::barrier_term(form, w, mu);
        filter.accepts(now, phi)
    }
}

/// Returns from the restoration phase to the problem. `None` if the solve continues from the point of the phase;
/// otherwise the ending of the solve at that point.
pub(crate) fn finish(
    run: &mut Iterate,
    session: &mut SolveSession,
    phase: &Iterate,
    ending: IterationEnd,
) -> Option<IterationEnd> {
    let settings = session.settings;
    let length = run.form.length();
    run.form.tally.seconds += phase.form.tally.seconds;
    run.form.tally.constraints += phase.form.tally.constraints;
    session.newton.fit(&run.form);

    let old = std::mem::take(&mut run.point.w);
    run.point.w = phase.point.w[..length].to_vec();
    // The phase may have moved bounds whose slack was lost to rounding.
    run.form.lower.copy_from_slice(&phase.form.lower[..length]);
    run.form.upper.copy_from_slice(&phase.form.upper[..length]);
    let slack_lower = run.at.slack_lower.clone();
    let slack_upper = run.at.slack_upper.clone();
    run.evaluate();
    if !run.is_finite() {
        return Some(IterationEnd::Stalled);
    }

    let near = 100.0 * settings.tolerance.min(NEAR_TOLERANCE);
    let feasible = run.program_violation() <= settings.violation_tolerance.max(near);
    match ending {
        IterationEnd::Left => {}
        IterationEnd::Converged if !feasible || run.program_violation() > LEFT_OVER * settings.violation_tolerance => {
            // The multipliers of the phase belong to an objective without scale.
            for (y, of_phase) in run.point.y.iter_mut().zip(&phase.point.y) {
                *y = of_phase * run.form.objective_scale;
            }
            return Some(IterationEnd::Infeasible);
        }
        IterationEnd::Converged => return Some(IterationEnd::Stalled),
        other => return Some(other),
    }

    // Bound multipliers: the Newton step that belongs to w_new - w_old.
    let mut step = PrimalDual::zeros(&run.form);
    for j in 0..length {
        let d = run.point.w[j] - old[j];
        if slack_lower[j].is_finite() {
            step.zl[j] = (run.mu - run.point.zl[j] * d) / slack_lower[j] - run.point.zl[j];
        }
        if slack_upper[j].is_finite() {
            step.zu[j] = (run.mu + run.point.zu[j] * d) / slack_upper[j] - run.point.zu[j];
        }
    }
    let tau = fraction_to_boundary::boundary_fraction(settings, run.mu);
    let alpha = fraction_to_boundary::of_multipliers(&run.point.zl, &step.zl, tau)
        .min(fraction_to_boundary::of_multipliers(&run.point.zu, &step.zu, tau));
    let alpha = if settings.constants.steps_multipliers { alpha } else { 0.0 };
    for j in 0..length {
        run.point.zl[j] += alpha * step.zl[j];
        run.point.zu[j] += alpha * step.zu[j];
    }
    if largest(&run.point.zl).max(largest(&run.point.zu)) > settings.constants.multiplier_reset {
        let mu = run.mu;
        let first = |slack: f64| match (slack.is_finite(), settings.bound_multiplier_start) {
            (false, _) => 0.0,
            (true, BoundMultiplierStart::One) => 1.0,
            (true, BoundMultiplierStart::Centred) => mu / slack,
        };
        for j in 0..length {
            run.point.zl[j] = first(run.at.slack_lower[j]);
            run.point.zu[j] = first(run.at.slack_upper[j]);
        }
    }
    barrier::keep_near_centre(&mut run.point, &run.at, run.mu, settings.constants.kappa_sigma);
    run.estimate_multipliers(session);
    None
}

#[cfg(test)]
mod tests {
    use super::best_elastics;

    #[test]
    fn best_elastics_satisfy_their_row_and_optimality_condition() {
        for c in [-3.0, -1e-9, 0.0, 1e-12, 0.5, 2e4] {
            for mu in [1e-9, 1e-3, 10.0] {
                let rho = 1000.0;
                let (p, n) = best_elastics(c, mu, rho);
                assert!(p > 0.0 && n > 0.0);
                assert!((p - n - c).abs() <= 1e-12 * (1.0 + p), "{c} {mu}: {p} {n}");
                let slope = 2.0 * rho - mu / p - mu / n;
                assert!(slope.abs() <= 1e-6 * (2.0 * rho + mu / p + mu / n), "{c} {mu}: {slope}");
            }
        }
    }
}
