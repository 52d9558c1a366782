//! The belief about the utility after a log, and the questions it answers.

use std::collections::HashSet;
use std::sync::Arc;

use crate::belief::{Answer, Belief, Chain, Process, evidence};
use crate::error::{LearnerError, Result};
use crate::feedback::{Feedback, FeedbackLog};
use crate::hyperparameters::Hyperparameters;
use crate::inference::{Approximate, ExpectationPropagation, Laplace};
use crate::kernel::{Kernel, KernelShape};
use crate::likelihood::Interval;
use crate::linalg::Cholesky;
use crate::random::Random;
use crate::settings::{Inference, Labels, LearnerSettings};
use crate::space::{ActionIndex, Dimension, SearchSpace};

/// Mean and standard deviation of the utility of an action.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Prediction {
    /// Posterior mean.
    pub mean: f64,
    /// Posterior standard deviation.
    pub standard_deviation: f64,
}

/// A normal belief about the utility of every action.
#[derive(Debug, Clone)]
pub struct Posterior {
    space: SearchSpace,
    settings: LearnerSettings,
    /// The setting, or what was learned in its place.
    pub(crate) preference_noise: f64,
    visited: Vec<ActionIndex>,
    feedback: Vec<Feedback>,
    pub(crate) utility: Belief,
    /// Present when labels are about a function of their own.
    pub(crate) feasibility: Option<Belief>,
    /// Actions whose last label is the lowest category.
    pub(crate) infeasible: HashSet<ActionIndex>,
}

/// Remembers the last posterior of a study, so that the next one costs an update instead of a new start.
///
/// It never changes a result: every call gives bit for bit what [`posterior`] gives.
#[derive(Debug, Clone, Default)]
pub struct Learner {
    of: Option<(SearchSpace, LearnerSettings)>,
    utility: Chain,
    feasibility: Chain,
    /// What the chain of the utility was made with.
    used: Option<Hyperparameters>,
    /// Learned from these answers.
    hyperparameters: Option<(Vec<Answer>, Hyperparameters)>,
}

/// The belief about the utility after the log.
///
/// # Errors
/// When a setting is out of range or the log does not fit the space.
pub fn posterior(space: &SearchSpace, log: &FeedbackLog, settings: &LearnerSettings) -> Result<Posterior> {
    Learner::default().posterior(space, log, settings)
}

/// Answers about the utility and, when labels are separate, about feasibility.
fn answers(
    log: &FeedbackLog,
    settings: &LearnerSettings,
    preference_noise: f64,
    infeasible: &HashSet<ActionIndex>,
) -> [Vec<Answer>; 2] {
    let above = |noise| Interval { low: 0.0, high: f64::INFINITY, noise };
    let mut split = [Vec::new(), Vec::new()];
    for &feedback in &log.feedback {
        let (plus, minus) = feedback.actions();
        let interval = match feedback {
            Feedback::Label { category, .. } if settings.labels == Labels::Separate => {
                split[1].push(Answer { plus, minus, interval: settings.feasibility_interval(category) });
                let grade = settings.grade_interval(category);
                split[0].extend(grade.map(|interval| Answer { plus, minus, interval }));
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
            split[0].push(Answer { plus, minus, interval });
        }
    }
    split
}

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
        relevance: vec![1.0; dimensions.len()],
    }
}

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
    /// As [`posterior`].
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
        if !self.of.as_ref().is_some_and(|(s, t)| s == space && t == settings) {
            *self = Self { of: Some((space.clone(), settings.clone())), ..Self::default() };
        }
        let infeasible = log.in_lowest_category(settings.categories());
        let method: &dyn Approximate = match settings.inference {
            Inference::Laplace => &Laplace,
            Inference::ExpectationPropagation => &ExpectationPropagation::default(),
        };
        let learned = self.learned(space, log, settings, method, &infeasible)?;
        if self.used.as_ref() != Some(&learned) {
            self.utility = Chain::default();
            self.used = Some(learned.clone());
        }
        let preference_noise = settings.preference_noise * learned.preference_noise;
        let kernel = Arc::new(Kernel::new(space, &kernel_shape(space, settings, &learned.lengthscales)));
        let process = Process { space, kernel: &kernel, link: settings.link, method };
        let [about_utility, about_feasibility] = answers(log, settings, preference_noise, &infeasible);
        let utility = Belief { kernel: Arc::clone(&kernel), state: self.utility.advance(&process, &about_utility)? };
        let feasibility = match settings.labels {
            Labels::InUtility => None,
            Labels::Separate => {
                let kernel = Arc::new(Kernel::new(space, &feasibility_shape(space, settings)));
                let process = Process { space, kernel: &kernel, link: settings.link, method };
                let state = self.feasibility.advance(&process, &about_feasibility)?;
                Some(Belief { kernel, state })
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
}

impl Learner {
    /// Factors on lengthscales and noise after the log.
    fn learned(
        &mut self,
        space: &SearchSpace,
        log: &FeedbackLog,
        settings: &LearnerSettings,
        method: &dyn Approximate,
        infeasible: &HashSet<ActionIndex>,
    ) -> Result<Hyperparameters> {
        let tried = settings.learn_every.map_or(0, |every| log.visited.len() / every * every);
        if tried == 0 {
            return Ok(Hyperparameters::neutral(space));
        }
        let known: HashSet<ActionIndex> = log.visited[..tried].iter().copied().collect();
        let about_known = |feedback: &&Feedback| {
            let (first, second) = feedback.actions();
            known.contains(&first) && second.is_none_or(|second| known.contains(&second))
        };
        let feedback = log.feedback.iter().filter(about_known).copied().collect();
        let log = FeedbackLog { visited: log.visited[..tried].to_vec(), feedback };
        let [current, _] = answers(&log, settings, settings.preference_noise, infeasible);
        if let Some((answers, learned)) = &self.hyperparameters
            && *answers == current
        {
            return Ok(learned.clone());
        }
        let learned = Hyperparameters::learn(space, |candidate| {
            let kernel = Kernel::new(space, &kernel_shape(space, settings, &candidate.lengthscales));
            let process = Process { space, kernel: &kernel, link: settings.link, method };
            let noise = settings.preference_noise * candidate.preference_noise;
            let [about_utility, _] = answers(&log, settings, noise, infeasible);
            evidence(&process, &about_utility)
        })?;
        self.hyperparameters = Some((current, learned.clone()));
        Ok(learned)
    }
}

impl Posterior {
    /// The space believed about.
    pub fn space(&self) -> &SearchSpace {
        &self.space
    }

    /// The settings used.
    pub fn settings(&self) -> &LearnerSettings {
        &self.settings
    }

    /// Actions tried, in order.
    pub fn visited(&self) -> &[ActionIndex] {
        &self.visited
    }

    /// Posterior mean of an action.
    ///
    /// # Errors
    /// When the action is not in the space.
    pub fn mean(&self, action: ActionIndex) -> Result<f64> {
        self.space.check(action)?;
        Ok(self.utility.mean(action, &self.space.levels(action)))
    }

    /// Mean and standard deviation of an action.
    ///
    /// # Errors
    /// When the action is not in the space.
    pub fn predict(&self, action: ActionIndex) -> Result<Prediction> {
        self.space.check(action)?;
        let view = self.utility.view(action, self.space.levels(action));
        Ok(Prediction { mean: view.mean, standard_deviation: self.utility.variance(&view).sqrt() })
    }

    /// The recommendation: of the actions tried, the one with the highest mean. Of equals, the earliest.
    ///
    /// When labels are about a function of their own, actions in the lowest category come last.
    pub fn best(&self) -> Option<ActionIndex> {
        self.best_of(|_| true)
    }

    /// The recommendation among some of the actions.
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

    /// Where labels are separate and of two actions only one is in the lowest category: the other one. Its comparison
    /// is decided by the labels, whatever the utility.
    pub(crate) fn decided_by_labels(&self, a: ActionIndex, b: ActionIndex) -> Option<ActionIndex> {
        let fails = |action| self.infeasible.contains(&action);
        let decided = self.feasibility.is_some() && fails(a) != fails(b);
        decided.then(|| if fails(a) { b } else { a })
    }

    /// Answers given, in order.
    pub(crate) fn feedback(&self) -> &[Feedback] {
        &self.feedback
    }

    /// A dimension of the space by its number.
    pub(crate) fn dimension(&self, dimension: usize) -> Result<&Dimension> {
        self.space
            .dimensions()
            .get(dimension)
            .ok_or_else(|| LearnerError::UnknownDimension { dimension, dimensions: self.space.dimensions().len() })
    }

    /// What joint draws of the utilities of a few distinct actions need.
    pub(crate) fn sampler(&self, actions: &[ActionIndex]) -> Result<Sampler> {
        let belief = &self.utility;
        let views: Vec<_> = actions.iter().map(|&a| belief.view(a, self.space.levels(a))).collect();
        let factor = Cholesky::new(&belief.joint_covariance(&views))?;
        Ok(Sampler { mean: views.iter().map(|v| v.mean).collect(), factor })
    }
}

/// Joint draws of the utilities of a few actions.
pub(crate) struct Sampler {
    mean: Vec<f64>,
    factor: Cholesky,
}

impl Sampler {
    pub(crate) fn draw(&self, random: &mut Random) -> Vec<f64> {
        let noise: Vec<f64> = self.mean.iter().map(|_| random.normal()).collect();
        self.factor.multiply(&noise).iter().zip(&self.mean).map(|(spread, mean)| mean + spread).collect()
    }
}
