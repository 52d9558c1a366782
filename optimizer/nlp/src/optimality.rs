//! Optimality error of a point (WB06 eq. 5), scaled for the termination test and unscaled for the report.

use crate::formulation::Formulation;
use crate::primal_dual::{Linearisation, PrimalDual, largest};
use crate::status::Residuals;

/// Average multiplier from which on the error is scaled down (WB06 s_max).
const S_MAX: f64 = 100.0;

/// Residuals of a point, before and after scaling by the size of its multipliers.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct OptimalityError {
    pub violation: f64,
    pub dual: f64,
    /// Largest |z * slack - mu|.
    pub complementarity: f64,
    dual_scale: f64,
    complementarity_scale: f64,
}

impl OptimalityError {
    /// Residuals with target complementarity mu; `lagrangian` is grad F + A^T y - z_L + z_U.
    pub(crate) fn new(
        form: &Formulation,
        point: &PrimalDual,
        at: &Linearisation,
        c: &[f64],
        lagrangian: &[f64],
        mu: f64,
    ) -> Self {
        let mut complementarity = 0.0f64;
        let mut bounds = 0usize;
        for (z, slack) in [(&point.zl, &at.slack_lower), (&point.zu, &at.slack_upper)] {
            for (z, s) in z.iter().zip(slack).filter(|(_, s)| s.is_finite()) {
                complementarity = complementarity.max((z * s - mu).abs());
                bounds += 1;
            }
        }
        let one = |v: &[f64]| v.iter().map(|x| x.abs()).sum::<f64>();
        let (y, z) = (one(&point.y), one(&point.zl) + one(&point.zu));
        let scale = |sum: f64, count: usize| (sum / count.max(1) as f64).max(S_MAX) / S_MAX;
        Self {
            violation: largest(c),
            dual: largest(lagrangian),
            complementarity,
            dual_scale: scale(y + z, form.m + bounds),
            complementarity_scale: scale(z, bounds),
        }
    }

    /// E_mu.
    pub(crate) fn error(&self) -> f64 {
        let scaled = self.scaled();
        scaled.violation.max(scaled.dual_infeasibility).max(scaled.complementarity)
    }

    /// The parts of E_mu.
    pub(crate) fn scaled(&self) -> Residuals {
        Residuals {
            violation: self.violation,
            dual_infeasibility: self.dual / self.dual_scale,
            complementarity: self.complementarity / self.complementarity_scale,
        }
    }
}
