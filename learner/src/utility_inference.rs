//! The learner: the posterior given a log, and a cache for calls with the same feedback.

use std::sync::Arc;

use crate::error::Result;
use crate::feedback::FeedbackLog;
use crate::fit::{LastFit, ProcessModel};
use crate::gaussian_process::GaussianProcess;
use crate::inference::{Approximate, ExpectationPropagation, Laplace};
use crate::kernel::Kernel;
use crate::observed_feedback::observations;
use crate::posterior::Posterior;
use crate::search_space::SearchSpace;
use crate::settings::{Inference, Labels, LearnerSettings};

/// A cache of the last fit of a study. With it, calls with unchanged feedback cost no new fit.
///
/// The cache never changes a result: each method gives the same bits as the function of the same name.
#[derive(Debug, Clone, Default)]
pub struct Learner {
    cached_for: Option<(SearchSpace, LearnerSettings)>,
    utility: LastFit,
    feasibility: LastFit,
}

/// The posterior over the utility, given a log.
///
/// # Errors
/// If a setting is out of range or the log does not fit the space.
pub fn posterior(space: &SearchSpace, log: &FeedbackLog, settings: &LearnerSettings) -> Result<Posterior> {
    Learner::default().posterior(space, log, settings)
}

/// The prior of utility and feasibility.
pub(crate) fn kernel(space: &SearchSpace, settings: &LearnerSettings) -> Kernel {
    Kernel::new(space, settings.signal_variance, settings.nugget, settings.lengthscale_factor)
}

impl Learner {
    /// [`posterior`] with the cache.
    ///
    /// # Errors
    /// As [`posterior`].
    pub fn posterior(
        &mut self,
        space: &SearchSpace,
        log: &FeedbackLog,
        settings: &LearnerSettings,
    ) -> Result<Posterior> {
        settings.validate()?;
        log.validate(space, settings.categories())?;
        if !self.cached_for.as_ref().is_some_and(|(s, t)| s == space && t == settings) {
            *self = Self { cached_for: Some((space.clone(), settings.clone())), ..Self::default() };
        }
        let infeasible = log.in_lowest_category(settings.categories());
        let method: &dyn Approximate = match settings.inference {
            Inference::Laplace => &Laplace,
            Inference::ExpectationPropagation => &ExpectationPropagation::default(),
        };
        let kernel = Arc::new(kernel(space, settings));
        let model = ProcessModel { space, kernel: &kernel, link: settings.link, method };
        let [of_utility, of_feasibility] = observations(log, settings, &infeasible);
        let fit = self.utility.get_or_fit(&model, of_utility)?;
        let utility = GaussianProcess { kernel: Arc::clone(&kernel), fit };
        let feasibility = match settings.labels {
            Labels::InUtility => None,
            Labels::Separate => {
                let fit = self.feasibility.get_or_fit(&model, of_feasibility)?;
                Some(GaussianProcess { kernel: Arc::clone(&kernel), fit })
            }
        };
        Ok(Posterior {
            space: space.clone(),
            settings: settings.clone(),
            visited: log.visited.clone(),
            feedback: log.feedback.clone(),
            utility,
            feasibility,
            infeasible,
        })
    }
}
