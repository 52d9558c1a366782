//! The probability that one action is preferred to another.

use crate::action::ActionIndex;
use crate::error::Result;
use crate::interval_likelihood::Interval;
use crate::posterior::Posterior;

impl Posterior {
    /// Probability that `a` is preferred to `b` in a comparison.
    ///
    /// With separate labels, if any was given, an action that converges is preferred to one that does not. The utility
    /// decides between two that converge, a fair coin between two that do not. The two convergences count as
    /// independent.
    ///
    /// # Errors
    /// If an action is not in the space.
    pub fn preference_probability(&self, a: ActionIndex, b: ActionIndex) -> Result<f64> {
        self.space().check(a)?;
        self.space().check(b)?;
        if a == b {
            return Ok(0.5);
        }
        let view = |action| self.utility.view(action, self.space().levels(action));
        let (mean, variance) = self.utility.difference(&view(a), &view(b));
        let better = Interval { low: 0.0, high: f64::INFINITY, noise: self.settings.preference_noise };
        let by_utility = self.probability(better, mean, variance);
        let labelled = self.feasibility.as_ref().is_some_and(|process| !process.observed().sites.is_empty());
        if !labelled {
            return Ok(by_utility);
        }
        let (of_a, of_b) = (self.probability_of_converging(a)?, self.probability_of_converging(b)?);
        Ok(of_a * (1.0 - of_b) + of_a * of_b * by_utility + 0.5 * (1.0 - of_a) * (1.0 - of_b))
    }
}
