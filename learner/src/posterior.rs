//! The posterior over the utility: predictions, the best action, and joint samples.

use std::cmp::Ordering;
use std::collections::HashSet;

use crate::action::ActionIndex;
use crate::error::{LearnerError, Result};
use crate::feedback::Feedback;
use crate::gaussian_process::GaussianProcess;
use crate::linalg::Cholesky;
use crate::random::Random;
use crate::search_space::{Dimension, SearchSpace};
use crate::settings::LearnerSettings;
use crate::special_functions;

pub(crate) mod agreement;
pub(crate) mod convergence_probability;
pub(crate) mod main_effects;
pub(crate) mod marginals;
pub(crate) mod preference_probability;
#[cfg(test)]
mod tests;

/// Mean and standard deviation of the utility of an action, both in units of utility.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Prediction {
    /// Posterior mean.
    pub mean: f64,
    /// Posterior standard deviation.
    pub standard_deviation: f64,
}

impl Prediction {
    /// Probability that the value is above 0.
    pub fn probability_above_zero(&self) -> f64 {
        if self.standard_deviation > 0.0 {
            return special_functions::normal_cdf(self.mean / self.standard_deviation);
        }
        match self.mean.total_cmp(&0.0) {
            Ordering::Less => 0.0,
            Ordering::Equal => 0.5,
            Ordering::Greater => 1.0,
        }
    }
}

/// The posterior over the utility of all actions, given a log.
#[derive(Debug, Clone)]
pub struct Posterior {
    pub(crate) space: SearchSpace,
    pub(crate) settings: LearnerSettings,
    pub(crate) visited: Vec<ActionIndex>,
    pub(crate) feedback: Vec<Feedback>,
    pub(crate) utility: GaussianProcess,
    /// The process that separate labels are about.
    pub(crate) feasibility: Option<GaussianProcess>,
    /// Actions whose last label is the lowest category.
    pub(crate) infeasible: HashSet<ActionIndex>,
}

impl Posterior {
    /// The search space.
    pub fn space(&self) -> &SearchSpace {
        &self.space
    }

    /// The settings of the posterior.
    pub fn settings(&self) -> &LearnerSettings {
        &self.settings
    }

    /// Visited actions, in order.
    pub fn visited(&self) -> &[ActionIndex] {
        &self.visited
    }

    /// Posterior mean of the utility of an action.
    ///
    /// # Errors
    /// If the action is not in the space.
    pub fn mean(&self, action: ActionIndex) -> Result<f64> {
        self.space.check(action)?;
        Ok(self.utility.mean(action, &self.space.levels(action)))
    }

    /// Posterior mean and standard deviation of the utility of an action.
    ///
    /// # Errors
    /// If the action is not in the space.
    pub fn predict(&self, action: ActionIndex) -> Result<Prediction> {
        self.space.check(action)?;
        let view = self.utility.view(action, self.space.levels(action));
        Ok(Prediction { mean: view.mean, standard_deviation: self.utility.variance(&view).sqrt() })
    }

    /// How much higher the utility of `a` is than that of `b`.
    ///
    /// # Errors
    /// If an action is not in the space.
    pub fn difference(&self, a: ActionIndex, b: ActionIndex) -> Result<Prediction> {
        self.space.check(a)?;
        self.space.check(b)?;
        let view = |action| self.utility.view(action, self.space.levels(action));
        let (mean, variance) = self.utility.difference(&view(a), &view(b));
        Ok(Prediction { mean, standard_deviation: variance.sqrt() })
    }

    /// The recommended action: the visited one with the highest posterior mean, the earliest of several.
    ///
    /// With separate labels, infeasible actions rank last. `None` if no action has been visited.
    pub fn best(&self) -> Option<ActionIndex> {
        self.best_of(|_| true)
    }

    /// [`Self::best`] among the visited actions that satisfy a condition.
    pub(crate) fn best_of(&self, among: impl Fn(ActionIndex) -> bool) -> Option<ActionIndex> {
        let separate = self.feasibility.is_some();
        let mut best: Option<(ActionIndex, (bool, f64))> = None;
        for &action in self.visited.iter().filter(|action| among(**action)) {
            let feasible = !(separate && self.infeasible.contains(&action));
            let rank = (feasible, self.utility.mean(action, &self.space.levels(action)));
            if best.is_none_or(|(_, highest)| rank > highest) {
                best = Some((action, rank));
            }
        }
        best.map(|(action, _)| action)
    }

    /// With separate labels, the feasible one of a feasible and an infeasible action: labels decide this comparison.
    pub(crate) fn decided_by_labels(&self, a: ActionIndex, b: ActionIndex) -> Option<ActionIndex> {
        let fails = |action| self.infeasible.contains(&action);
        let decided = self.feasibility.is_some() && fails(a) != fails(b);
        decided.then(|| if fails(a) { b } else { a })
    }

    /// Feedback, in order.
    pub(crate) fn feedback(&self) -> &[Feedback] {
        &self.feedback
    }

    /// The dimension with this index, counted from 0.
    pub(crate) fn dimension(&self, dimension: usize) -> Result<&Dimension> {
        self.space
            .dimensions()
            .get(dimension)
            .ok_or_else(|| LearnerError::UnknownDimension { dimension, dimensions: self.space.dimensions().len() })
    }

    /// A sampler of the joint posterior of distinct actions.
    pub(crate) fn sampler(&self, actions: &[ActionIndex]) -> Result<Sampler> {
        let process = &self.utility;
        let views: Vec<_> = actions.iter().map(|&a| process.view(a, self.space.levels(a))).collect();
        let factor = Cholesky::new(&process.joint_covariance(&views))?;
        Ok(Sampler { mean: views.iter().map(|v| v.mean).collect(), factor })
    }
}

/// Samples the joint posterior of some actions.
pub(crate) struct Sampler {
    mean: Vec<f64>,
    factor: Cholesky,
}

impl Sampler {
    /// One utility for each action.
    pub(crate) fn sample(&self, random: &mut Random) -> Vec<f64> {
        let noise: Vec<f64> = self.mean.iter().map(|_| random.normal()).collect();
        self.factor.multiply(&noise).iter().zip(&self.mean).map(|(spread, mean)| mean + spread).collect()
    }
}
