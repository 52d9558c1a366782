//! The barrier term and the barrier parameter.
//!
//! phi_mu(w) = F(w) - mu sum ln(w - l) - mu sum ln(u - w) + kappa_d mu sum_{one-sided} (distance) (WB06 eqs. 3, 28).

use crate::formulation::Formulation;
use crate::primal_dual::{Linearisation, PrimalDual};
use crate::settings::NlpSettings;

/// phi_mu - F at w; NaN or infinite outside the bounds.
pub(crate) fn barrier_term(form: &Formulation, w: &[f64], mu: f64) -> f64 {
    let mut logs = 0.0;
    let mut damping = 0.0;
    for j in 0..form.length() {
        let (l, u) = (form.lower[j], form.upper[j]);
        if l.is_finite() {
            logs += (w[j] - l).ln();
        }
        if u.is_finite() {
            logs += (u - w[j]).ln();
        }
        let side = form.single_side(j);
        if side > 0.0 {
            damping += w[j] - l;
        } else if side < 0.0 {
            damping += u - w[j];
        }
    }
    mu * (form.constants.damping * damping - logs)
}

/// Smallest barrier parameter that the tolerances require; multipliers are scaled with the objective.
pub(crate) fn smallest_mu(settings: &NlpSettings, objective_scale: f64) -> f64 {
    let complementarity = settings.complementarity_tolerance * objective_scale;
    settings.tolerance.min(complementarity) / (settings.constants.kappa_epsilon + 1.0)
}

/// max(mu_min, min(kappa_mu mu, mu^theta_mu)) (WB06 eq. 7).
pub(crate) fn reduced_mu(settings: &NlpSettings, mu: f64, smallest: f64) -> f64 {
    (settings.constants.kappa_mu * mu).min(mu.powf(settings.constants.theta_mu)).max(smallest)
}

/// LOQO rule (Nocedal & Wright eqs. 19.20, 19.21): mu = 0.1 min(0.05 (1 - xi) / xi, 2)^3 * average, xi = min /
/// average of the products z * slack.
pub(crate) fn loqo_mu(point: &PrimalDual, at: &Linearisation) -> Option<f64> {
    let (mut sum, mut smallest, mut count) = (0.0, f64::INFINITY, 0usize);
    let pairs = point.zl.iter().zip(&at.slack_lower).chain(point.zu.iter().zip(&at.slack_upper));
    for (z, s) in pairs.filter(|(_, s)| s.is_finite()) {
        sum += z * s;
        smallest = smallest.min(z * s);
        count += 1;
    }
    let average = sum / count.max(1) as f64;
    if count == 0 || average <= 0.0 {
        return None;
    }
    let xi = (smallest / average).max(1e-12);
    Some(0.1 * (0.05 * (1.0 - xi) / xi).min(2.0).powi(3) * average)
}

/// Keeps z within a factor kappa_Sigma of mu / slack (WB06 eq. 16).
pub(crate) fn keep_near_centre(point: &mut PrimalDual, at: &Linearisation, mu: f64, kappa_sigma: f64) {
    for (z, slack) in [(&mut point.zl, &at.slack_lower), (&mut point.zu, &at.slack_upper)] {
        for (z, s) in z.iter_mut().zip(slack).filter(|(_, s)| s.is_finite()) {
            *z = z.clamp(mu / (kappa_sigma * s), kappa_sigma * mu / s);
        }
    }
}

/// Average of the products z * slack; `None` without bounds.
pub(crate) fn average_complementarity(point: &PrimalDual, at: &Linearisation) -> Option<f64> {
    let (mut sum, mut count) = (0.0, 0usize);
    let pairs = point.zl.iter().zip(&at.slack_lower).chain(point.zu.iter().zip(&at.slack_upper));
    for (z, s) in pairs.filter(|(_, s)| s.is_finite()) {
        sum += z * s;
        count += 1;
    }
    (count > 0).then(|| sum / count as f64)
}
