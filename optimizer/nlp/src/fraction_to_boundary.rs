//! The fraction-to-the-boundary rule: a step keeps a share of the distance of every variable and multiplier to its bound.

use crate::settings::NlpSettings;

/// tau = max(tau_min, 1 - mu) (WB06 eq. 8).
pub(crate) fn boundary_fraction(settings: &NlpSettings, mu: f64) -> f64 {
    settings.constants.tau_min.max(1.0 - mu)
}

/// The largest alpha in (0, 1] for which w + alpha d keeps (1 - tau) of every slack (WB06 eq. 15).
pub(crate) fn of_slacks(slack_lower: &[f64], slack_upper: &[f64], d: &[f64], tau: f64) -> f64 {
    let mut alpha = 1.0f64;
    for j in 0..d.len() {
        if d[j] < 0.0 && slack_lower[j].is_finite() {
            alpha = alpha.min(-tau * slack_lower[j] / d[j]);
        } else if d[j] > 0.0 && slack_upper[j].is_finite() {
            alpha = alpha.min(tau * slack_upper[j] / d[j]);
        }
    }
    alpha
}

/// The same rule for multipliers z >= 0.
pub(crate) fn of_multipliers(z: &[f64], d: &[f64], tau: f64) -> f64 {
    z.iter().zip(d).fold(1.0, |alpha, (z, d)| if *d < 0.0 && *z > 0.0 { alpha.min(-tau * z / d) } else { alpha })
}
