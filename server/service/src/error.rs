//! What can go wrong in the service. Says nothing of HTTP: one table in `http::problem` does.

use crate::studies::lifecycle::NotPossible;
use crate::workers::DispatchError;
use gait_learner::LearnerError;
use gait_optimizer::{ModelError, SolveError};
use gaitwright_compute::ComputeError;
use gaitwright_store::StoreError;
use serde_json::Value;
use thiserror::Error;

/// One field that was refused.
#[derive(Debug, Clone, PartialEq)]
pub struct FieldError {
    /// Its name, as in the request (`height_m`).
    pub field: String,
    /// What was given; none: it is a file.
    pub value: Option<Value>,
    /// What would have been accepted, in words or as a range; none: the sentence says what is wrong with a file.
    pub allowed: Option<String>,
    /// The whole sentence.
    pub message: String,
}

impl FieldError {
    /// A field, its value and what would have been accepted.
    pub fn new(field: &str, value: impl Into<Value>, allowed: &str) -> Self {
        let value = value.into();
        let message = format!("{field}: {value} is not accepted; allowed: {allowed}");
        Self { field: field.to_owned(), value: Some(value), allowed: Some(allowed.to_owned()), message }
    }
}

impl From<ModelError> for FieldError {
    fn from(error: ModelError) -> Self {
        let message = error.to_string();
        match error {
            ModelError::OutOfRange { field, value, minimum, maximum } => {
                Self { field, value: Some(value.into()), allowed: Some(format!("{minimum} to {maximum}")), message }
            }
            ModelError::Unknown { field, value, known } => {
                Self { field, value: Some(value.into()), allowed: Some(known), message }
            }
            ModelError::Malformed { what, .. } => Self { field: what, value: None, allowed: None, message },
        }
    }
}

/// What can go wrong in the service.
#[derive(Debug, Error)]
pub enum Error {
    /// What was asked for does not exist.
    #[error("{what} {id} does not exist")]
    NotFound {
        /// What.
        what: String,
        /// Its identifier, as given.
        id: String,
    },
    /// The request cannot be read.
    #[error("{0}")]
    Malformed(String),
    /// A field of the request cannot be read.
    #[error("{}", .0.message)]
    Unreadable(Box<FieldError>),
    /// The body is of a media type that is not accepted.
    #[error("{0}")]
    UnsupportedMediaType(String),
    /// The request can be read, but a field is not acceptable.
    #[error("{}", .0.message)]
    Invalid(Box<FieldError>),
    /// Nobody signed in, or not in a way that is accepted.
    #[error("{0}")]
    NotSignedIn(String),
    /// Too many attempts; to be tried again after so many seconds.
    #[error("too many attempts: try again in {0} s")]
    TooManyAttempts(u64),
    /// The thing was changed since it was read.
    #[error("{0}")]
    Changed(String),
    /// The body is larger than is accepted.
    #[error("{0}")]
    TooLarge(String),
    /// The address exists, but not with this method.
    #[error("{method} is not possible at {path}")]
    MethodNotAllowed {
        /// The method.
        method: String,
        /// The address.
        path: String,
    },
    /// The request comes from where it may not come from.
    #[error("{0}")]
    Forbidden(String),
    /// The request does not fit the present state.
    #[error("{0}")]
    Conflict(String),
    /// The learner refused.
    #[error("learner: {0}")]
    Learner(LearnerError),
    /// Service and workers cannot speak to each other.
    #[error(transparent)]
    Dispatch(#[from] DispatchError),
    /// The record.
    #[error(transparent)]
    Store(StoreError),
    /// What a command has to say cannot be written.
    #[error("cannot write to stdout: {0}")]
    Output(std::io::Error),
    /// The disk has no room for it.
    #[error("{0}")]
    StorageFull(String),
    /// The service cannot do its work now.
    #[error("{0}")]
    NotReady(String),
    /// A fault of the program.
    #[error("internal: {0}")]
    Internal(String),
}

impl Error {
    /// A request that does not fit the present state.
    pub fn conflict(reason: impl Into<String>) -> Self {
        Self::Conflict(reason.into())
    }

    /// A field that is not acceptable.
    pub fn invalid(field: &str, value: impl Into<Value>, allowed: &str) -> Self {
        Self::Invalid(Box::new(FieldError::new(field, value, allowed)))
    }

    /// Whether record, disk or broker are at fault: what was tried may be tried again.
    pub fn is_of_machine(&self) -> bool {
        matches!(self, Self::Store(_) | Self::Dispatch(_) | Self::StorageFull(_) | Self::NotReady(_))
    }

    /// Whether the request is at fault, and not the program or the machine.
    pub fn is_input(&self) -> bool {
        !matches!(
            self,
            Self::Store(_)
                | Self::Dispatch(_)
                | Self::Output(_)
                | Self::Internal(_)
                | Self::StorageFull(_)
                | Self::NotReady(_)
        )
    }
}

impl From<StoreError> for Error {
    fn from(error: StoreError) -> Self {
        match error {
            StoreError::Missing { what, id } => Self::NotFound { what: what.to_owned(), id },
            withdrawn if withdrawn.is_withdrawal() => Self::Conflict(StoreError::Withdrawn.to_string()),
            full if full.is_full() => Self::StorageFull(match full {
                StoreError::NearlyFull { .. } => full.to_string(),
                _ => "the disk of the record is full: the change did not happen; make room and try again".to_owned(),
            }),
            closed if closed.is_unwritable() => {
                Self::NotReady(format!("the record takes no changes, and this one did not happen: {closed}"))
            }
            other => Self::Store(other),
        }
    }
}

impl From<ComputeError> for Error {
    fn from(error: ComputeError) -> Self {
        Self::Internal(error.to_string())
    }
}

impl From<ModelError> for Error {
    fn from(error: ModelError) -> Self {
        Self::Invalid(Box::new(error.into()))
    }
}

impl From<SolveError> for Error {
    fn from(error: SolveError) -> Self {
        match error {
            SolveError::Model(error) => error.into(),
            SolveError::WarmStartShape { .. } => Self::Conflict(error.to_string()),
            SolveError::Solver(_) => Self::Internal(error.to_string()),
        }
    }
}

impl From<NotPossible> for Error {
    fn from(error: NotPossible) -> Self {
        Self::Conflict(error.to_string())
    }
}
