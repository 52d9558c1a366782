//! What can be wrong with a request to the learner.

use crate::space::ActionIndex;

/// Why a space, a log, a setting or a request was refused.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum LearnerError {
    /// A search space needs at least one dimension.
    #[error("the search space has no dimension")]
    NoDimension,
    /// A dimension cannot be used as given.
    #[error("dimension `{dimension}`: {reason}")]
    InvalidDimension {
        /// Name of the dimension.
        dimension: String,
        /// What is wrong with it.
        reason: String,
    },
    /// A lengthscale at which an action would tell nothing of another, or all actions would be the same.
    #[error("dimension `{dimension}`: lengthscale {lengthscale} is not between {shortest} and {longest}")]
    InvalidLengthscale {
        /// Name of the dimension.
        dimension: String,
        /// The lengthscale given.
        lengthscale: f64,
        /// The shortest that is accepted, to three digits.
        shortest: f64,
        /// The longest.
        longest: f64,
    },
    /// The grid has more actions than an [`ActionIndex`] may count.
    #[error("the search space has more than {limit} actions")]
    TooManyActions {
        /// The largest number of actions accepted.
        limit: u64,
    },
    /// An action index outside the grid.
    #[error("action {action} is not in the search space of {actions} actions")]
    UnknownAction {
        /// The index given.
        action: ActionIndex,
        /// Number of actions in the space.
        actions: u64,
    },
    /// A list of levels or values with the wrong number of entries.
    #[error("{given} coordinates were given for a search space of {expected} dimensions")]
    WrongDimensionCount {
        /// Number of coordinates given.
        given: usize,
        /// Number of dimensions of the space.
        expected: usize,
    },
    /// A dimension's number beyond the last dimension.
    #[error("dimension {dimension} does not exist, there are {dimensions} (counted from 0)")]
    UnknownDimension {
        /// The number given, counted from 0.
        dimension: usize,
        /// Number of dimensions of the space.
        dimensions: usize,
    },
    /// A level number beyond a dimension's last level.
    #[error("dimension `{dimension}` has {levels} levels, level {level} does not exist")]
    UnknownLevel {
        /// Name of the dimension.
        dimension: String,
        /// The level given, counted from 0.
        level: usize,
        /// Number of levels.
        levels: usize,
    },
    /// A value that is not one of a dimension's levels.
    #[error("dimension `{dimension}` has no level {value}; its levels are {levels:?}")]
    UnknownValue {
        /// Name of the dimension.
        dimension: String,
        /// The value given.
        value: f64,
        /// The dimension's levels.
        levels: Vec<f64>,
    },
    /// A comparison or suggestion names the same action twice.
    #[error("feedback {entry}: action {action} cannot be compared with itself")]
    SelfComparison {
        /// Position in the log, counted from 0.
        entry: usize,
        /// The action.
        action: ActionIndex,
    },
    /// A label beyond the last category.
    #[error("feedback {entry}: category {category} does not exist, there are {categories} (counted from 0)")]
    UnknownCategory {
        /// Position in the log, counted from 0.
        entry: usize,
        /// The category given.
        category: usize,
        /// Number of categories.
        categories: usize,
    },
    /// A setting outside its range.
    #[error("setting `{setting}`: {reason}")]
    InvalidSetting {
        /// Name of the setting.
        setting: &'static str,
        /// What is wrong with it.
        reason: String,
    },
    /// Every action has been visited or is pending; where actions may be repeated, every one is pending.
    #[error("all {actions} actions have been visited or are pending")]
    Exhausted {
        /// Number of actions in the space.
        actions: u64,
    },
    /// A stored state of a version this crate does not read.
    #[error("learner state of version {version}; this program reads version {newest}")]
    UnknownVersion {
        /// Version of the document.
        version: u32,
        /// Version read.
        newest: u32,
    },
    /// A covariance matrix could not be factored even after regularisation.
    #[error("numerical failure: {0}")]
    Numerical(String),
}

/// `Result` with this crate's error.
pub(crate) type Result<T> = std::result::Result<T, LearnerError>;
