//! Regularisation until the KKT matrix has the inertia (n, m, 0) (WB06 algorithm IC), remembering the last delta_w.

use super::settings::{DualRegularisation, NlpSettings};

/// delta_w of the last iteration that needed one, and the current trial.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct InertiaCorrection {
    last: f64,
    /// Proximal weight: delta_w starts here while steps are cut by the line search.
    proximal: f64,
    /// Iterations in a row whose unregularised matrix was tried and refused.
    refusals: usize,
    /// Iterations still to begin with the fading regularisation.
    skip: usize,
    /// The present iteration began without regularisation.
    bare: bool,
    /// Current delta_w.
    pub delta_w: f64,
    /// Current delta_c.
    pub delta_c: f64,
}

impl InertiaCorrection {
    /// First trial of an iteration.
    pub(super) fn begin(&mut self, settings: &NlpSettings, mu: f64) {
        self.delta_w = self.proximal;
        if self.skip > 0 {
            self.skip -= 1;
            let fading = (self.last * DECREASE).max(settings.hessian_regularisation_min);
            self.delta_w = self.delta_w.max(fading);
        }
        self.bare = self.delta_w == 0.0;
        self.delta_c = match settings.dual_regularisation {
            DualRegularisation::Always => Self::dual(settings, mu),
            DualRegularisation::WhenSingular => 0.0,
        };
    }

    /// Learns from the line search: a direction that had to be cut often was too long for its linear model, so the next
    /// ones are kept shorter by a proximal term, which fades as soon as full steps are accepted. It acts on the
    /// matrix only, so it never moves a solution.
    pub(super) fn observe(&mut self, settings: &NlpSettings, trials: usize) {
        if settings.proximal_first == 0.0 {
            return;
        }
        if trials >= PROXIMAL_TRIGGER {
            self.proximal = (INCREASE * self.delta_w).max(settings.proximal_first).min(PROXIMAL_MAX);
        } else if trials <= 2 {
            self.proximal *= PROXIMAL_DECREASE;
            if self.proximal < PROXIMAL_VANISHES * settings.proximal_first {
                self.proximal = 0.0;
            }
        }
    }

    /// The matrix was accepted.
    pub(super) fn accept(&mut self, settings: &NlpSettings) {
        if self.delta_w > 0.0 {
            self.last = self.delta_w;
        }
        if self.bare {
            self.refusals = if self.delta_w > 0.0 { self.refusals + 1 } else { 0 };
            self.skip = self.refusals.saturating_sub(1).min(settings.regularisation_memory);
        }
    }

    /// Next trial after a singular matrix, or a solution whose residual was too large; false when out of range.
    pub(super) fn singular(&mut self, settings: &NlpSettings, mu: f64) -> bool {
        if self.delta_c == 0.0 {
            self.delta_c = Self::dual(settings, mu);
            return true;
        }
        self.increase(settings)
    }

    /// Next trial after too many negative eigenvalues; false when out of range.
    pub(super) fn increase(&mut self, settings: &NlpSettings) -> bool {
        self.delta_w = if self.delta_w == 0.0 {
            if self.last == 0.0 {
                settings.hessian_regularisation_first
            } else {
                (self.last * DECREASE).max(settings.hessian_regularisation_min)
            }
        } else if self.last == 0.0 || 1e5 * self.last < self.delta_w {
            self.delta_w * FIRST_INCREASE
        } else {
            self.delta_w * INCREASE
        };
        self.delta_w <= settings.hessian_regularisation_max
    }

    fn dual(settings: &NlpSettings, mu: f64) -> f64 {
        settings.dual_regularisation_value * mu.powf(0.25)
    }
}

/// WB06 kappa_w^-.
const DECREASE: f64 = 1.0 / 3.0;
/// WB06 kappa_w^+.
const INCREASE: f64 = 8.0;
/// WB06 kappa_w^+ bar, while nothing is remembered.
const FIRST_INCREASE: f64 = 100.0;
/// Line-search trials that start or strengthen the proximal term.
const PROXIMAL_TRIGGER: usize = 5;
/// Fading of the proximal term after a step cut at most once.
const PROXIMAL_DECREASE: f64 = 0.125;
/// Share of `proximal_first` below which the term is dropped.
const PROXIMAL_VANISHES: f64 = 1e-3;
/// Largest proximal weight.
const PROXIMAL_MAX: f64 = 1e2;
