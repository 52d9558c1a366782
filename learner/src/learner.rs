//! The learner: the posterior given a log, and a cache for calls with the same feedback.

use std::collections::HashSet;
use std::sync::Arc;

use crate::action::ActionIndex;
use crate::error::Result;
use crate::feedback::{Feedback, FeedbackLog};
use crate::fit::{LastFit, ProcessModel};
use crate::gaussian_process::GaussianProcess;
use crate::inference::{Approximate, ExpectationPropagation, Laplace};
use crate::kernel::Kernel;
use crate::likelihood::Interval;
use crate::observations::Observation;
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

/// The observations in the feedback: those of the utility, and with separate labels those of feasibility.
fn observations(
    log: &FeedbackLog,
    settings: &LearnerSettings,
    infeasible: &HashSet<ActionIndex>,
) -> [Vec<Observation>; 2] {
    let above = |noise| Interval { low: 0.0, high: f64::INFINITY, noise };
    let mut split = [Vec::new(), Vec::new()];
    for &feedback in &log.feedback {
        let (plus, minus) = feedback.actions();
        let interval = match feedback {
            Feedback::Label { category, .. } if settings.labels == Labels::Separate => {
                split[1].push(Observation { plus, minus, interval: settings.feasibility_interval(category) });
                let grade = settings.grade_interval(category);
                split[0].extend(grade.map(|interval| Observation { plus, minus, interval }));
                continue;
            }
            Feedback::Label { category, .. } => settings.label_interval(category),
            Feedback::Preference { .. } => above(settings.preference_noise),
            Feedback::Suggestion { .. } => above(settings.coactive_noise),
            Feedback::NoDifference { .. } => Interval {
                low: -settings.no_difference_width,
                high: settings.no_difference_width,
                noise: settings.no_difference_noise,
            },
        };
        let decided = settings.labels == Labels::Separate
            && minus.is_some_and(|minus| infeasible.contains(&plus) != infeasible.contains(&minus));
        if !decided {
            split[0].push(Observation { plus, minus, interval });
        }
    }
    split
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
