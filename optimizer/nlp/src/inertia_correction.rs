//! Inertia correction: regularisation until the KKT matrix has the inertia (n, m, 0) (WB06 algorithm IC). Rows
//! are always regularised, so that redundant rows need no second factorisation.

use crate::settings::NlpSettings;

/// The last nonzero delta_w, and the current regularisation.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct InertiaCorrection {
    last: f64,
    /// Weight of the proximal term: the first delta_w of an iteration while the line search shortens steps.
    proximal: f64,
    /// Number of consecutive iterations whose unregularised matrix had the wrong inertia.
    refusals: usize,
    /// Number of following iterations that start with a decreasing regularisation.
    skip: usize,
    /// The current iteration started without regularisation.
    bare: bool,
    /// Current delta_w.
    pub delta_w: f64,
    /// Current delta_c.
    pub delta_c: f64,
}

impl InertiaCorrection {
    /// The first regularisation of an iteration.
    pub(crate) fn begin(&mut self, settings: &NlpSettings, mu: f64) {
        self.delta_w = self.proximal;
        if self.skip > 0 {
            self.skip -= 1;
            let fading = (self.last * DECREASE).max(settings.constants.hessian_regularisation_min);
            self.delta_w = self.delta_w.max(fading);
        }
        self.bare = self.delta_w == 0.0;
        self.delta_c = settings.constants.dual_regularisation_value * mu.powf(0.25);
    }

    /// Adapts the proximal term to the line search: after a step that was shortened often, a proximal term shortens
    /// the next directions; it decreases once full steps are accepted. It changes the matrix only, so it does not
    /// move solutions.
    pub(crate) fn observe(&mut self, settings: &NlpSettings, trials: usize) {
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

    /// Records that the matrix was accepted.
    pub(crate) fn accept(&mut self, settings: &NlpSettings) {
        if self.delta_w > 0.0 {
            self.last = self.delta_w;
        }
        if self.bare {
            self.refusals = if self.delta_w > 0.0 { self.refusals + 1 } else { 0 };
            self.skip = self.refusals.saturating_sub(1).min(settings.regularisation_memory);
        }
    }

    /// The next regularisation after a wrong inertia, a singular matrix or an inaccurate solution; false when out of
    /// range.
    pub(crate) fn increase(&mut self, settings: &NlpSettings) -> bool {
        self.delta_w = if self.delta_w == 0.0 {
            if self.last == 0.0 {
                settings.hessian_regularisation_first
            } else {
                (self.last * DECREASE).max(settings.constants.hessian_regularisation_min)
            }
        } else if self.last == 0.0 || 1e5 * self.last < self.delta_w {
            self.delta_w * FIRST_INCREASE
        } else {
            self.delta_w * INCREASE
        };
        self.delta_w <= settings.constants.hessian_regularisation_max
    }
}

/// WB06 kappa_w^-.
const DECREASE: f64 = 1.0 / 3.0;
/// WB06 kappa_w^+.
const INCREASE: f64 = 8.0;
/// WB06 kappa_w^+ bar, before the first correction.
const FIRST_INCREASE: f64 = 100.0;
/// Number of line-search trials from which on the proximal term increases.
const PROXIMAL_TRIGGER: usize = 5;
/// Decrease of the proximal term after a step that was shortened at most once.
const PROXIMAL_DECREASE: f64 = 0.125;
/// The term is dropped below this fraction of `proximal_first`.
const PROXIMAL_VANISHES: f64 = 1e-3;
/// Largest proximal weight.
const PROXIMAL_MAX: f64 = 1e2;
