//! The region of avoidance of ROIAL (Li et al. 2021): actions that are too likely to get the lowest label.
//!
//! An action is inside the region if `mean + deviations sd` is not above the lowest threshold of the labels. Mean and
//! standard deviation are those of the function that labels are about: the utility, or feasibility with separate
//! labels.

use crate::action::ActionIndex;
use crate::gaussian_process::GaussianProcess;
use crate::posterior::Posterior;
use crate::search_space::SearchSpace;

/// The test for the region of avoidance.
pub(crate) struct Avoidance<'a> {
    space: &'a SearchSpace,
    process: &'a GaussianProcess,
    deviations: f64,
    threshold: f64,
}

impl<'a> Avoidance<'a> {
    /// `None` if the settings have no region of avoidance.
    pub(crate) fn of(posterior: &'a Posterior) -> Option<Self> {
        let settings = posterior.settings();
        Some(Self {
            space: posterior.space(),
            process: posterior.feasibility.as_ref().unwrap_or(&posterior.utility),
            deviations: settings.avoidance?,
            threshold: *settings.ordinal_thresholds.first()?,
        })
    }

    /// Whether an action is outside the region.
    pub(crate) fn allows(&self, action: ActionIndex) -> bool {
        let view = self.process.view(action, self.space.levels(action));
        view.mean + self.deviations * self.process.variance(&view).sqrt() > self.threshold
    }

    /// A cheap sufficient test that an action with this mean is inside the region.
    pub(crate) fn rules_out(&self, mean: f64) -> bool {
        self.deviations <= 0.0 && mean <= self.threshold
    }
}
