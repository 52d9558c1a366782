//! The learner: the posterior given a log, and a cache for calls with the same feedback.

use std::collections::HashSet;
use std::sync::Arc;

use crate::action::ActionIndex;
use crate::error::Result;
use crate::feedback::{Feedback, FeedbackLog};
use crate::fit::{LastFit, ProcessModel, log_evidence};
use crate::gaussian_process::GaussianProcess;
use crate::hyperparameters::Hyperparameters;
use crate::inference::{Approximate, ExpectationPropagation, Laplace};
use crate::kernel::{Kernel, KernelShape};
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
    /// The hyperparameters of the last fit of the utility.
    fitted_with: Option<Hyperparameters>,
    /// The last learned hyperparameters, and the observations that they were learned from.
    learned: Option<(Vec<Observation>, Hyperparameters)>,
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
    preference_noise: f64,
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
            Feedback::Preference { .. } => above(preference_noise),
            Feedback::Suggestion { .. } => above(settings.coactive_noise),
            Feedback::Tie { .. } => {
                Interval { low: -settings.tie_width, high: settings.tie_width, noise: settings.tie_noise }
            }
        };
        let decided = settings.labels == Labels::Separate
            && minus.is_some_and(|minus| infeasible.contains(&plus) != infeasible.contains(&minus));
        if !decided {
            split[0].push(Observation { plus, minus, interval });
        }
    }
    split
}

/// Kernel of the utility; `factors` multiply the lengthscales.
pub(crate) fn kernel_shape(space: &SearchSpace, settings: &LearnerSettings, factors: &[f64]) -> KernelShape {
    let dimensions = space.dimensions();
    KernelShape {
        variance: settings.signal_variance,
        nugget: settings.nugget,
        product: 1.0 - settings.additive_share - settings.pairwise_share,
        additive: settings.additive_share,
        pairwise: settings.pairwise_share,
        lengthscales: dimensions
            .iter()
            .zip(factors)
            .map(|(d, factor)| d.lengthscale * settings.lengthscale_factor * factor)
            .collect(),
        broad_lengthscales: dimensions.iter().map(|d| d.range() * settings.broad_lengthscale).collect(),
    }
}

/// Kernel of feasibility.
fn feasibility_shape(space: &SearchSpace, settings: &LearnerSettings) -> KernelShape {
    let factor = settings.lengthscale_factor * settings.feasibility_lengthscale_factor;
    KernelShape {
        product: 1.0 - settings.feasibility_additive_share,
        additive: settings.feasibility_additive_share,
        pairwise: 0.0,
        lengthscales: space.dimensions().iter().map(|d| d.lengthscale * factor).collect(),
        ..kernel_shape(space, settings, &vec![1.0; space.dimensions().len()])
    }
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
        let learned = self.hyperparameters(space, log, settings, method, &infeasible)?;
        if self.fitted_with.as_ref() != Some(&learned) {
            self.utility = LastFit::default();
            self.fitted_with = Some(learned.clone());
        }
        let preference_noise = settings.preference_noise * learned.preference_noise;
        let kernel = Arc::new(Kernel::new(space, &kernel_shape(space, settings, &learned.lengthscales)));
        let model = ProcessModel { space, kernel: &kernel, link: settings.link, method };
        let [of_utility, of_feasibility] = observations(log, settings, preference_noise, &infeasible);
        let fit = self.utility.get_or_fit(&model, of_utility)?;
        let utility = GaussianProcess { kernel: Arc::clone(&kernel), fit };
        let feasibility = match settings.labels {
            Labels::InUtility => None,
            Labels::Separate => {
                let kernel = Arc::new(Kernel::new(space, &feasibility_shape(space, settings)));
                let model = ProcessModel { space, kernel: &kernel, link: settings.link, method };
                let fit = self.feasibility.get_or_fit(&model, of_feasibility)?;
                Some(GaussianProcess { kernel, fit })
            }
        };
        Ok(Posterior {
            preference_noise,
            space: space.clone(),
            settings: settings.clone(),
            visited: log.visited.clone(),
            feedback: log.feedback.clone(),
            utility,
            feasibility,
            infeasible,
        })
    }

    /// The hyperparameters learned from the log, or neutral ones.
    fn hyperparameters(
        &mut self,
        space: &SearchSpace,
        log: &FeedbackLog,
        settings: &LearnerSettings,
        method: &dyn Approximate,
        infeasible: &HashSet<ActionIndex>,
    ) -> Result<Hyperparameters> {
        let visited = settings.learn_every.map_or(0, |every| log.visited.len() / every * every);
        if visited == 0 {
            return Ok(Hyperparameters::neutral(space));
        }
        let known: HashSet<ActionIndex> = log.visited[..visited].iter().copied().collect();
        let about_known = |feedback: &&Feedback| {
            let (first, second) = feedback.actions();
            known.contains(&first) && second.is_none_or(|second| known.contains(&second))
        };
        let feedback = log.feedback.iter().filter(about_known).copied().collect();
        let log = FeedbackLog { visited: log.visited[..visited].to_vec(), feedback };
        let [current, _] = observations(&log, settings, settings.preference_noise, infeasible);
        if let Some((learned_from, learned)) = &self.learned
            && *learned_from == current
        {
            return Ok(learned.clone());
        }
        let learned = Hyperparameters::learn(space, |candidate| {
            let kernel = Kernel::new(space, &kernel_shape(space, settings, &candidate.lengthscales));
            let model = ProcessModel { space, kernel: &kernel, link: settings.link, method };
            let noise = settings.preference_noise * candidate.preference_noise;
            let [of_utility, _] = observations(&log, settings, noise, infeasible);
            log_evidence(&model, &of_utility)
        })?;
        self.learned = Some((current, learned.clone()));
        Ok(learned)
    }
}
