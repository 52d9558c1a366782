//! Errors of a solve.

use crate::model_error::ModelError;
use interior_point::NlpError;
use thiserror::Error;

/// The reason why a solve could not start.
#[derive(Debug, Error)]
pub enum SolveError {
    /// The problem or an option is invalid.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// The warm start belongs to another problem.
    #[error("The warm start belongs to another problem: {0}.")]
    WarmStartShape(String),
    /// The interior-point solver rejected its input.
    #[error(transparent)]
    Solver(#[from] NlpError),
}
