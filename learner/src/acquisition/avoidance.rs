//! The region of avoidance of ROIAL: actions that are too likely to be labelled with the lowest category.
//!
//! An action is avoided while its mean, plus a number of standard deviations (negative: minus), does not reach the
//! lowest threshold of the labels. The mean is that of the function that labels are about: the utility, or
//! feasibility where labels are separate.

use crate::belief::Belief;
use crate::posterior::Posterior;
use crate::space::{ActionIndex, SearchSpace};

/// What an action must reach to be proposed.
pub(crate) struct Avoidance<'a> {
    space: &'a SearchSpace,
    belief: &'a Belief,
    deviations: f64,
    threshold: f64,
}

impl<'a> Avoidance<'a> {
    /// None when the settings avoid nothing.
    pub(crate) fn of(belief: &'a Posterior) -> Option<Self> {
        let settings = belief.settings();
        Some(Self {
            space: belief.space(),
            belief: belief.feasibility.as_ref().unwrap_or(&belief.utility),
            deviations: settings.avoidance?,
            threshold: *settings.ordinal_thresholds.first()?,
        })
    }

    /// Whether an action lies outside the region.
    pub(crate) fn allows(&self, action: ActionIndex) -> bool {
        let view = self.belief.view(action, self.space.levels(action));
        view.mean + self.deviations * self.belief.variance(&view).sqrt() > self.threshold
    }

    /// Whether an action with this mean certainly lies inside.
    pub(crate) fn rules_out(&self, mean: f64) -> bool {
        self.deviations <= 0.0 && mean <= self.threshold
    }
}
