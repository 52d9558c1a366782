//! Settings of the learner, named as in the literature.

use serde::{Deserialize, Serialize};

use crate::error::{LearnerError, Result};
use crate::interval_likelihood::Link;

mod deserialize;

/// How the next action is chosen.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Method {
    /// LineCoSpar (Tucker et al. 2020): a Thompson sample on a random line through the best action.
    #[serde(rename = "linecospar")]
    LineCoSpar,
    /// Expected utility of the best option (Lin et al. 2022): the action that maximises the expected utility of the
    /// better of itself and the best action so far.
    Eubo,
    /// Thompson sampling: the maximiser of one joint sample of the utility over the whole grid.
    Thompson,
    /// Information gain (ROIAL, Li et al. 2021): the action whose feedback has the largest mutual information with the
    /// utility.
    InformationGain,
    /// A uniformly random action that has not been visited.
    Random,
}

/// Method of approximate inference.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Inference {
    /// Laplace's approximation: a normal distribution at the mode of the posterior.
    Laplace,
    /// Expectation propagation (Minka 2001). Requires the probit link.
    ExpectationPropagation,
}

/// The function that labels are about.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Labels {
    /// Labels are about the utility, as in the literature.
    InUtility,
    /// Category 0 is about a second Gaussian process, feasibility. Higher categories, if there are several, are about
    /// the utility. A comparison of a feasible with an infeasible action does not inform the utility.
    Separate,
}

/// The first action of a study.
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
    /// The other actions of its batch, and the last `buffer` actions before the batch, as published: a subject
    /// remembers only those.
    Previous,
    /// The best action so far.
    Incumbent,
    /// Every earlier action. Suitable if a computed figure of merit answers.
    Every,
}

/// Settings of model, inference, proposals and comparisons.
///
/// The default is LineCoSpar with the parameters of POLAR (Tucker, Li et al.), the toolbox of its authors, except that
/// it does not repeat actions and compares each with the best so far.
///
/// Deserialisation accepts any subset of the fields. The others take the values that [`LearnerSettings::of`] gives for
/// the method.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LearnerSettings {
    /// Method that chooses the next action.
    pub method: Method,
    /// Method of approximate inference.
    pub inference: Inference,
    /// Distribution of the noise.
    pub link: Link,
    /// Prior variance of the utility, 1e-6 to 1e6.
    pub signal_variance: f64,
    /// Variance added to the diagonal of the prior covariance ("GP noise" in the literature), at most
    /// `signal_variance`.
    pub nugget: f64,
    /// Factor on the lengthscale of every dimension, 0.01 to 100.
    pub lengthscale_factor: f64,
    /// The function that labels are about.
    pub labels: Labels,
    /// The first action of a study.
    pub start: Start,
    /// Noise scale of preferences, in units of utility. All noise scales lie between 1e-3 and 1e3 prior standard
    /// deviations.
    pub preference_noise: f64,
    /// Noise scale of labels, in units of utility.
    pub ordinal_noise: f64,
    /// Thresholds between the categories of labels, in units of utility, strictly increasing; one less than the number
    /// of categories. The default, a single 0, gives two categories: 0 not converged, 1 converged.
    pub ordinal_thresholds: Vec<f64>,
    /// Noise scale of suggestions, in units of utility.
    pub coactive_noise: f64,
    /// Noise scale of answers of no difference, in units of utility.
    pub no_difference_noise: f64,
    /// Utilities that differ by less than this feel equal.
    pub no_difference_width: f64,
    /// Region of avoidance (ROIAL, Li et al. 2021): an action is not proposed if its mean plus this many standard
    /// deviations is below the lowest threshold, unless no other action is left. ROIAL uses -0.45. Mean and deviation
    /// are those of the function that labels are about. All methods but `random` respect it. `None` disables it.
    pub avoidance: Option<f64>,
    /// Number `n` of actions in a batch, 1 to 1024.
    pub samples_per_iteration: usize,
    /// Whether LineCoSpar may propose a visited action again, as published. It prefers actions outside the buffer. The
    /// other methods never repeat.
    pub repeats: bool,
    /// Number of random lines through the best action that EUBO searches. 0 means the whole grid.
    pub lines: usize,
    /// Number of trials after which EUBO searches the whole grid instead of lines. `None`: it always searches lines.
    pub line_trials: Option<usize>,
    /// Which earlier actions a new one is compared with.
    pub partner: Partner,
    /// Number `b` of actions before a batch with which each action of the batch is compared, at most 10,000. Only the
    /// partner `previous` uses it.
    pub buffer: usize,
}

impl Default for LearnerSettings {
    fn default() -> Self {
        Self::of(Method::LineCoSpar)
    }
}

impl LearnerSettings {
    /// The recommended settings of a method. `docs/benchmarks/learner.md` has the measurements behind them.
    pub fn of(method: Method) -> Self {
        match method {
            Method::Eubo => Self {
                labels: Labels::Separate,
                lines: 20,
                line_trials: Some(10),
                start: Start::Centre,
                ..Self::published(method)
            },
            _ => Self { repeats: false, partner: Partner::Incumbent, ..Self::published(method) },
        }
    }

    /// EUBO for noisy feedback. Large noise and long lengthscales average over many comparisons, and the search stays
    /// on lines through the best action.
    pub fn for_uncertain_answers() -> Self {
        Self { preference_noise: 0.8, lengthscale_factor: 2.0, line_trials: None, ..Self::of(Method::Eubo) }
    }

    /// The published settings of a method. LineCoSpar may repeat actions and compares each with the previous ones. EUBO
    /// searches the whole grid, with labels in the utility.
    pub fn published(method: Method) -> Self {
        let polar = Self {
            method,
            inference: Inference::Laplace,
            link: Link::Logistic,
            signal_variance: 1.0,
            nugget: 1e-5,
            lengthscale_factor: 1.0,
            labels: Labels::InUtility,
            start: Start::Random,
            preference_noise: 0.02,
            ordinal_noise: 0.1,
            ordinal_thresholds: vec![0.0],
            coactive_noise: 0.02,
            no_difference_noise: 0.02,
            no_difference_width: 0.02,
            avoidance: None,
            samples_per_iteration: 1,
            repeats: true,
            lines: 0,
            line_trials: None,
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

    /// Number of categories of labels: one more than the number of thresholds.
    pub fn categories(&self) -> usize {
        self.ordinal_thresholds.len() + 1
    }

    /// Checks every setting.
    ///
    /// # Errors
    /// [`LearnerError::InvalidSetting`] for the first setting that is out of range.
    pub fn validate(&self) -> Result<()> {
        let refuse = |setting, reason: String| Err(LearnerError::InvalidSetting { setting, reason });
        let outside = |value: f64, low: f64, high: f64| format!("is {value}; it must be {low} to {high}");
        for (setting, value, low, high) in [
            ("signal_variance", self.signal_variance, 1e-6, 1e6),
            ("nugget", self.nugget, 1e-10 * self.signal_variance, self.signal_variance),
            ("lengthscale_factor", self.lengthscale_factor, 1e-2, 1e2),
        ] {
            if !(value >= low && value <= high) {
                return refuse(setting, outside(value, low, high));
            }
        }
        // Beyond these ratios the likelihood is 0, 1 or constant in double precision.
        let deviation = self.signal_variance.sqrt();
        let (low, high) = (1e-3 * deviation, 1e3 * deviation);
        for (setting, value) in [
            ("preference_noise", self.preference_noise),
            ("ordinal_noise", self.ordinal_noise),
            ("coactive_noise", self.coactive_noise),
            ("no_difference_noise", self.no_difference_noise),
            ("no_difference_width", self.no_difference_width),
        ] {
            if !(value >= low && value <= high) {
                let reason =
                    outside(value, low, high) + ", which is 1e-3 to 1e3 times the square root of signal_variance";
                return refuse(setting, reason);
            }
        }
        if let Some(avoidance) = self.avoidance
            && (avoidance.is_nan() || avoidance.abs() > 1e3)
        {
            return refuse("avoidance", outside(avoidance, -1e3, 1e3));
        }
        if self.inference == Inference::ExpectationPropagation && self.link != Link::Probit {
            return refuse(
                "link",
                r#"is "logistic"; it must be "probit", because inference is "expectation_propagation""#.into(),
            );
        }
        let farthest = 10.0 * deviation;
        if let Some(&threshold) = self.ordinal_thresholds.iter().find(|t| t.is_nan() || t.abs() > farthest) {
            let reason = outside(threshold, -farthest, farthest) + ", ten times the square root of signal_variance";
            return refuse("ordinal_thresholds", reason);
        }
        let narrowest = 1e-3 * deviation;
        if let Some([below, above]) = self.ordinal_thresholds.array_windows().find(|[a, b]| b - a < narrowest) {
            let reason = format!(
                "has {above} after {below}; it must be a list whose values increase in steps of at least {narrowest}"
            );
            return refuse("ordinal_thresholds", reason);
        }
        if self.ordinal_thresholds.len() > 100 {
            return refuse(
                "ordinal_thresholds",
                format!(
                    "has {} thresholds; it must be a list of at most 100 thresholds",
                    self.ordinal_thresholds.len()
                ),
            );
        }
        if !(1..=1024).contains(&self.samples_per_iteration) {
            return refuse("samples_per_iteration", format!("is {}; it must be 1 to 1024", self.samples_per_iteration));
        }
        if self.buffer > 10_000 {
            return refuse("buffer", format!("is {}; it must be 0 to 10000", self.buffer));
        }
        Ok(())
    }
}
