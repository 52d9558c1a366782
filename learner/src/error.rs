//! Errors of the learner.

use crate::action::ActionIndex;

/// Why the learner rejected a search space, a log, a setting or a request.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum LearnerError {
    /// The search space has no dimension.
    #[error("the search space needs at least one dimension")]
    NoDimension,
    /// The search space has too many dimensions.
    #[error("the search space has {given} dimensions; at most {limit} are allowed")]
    TooManyDimensions {
        /// Number of dimensions given.
        given: usize,
        /// Largest number of dimensions allowed.
        limit: usize,
    },
    /// Two dimensions have the same name.
    #[error("dimension `{dimension}`: another dimension has the same name")]
    DuplicateDimension {
        /// The name.
        dimension: String,
    },
    /// A dimension has invalid values, or is unsuitable for a request.
    #[error("dimension `{dimension}`: {reason}")]
    InvalidDimension {
        /// Name of the dimension.
        dimension: String,
        /// Reason for the refusal.
        reason: String,
    },
    /// The lengthscale is so short that actions are uncorrelated, or so long that they are indistinguishable.
    #[error("dimension `{dimension}`: lengthscale is {lengthscale}; it must be {shortest} to {longest}")]
    InvalidLengthscale {
        /// Name of the dimension.
        dimension: String,
        /// The lengthscale given.
        lengthscale: f64,
        /// Lower limit, to three digits.
        shortest: f64,
        /// Upper limit, to three digits.
        longest: f64,
    },
    /// There are no descriptors, or too many.
    #[error("the number of descriptors is {given}; it must be 1 to {limit}")]
    WrongDescriptorCount {
        /// Number of descriptors given.
        given: usize,
        /// Largest number of descriptors allowed.
        limit: usize,
    },
    /// A descriptor is malformed or does not exist.
    #[error("descriptor {descriptor}: {reason}")]
    InvalidDescriptor {
        /// Index of the descriptor, counted from 0.
        descriptor: usize,
        /// Reason for the refusal.
        reason: String,
    },
    /// The lengthscale of the descriptors is out of range.
    #[error(
        "the lengthscale of the descriptors is {lengthscale}; it must be {shortest} to {longest}, in units of their spread"
    )]
    InvalidDescriptorLengthscale {
        /// The lengthscale given.
        lengthscale: f64,
        /// Lower limit.
        shortest: f64,
        /// Upper limit.
        longest: f64,
    },
    /// The number of described actions differs from that of the search space.
    #[error("the number of described actions is {given}; it must be {expected}, the number of actions")]
    WrongActionCount {
        /// Number of actions described.
        given: u64,
        /// Number of actions in the space.
        expected: u64,
    },
    /// The grid has too many actions.
    #[error("the search space has more than {limit} actions, the largest number allowed")]
    TooManyActions {
        /// Largest number of actions allowed.
        limit: u64,
    },
    /// The action index is outside the search space.
    #[error("action {action} does not exist: the search space has {actions} actions, counted from 0")]
    UnknownAction {
        /// The index given.
        action: ActionIndex,
        /// Number of actions in the space.
        actions: u64,
    },
    /// The number of levels or values differs from the number of dimensions.
    #[error("the number of coordinates is {given}; it must be {expected}, the number of dimensions")]
    WrongDimensionCount {
        /// Number of coordinates given.
        given: usize,
        /// Number of dimensions of the space.
        expected: usize,
    },
    /// The dimension index is out of range.
    #[error("dimension {dimension} does not exist: there are {dimensions}, counted from 0")]
    UnknownDimension {
        /// The index given, counted from 0.
        dimension: usize,
        /// Number of dimensions of the space.
        dimensions: usize,
    },
    /// The level index is out of range.
    #[error("dimension `{dimension}`: level {level} does not exist: there are {levels}, counted from 0")]
    UnknownLevel {
        /// Name of the dimension.
        dimension: String,
        /// The level index given, counted from 0.
        level: usize,
        /// Number of levels.
        levels: usize,
    },
    /// The value is not a level of its dimension.
    #[error("dimension `{dimension}`: {value} is not one of the values {levels:?}")]
    UnknownValue {
        /// Name of the dimension.
        dimension: String,
        /// The value given.
        value: f64,
        /// The dimension's levels.
        levels: Vec<f64>,
    },
    /// A comparison or a suggestion names the same action twice.
    #[error("feedback {entry}: action {action} cannot be compared with itself")]
    SelfComparison {
        /// Position in the log, counted from 0.
        entry: usize,
        /// The action.
        action: ActionIndex,
    },
    /// A label names a category that does not exist.
    #[error("feedback {entry}: category {category} does not exist: there are {categories}, counted from 0")]
    UnknownCategory {
        /// Position in the log, counted from 0.
        entry: usize,
        /// The category given.
        category: usize,
        /// Number of categories.
        categories: usize,
    },
    /// A setting is out of range or contradicts another one.
    #[error("setting `{setting}` {reason}")]
    InvalidSetting {
        /// Name of the setting.
        setting: &'static str,
        /// Reason for the refusal; follows the name of the setting.
        reason: String,
    },
    /// No action is left to propose: each has been visited or is pending. If actions may be repeated, each is pending.
    #[error("no action is left to propose: all {actions} have been tried or are pending")]
    Exhausted {
        /// Number of actions in the space.
        actions: u64,
    },
    /// A covariance matrix is not positive definite, or an iteration did not converge.
    #[error("numerical failure: {0}")]
    Numerical(String),
}

/// `Result` with [`LearnerError`].
pub(crate) type Result<T> = std::result::Result<T, LearnerError>;
