//! The probability that an action converges, and those of its other labels.

use crate::action::ActionIndex;
use crate::error::Result;
use crate::gaussian_process::GaussianProcess;
use crate::interval_likelihood::{Interval, Link};
use crate::posterior::Posterior;
use crate::special_functions;

impl Posterior {
    /// Probability that a noisy functional with the given moments is in an interval.
    pub(super) fn probability(&self, mut interval: Interval, mean: f64, variance: f64) -> f64 {
        // A normal distribution of 1.702 times the scale approximates the logistic one to 0.0095.
        let noise = match self.settings().link {
            Link::Probit => interval.noise,
            Link::Logistic => 1.702 * interval.noise,
        };
        interval.noise = (noise * noise + variance).sqrt();
        special_functions::exp(interval.log_likelihood(Link::Probit, mean).value).min(1.0)
    }

    /// Probability of each category as the label of an action, from category 0.
    ///
    /// # Errors
    /// If the action is not in the space.
    pub fn category_probabilities(&self, action: ActionIndex) -> Result<Vec<f64>> {
        self.space().check(action)?;
        let settings = self.settings();
        let moments = |process: &GaussianProcess| {
            let view = process.view(action, self.space().levels(action));
            (view.mean, process.variance(&view))
        };
        let (mean, variance) = moments(&self.utility);
        let Some(feasibility) = &self.feasibility else {
            let of = |category| self.probability(settings.label_interval(category), mean, variance);
            return Ok((0..settings.categories()).map(of).collect());
        };
        let (feasibility_mean, feasibility_variance) = moments(feasibility);
        let of = |category| {
            let interval = settings.feasibility_interval(category);
            let grade = settings.grade_interval(category);
            self.probability(interval, feasibility_mean, feasibility_variance)
                * grade.map_or(1.0, |interval| self.probability(interval, mean, variance))
        };
        Ok((0..settings.categories()).map(of).collect())
    }

    /// Probability that an action converges, that is that its label is not category 0.
    ///
    /// # Errors
    /// If the action is not in the space.
    pub fn probability_of_converging(&self, action: ActionIndex) -> Result<f64> {
        let lowest = self.category_probabilities(action)?.first().copied().unwrap_or(0.0);
        Ok(if self.settings().categories() > 1 { 1.0 - lowest } else { 1.0 })
    }
}
