//! How to learn: the method and the numbers of its model, named as in the literature.

use serde::{Deserialize, Serialize};

use crate::error::{LearnerError, Result};
use crate::likelihood::Interval;

mod written;

use written::WrittenSettings;

/// [`LearnerSettings::line_trials`] for lines throughout: more trials than any study has, and exact in every JSON reader.
pub const EVERY_TRIAL: usize = u32::MAX as usize;

/// How the next action is chosen.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Method {
    /// LineCoSpar: a Thompson draw on a random line through the best action.
    #[serde(rename = "linecospar")]
    LineCoSpar,
    /// The action with the greatest expected utility of the better of itself and the best action so far, over the
    /// whole grid.
    Eubo,
    /// The highest of one joint draw of the utility of all actions.
    Thompson,
    /// The action whose answers would tell most about the utility.
    InformationGain,
    /// A uniformly random action that was not visited.
    Random,
}

/// How the posterior is approximated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Inference {
    /// A normal distribution at the posterior's mode.
    Laplace,
    /// Expectation propagation. Needs the probit link.
    ExpectationPropagation,
}

/// The function that turns a difference of utilities, divided by its noise, into a probability.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Link {
    /// `1 / (1 + exp(-z))`.
    Logistic,
    /// The normal distribution function.
    Probit,
}

/// Where labels enter.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Labels {
    /// Labels are about the utility itself, as in the literature.
    InUtility,
    /// Whether a label is the lowest category is about a second function of the action; the grades above it, where
    /// there are several, are about the utility. A comparison that the labels alone decide (one action in the lowest
    /// category, the other not) says nothing more about the utility.
    Separate,
}

/// What is tried first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Start {
    /// A uniformly random action.
    Random,
    /// The middle level of every dimension.
    Centre,
}

/// Which earlier actions a new one is compared with.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Partner {
    /// As published: the others of the same batch, and of those before it the last ones tried, as many as the buffer
    /// holds: what a person on the device remembers.
    Previous,
    /// The best one so far.
    Incumbent,
    /// Every one: free where the answer is computed.
    Every,
}

/// Everything that decides how a log is read and what is proposed next.
///
/// The default is LineCoSpar with the numbers of POLAR (Tucker, Li and others), the toolbox of LineCoSpar's authors,
/// except that it never repeats an action and compares each with the best so far.
///
/// In a document every field is optional: one that names a method has [`LearnerSettings::of`] that method in what it
/// leaves out.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(from = "WrittenSettings")]
pub struct LearnerSettings {
    /// How the next action is chosen.
    pub method: Method,
    /// How the posterior is approximated.
    pub inference: Inference,
    /// Shape of the answer noise.
    pub link: Link,
    /// Prior variance of the utility.
    pub signal_variance: f64,
    /// Variance added on the diagonal of the prior covariance of visited actions (the literature's "GP noise").
    pub nugget: f64,
    /// Multiplies every dimension's lengthscale.
    pub lengthscale_factor: f64,
    /// Share of the prior variance given to functions of one quantity each.
    pub additive_share: f64,
    /// Share of the prior variance given to functions of two quantities each. What is left of 1 goes to the
    /// literature's product kernel.
    pub pairwise_share: f64,
    /// Lengthscale of the additive and pairwise parts, as a share of each dimension's range.
    pub broad_lengthscale: f64,
    /// Where labels enter.
    pub labels: Labels,
    /// Multiplies every lengthscale of the function that separate labels are about.
    pub feasibility_lengthscale_factor: f64,
    /// Share of functions of one quantity in the function that separate labels are about.
    pub feasibility_additive_share: f64,
    /// What is tried first.
    pub start: Start,
    /// Scale of the noise of a preference, in units of utility.
    pub preference_noise: f64,
    /// Scale of the noise of a label.
    pub ordinal_noise: f64,
    /// Boundaries between the categories of labels, strictly increasing: one less than there are categories. The
    /// default single 0 gives two categories, 0 not converged and 1 converged.
    pub ordinal_thresholds: Vec<f64>,
    /// Scale of the noise of a suggestion.
    pub coactive_noise: f64,
    /// Scale of the noise of a tie.
    pub tie_noise: f64,
    /// Utilities closer than this are felt as equal.
    pub tie_width: f64,
    /// Learn lengthscales and preference noise from the evidence each time this many more actions were tried.
    /// None: they stay as set.
    pub learn_every: Option<usize>,
    /// Region of avoidance: actions whose mean plus this many standard deviations does not reach the lowest
    /// threshold are not proposed while others are left (ROIAL uses -0.45). Mean and deviation are those of the
    /// function that labels are about. It binds every method but `random`. None: nothing is avoided.
    pub avoidance: Option<f64>,
    /// Number `n` of actions proposed at a time: one batch.
    pub samples_per_iteration: usize,
    /// Whether LineCoSpar may propose an action again, as published: rather one that is not among the buffered ones,
    /// but where everything was tried it repeats instead of ending. The other methods never repeat.
    pub repeats: bool,
    /// Number of random lines through the best action on which EUBO looks; 0 looks at the whole grid.
    pub lines: usize,
    /// Number of trials after which EUBO leaves the lines and looks at the whole grid.
    pub line_trials: usize,
    /// Which earlier actions a new one is compared with.
    pub partner: Partner,
    /// Number `b` of actions tried before a batch with which each of the batch is compared where the partner is
    /// `previous`. The other partners do not use it.
    pub buffer: usize,
}

impl Default for LearnerSettings {
    fn default() -> Self {
        Self::of(Method::LineCoSpar)
    }
}

impl LearnerSettings {
    /// The recommended settings of a method; docs/benchmarks/learner.md has the measurements behind them.
    pub fn of(method: Method) -> Self {
        match method {
            Method::Eubo => Self {
                labels: Labels::Separate,
                lines: 20,
                line_trials: 10,
                start: Start::Centre,
                ..Self::published(method)
            },
            _ => Self { repeats: false, partner: Partner::Incumbent, ..Self::published(method) },
        }
    }

    /// EUBO for answers that may be wrong: it assumes much noise and a smooth utility, so that it leans on many answers
    /// rather than on the last one, and never leaves the neighbourhood of the best.
    pub fn for_uncertain_answers() -> Self {
        Self { preference_noise: 0.8, lengthscale_factor: 2.0, line_trials: EVERY_TRIAL, ..Self::of(Method::Eubo) }
    }

    /// The settings of a method as the literature has them: LineCoSpar may repeat actions and compares with the last
    /// ones tried, EUBO looks at the whole grid with labels in the utility.
    pub fn published(method: Method) -> Self {
        let polar = Self {
            method,
            inference: Inference::Laplace,
            link: Link::Logistic,
            signal_variance: 1.0,
            nugget: 1e-5,
            lengthscale_factor: 1.0,
            additive_share: 0.0,
            pairwise_share: 0.0,
            broad_lengthscale: 1.0,
            labels: Labels::InUtility,
            feasibility_lengthscale_factor: 1.0,
            feasibility_additive_share: 0.0,
            start: Start::Random,
            preference_noise: 0.02,
            ordinal_noise: 0.1,
            ordinal_thresholds: vec![0.0],
            coactive_noise: 0.02,
            tie_noise: 0.02,
            tie_width: 0.02,
            learn_every: None,
            avoidance: None,
            samples_per_iteration: 1,
            repeats: true,
            lines: 0,
            line_trials: EVERY_TRIAL,
            partner: Partner::Previous,
            buffer: 1,
        };
        match method {
            Method::Eubo => Self {
                inference: Inference::ExpectationPropagation,
                link: Link::Probit,
                partner: Partner::Incumbent,
                repeats: false,
                ..polar
            },
            _ => polar,
        }
    }

    /// The utilities of a category of labels.
    pub(crate) fn label_interval(&self, category: usize) -> Interval {
        let bounds = &self.ordinal_thresholds;
        let low = category.checked_sub(1).and_then(|below| bounds.get(below)).copied().unwrap_or(f64::NEG_INFINITY);
        Interval { low, high: bounds.get(category).copied().unwrap_or(f64::INFINITY), noise: self.ordinal_noise }
    }

    /// Where labels are separate, what a category says of feasibility: below the lowest threshold or above it.
    pub(crate) fn feasibility_interval(&self, category: usize) -> Interval {
        let lowest = self.label_interval(0);
        if category == 0 { lowest } else { Interval { low: lowest.high, high: f64::INFINITY, ..lowest } }
    }

    /// Where labels are separate, what a category says of the utility: of several grades above the lowest category,
    /// which one. None where it says nothing.
    pub(crate) fn grade_interval(&self, category: usize) -> Option<Interval> {
        let interval = self.label_interval(category);
        match category {
            0 => None,
            _ if self.categories() < 3 => None,
            1 => Some(Interval { low: f64::NEG_INFINITY, ..interval }),
            _ => Some(interval),
        }
    }

    /// Number of categories of labels.
    pub fn categories(&self) -> usize {
        self.ordinal_thresholds.len() + 1
    }

    /// Checks every number.
    ///
    /// # Errors
    /// At the first setting outside its range.
    pub fn validate(&self) -> Result<()> {
        let refuse = |setting, reason: String| Err(LearnerError::InvalidSetting { setting, reason });
        let outside = |value: f64, low: f64, high: f64| format!("{value} is not between {low} and {high}");
        for (setting, value, low, high) in [
            ("signal_variance", self.signal_variance, 1e-6, 1e6),
            ("nugget", self.nugget, 1e-10 * self.signal_variance, self.signal_variance),
            ("lengthscale_factor", self.lengthscale_factor, 1e-2, 1e2),
            ("additive_share", self.additive_share, 0.0, 1.0),
            ("pairwise_share", self.pairwise_share, 0.0, 1.0),
            ("broad_lengthscale", self.broad_lengthscale, 1e-2, 1e3),
            ("feasibility_lengthscale_factor", self.feasibility_lengthscale_factor, 1e-2, 1e2),
            ("feasibility_additive_share", self.feasibility_additive_share, 0.0, 1.0),
        ] {
            if !(value >= low && value <= high) {
                return refuse(setting, outside(value, low, high));
            }
        }
        // Beyond these ratios an answer says everything or nothing, and double precision cannot tell.
        let deviation = self.signal_variance.sqrt();
        let (low, high) = (1e-3 * deviation, 1e3 * deviation);
        for (setting, value) in [
            ("preference_noise", self.preference_noise),
            ("ordinal_noise", self.ordinal_noise),
            ("coactive_noise", self.coactive_noise),
            ("tie_noise", self.tie_noise),
            ("tie_width", self.tie_width),
        ] {
            if !(value >= low && value <= high) {
                let reason = outside(value, low, high) + ", 1e-3 and 1e3 times the root of signal_variance";
                return refuse(setting, reason);
            }
        }
        if self.learn_every == Some(0) {
            return refuse("learn_every", "must be at least 1".into());
        }
        if let Some(avoidance) = self.avoidance
            && (avoidance.is_nan() || avoidance.abs() > 1e3)
        {
            return refuse("avoidance", format!("{avoidance} is not between -1000 and 1000"));
        }
        if self.additive_share + self.pairwise_share > 1.0 {
            return refuse("pairwise_share", "additive and pairwise shares together exceed 1".into());
        }
        if self.inference == Inference::ExpectationPropagation && self.link != Link::Probit {
            return refuse("link", "expectation propagation needs the probit link".into());
        }
        let farthest = 10.0 * deviation;
        if let Some(&threshold) = self.ordinal_thresholds.iter().find(|t| t.is_nan() || t.abs() > farthest) {
            let reason = outside(threshold, -farthest, farthest) + ", ten times the root of signal_variance";
            return refuse("ordinal_thresholds", reason);
        }
        let narrowest = 1e-3 * deviation;
        if let Some([below, above]) = self.ordinal_thresholds.array_windows().find(|[a, b]| b - a < narrowest) {
            let reason = format!("{above} after {below} does not increase by {narrowest} or more");
            return refuse("ordinal_thresholds", reason);
        }
        if self.ordinal_thresholds.len() > 100 {
            return refuse("ordinal_thresholds", "at most 100 thresholds are accepted".into());
        }
        if !(1..=1024).contains(&self.samples_per_iteration) {
            return refuse(
                "samples_per_iteration",
                format!("{} is not between 1 and 1024", self.samples_per_iteration),
            );
        }
        if self.buffer > 10_000 {
            return refuse("buffer", format!("{} is more than 10000", self.buffer));
        }
        Ok(())
    }
}
