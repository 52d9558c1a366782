//! The errors of the service. `http::problem_details` maps them to HTTP responses.

use crate::dispatch_error::DispatchError;
use gait_learner::LearnerError;
use gait_optimizer::{ModelError, SolveError};
use gaitwright_compute::ComputeError;
use gaitwright_store::StoreError;
use serde_json::Value;
use thiserror::Error;

/// A field of a request that was refused.
#[derive(Debug, Clone, PartialEq)]
pub struct FieldError {
    /// The name of the field, as in the request (`height_m`).
    pub field: String,
    /// The value that was given; `None` for a file.
    pub value: Option<Value>,
    /// The accepted values, in words or as a range; `None` for a file, whose fault `message` describes.
    pub allowed: Option<String>,
    /// The whole sentence for people.
    pub message: String,
}

impl FieldError {
    /// Refuses a value. `allowed` completes the sentence "it must be ...".
    pub fn new(field: &str, value: impl Into<Value>, allowed: &str) -> Self {
        let value = value.into();
        let message = Self::sentence(field, Some(&value.to_string()), allowed);
        Self { field: field.to_owned(), value: Some(value), allowed: Some(allowed.to_owned()), message }
    }
}

impl FieldError {
    /// The sentence of every refusal: in problem documents, on the command line and on pages. `name` is the name of the
    /// field, or its label in quotation marks, which read as a name whatever words a label has.
    pub fn sentence(name: &str, given: Option<&str>, allowed: &str) -> String {
        let allowed = allowed.trim_end_matches('.');
        match given {
            Some(given) => format!("{name} is {given}; it must be {allowed}."),
            None => format!("{name} must be {allowed}."),
        }
    }

    /// The same refusal with the reason, a sentence, after its own sentence.
    #[must_use]
    pub fn because(self, reason: &impl std::fmt::Display) -> Self {
        Self { message: format!("{} {reason}", self.message), ..self }
    }

    /// Refuses a value that the error describes instead of repeating it. `is` and `allowed` complete the sentences "it is
    /// ..." and "it must be ...".
    pub fn described(field: &str, is: &str, allowed: &str) -> Self {
        let message = Self::sentence(field, Some(is), allowed);
        Self { field: field.to_owned(), value: None, allowed: Some(allowed.to_owned()), message }
    }

    /// Refuses a field in a sentence of its own.
    pub fn in_words(field: &str, message: &str) -> Self {
        Self { field: field.to_owned(), value: None, allowed: None, message: message.to_owned() }
    }

    /// The refusal with the path that the field has in a request: `to` in place of the prefix `from`.
    #[must_use]
    pub fn renamed(self, from: &str, to: &str) -> Self {
        let Some(name) = self.field.strip_prefix(from) else { return self };
        let field = format!("{to}{name}");
        let message = self.message.strip_prefix(&self.field).map(|rest| format!("{field}{rest}"));
        Self { message: message.unwrap_or_else(|| self.message.clone()), field, ..self }
    }

    /// The refusal of a field that is part of another one, with its whole path.
    #[must_use]
    pub fn within(self, part: &str) -> Self {
        let field = format!("{part}.{}", self.field);
        let message = match self.message.strip_prefix(&self.field) {
            Some(rest) => format!("{field}{rest}"),
            None => format!("{part}: {}", self.message),
        };
        Self { field, message, ..self }
    }
}

impl From<FieldError> for Error {
    fn from(error: FieldError) -> Self {
        Self::Invalid(Box::new(error))
    }
}

impl From<ModelError> for FieldError {
    fn from(error: ModelError) -> Self {
        let (message, allowed) = (error.to_string(), error.allowed());
        match error {
            ModelError::OutOfRange { field, value, .. } | ModelError::MustBeAbsent { field, value, .. } => {
                Self { field, value: Some(value.into()), allowed, message }
            }
            ModelError::Unknown { field, value, .. } => Self { field, value: Some(value.into()), allowed, message },
            ModelError::Malformed { what, .. } => {
                // The message has line and column of a file; the field is that of the request.
                let field = what.split_once(", line ").map_or(what.as_str(), |(field, _)| field).to_owned();
                Self { field, value: None, allowed, message }
            }
        }
    }
}

/// An error of the service.
#[derive(Debug, Error)]
pub enum Error {
    /// Something that the request names does not exist, or the caller has no access to it.
    #[error("There is no {what} {id}.")]
    NotFound {
        /// The kind of thing.
        what: String,
        /// Its identifier, as given.
        id: String,
    },
    /// The request names an address that does not exist.
    #[error("The address {0} does not exist.")]
    NoAddress(String),
    /// The request cannot be read.
    #[error("{0}")]
    Malformed(String),
    /// A field of the request cannot be read.
    #[error("{}", .0.message)]
    Unreadable(Box<FieldError>),
    /// The body is of a media type that is not accepted.
    #[error("{0}")]
    UnsupportedMediaType(String),
    /// A field of the request has a value that is not accepted.
    #[error("{}", .0.message)]
    Invalid(Box<FieldError>),
    /// A cursor that came from another list, or from the same list with other filters or another order.
    #[error(
        "This cursor belongs to another list, or to this list with other filters or in another order. Send the value of \
         `next` from a page with the same path, filters and order."
    )]
    CursorOfAnotherList(String),
    /// The request has no valid credential.
    #[error("{0}")]
    NotSignedIn(String),
    /// Too many failed attempts; the caller has to wait for this many seconds.
    #[error("Too many attempts. Try again in {0} s.")]
    TooManyAttempts(u64),
    /// The resource has changed since the caller read it.
    #[error("{0}")]
    Changed(String),
    /// The body exceeds the size limit.
    #[error("{0}")]
    TooLarge(String),
    /// The address does not accept this method.
    #[error("The method {method} is not accepted at {path}.")]
    MethodNotAllowed {
        /// The method.
        method: String,
        /// The address.
        path: String,
    },
    /// The caller lacks the right with this name.
    #[error("This request requires the right `{0}`, which you do not have. Ask an administrator for it.")]
    MissingRight(&'static str),
    /// The caller must not do this, or the request comes from another origin.
    #[error("{0}")]
    Forbidden(String),
    /// The current state does not allow the request.
    #[error("{0}")]
    Conflict(String),
    /// An answer that cannot be undone.
    #[error("{0}")]
    CannotBeUndone(String),
    /// The learner cannot work with the settings or answers of a study.
    #[error("The learner failed: {0}.")]
    Learner(LearnerError),
    /// The service and its workers cannot communicate.
    #[error(transparent)]
    Dispatch(#[from] DispatchError),
    /// The record failed.
    #[error(transparent)]
    Store(StoreError),
    /// A command cannot write its output.
    #[error("Cannot write the output: {0}.")]
    Output(std::io::Error),
    /// The disk is full.
    #[error("{0}")]
    StorageFull(String),
    /// The service is temporarily unable to handle the request.
    #[error("{0}")]
    NotReady(String),
    /// A bug in the program.
    #[error("Internal error: {}.", .0.trim_end_matches('.'))]
    Internal(String),
}

impl Error {
    /// A request that the current state does not allow.
    pub fn conflict(reason: impl Into<String>) -> Self {
        Self::Conflict(reason.into())
    }

    /// A field whose value is not accepted. `allowed` completes the sentence "it must be ...".
    pub fn invalid(field: &str, value: impl Into<Value>, allowed: &str) -> Self {
        Self::Invalid(Box::new(FieldError::new(field, value, allowed)))
    }

    /// Whether the record, the disk or the broker failed, so that a retry may succeed.
    pub fn is_of_machine(&self) -> bool {
        matches!(self, Self::Store(_) | Self::Dispatch(_) | Self::StorageFull(_) | Self::NotReady(_))
    }

    /// Whether the request caused the error, rather than the program or the machine.
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
                StoreError::NearlyFull { .. } | StoreError::CopyFull { .. } => full.to_string(),
                _ => "The disk that holds the record is full. Nothing was changed. Free some space and try again."
                    .to_owned(),
            }),
            closed if closed.is_unwritable() => {
                Self::NotReady(format!("The record cannot be written. Nothing was changed. {closed}"))
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
            SolveError::WarmStartShape { .. } | SolveError::NoLocalOptimum { .. } => Self::Conflict(error.to_string()),
            SolveError::Solver(_) => Self::Internal(error.to_string()),
        }
    }
}
