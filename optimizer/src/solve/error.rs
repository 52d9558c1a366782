//! Errors of a solve.

use super::report::SolveStatus;
use crate::subject::ModelError;
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
    /// The root of a continuation does not converge.
    #[error("The root has no gait: its solve ended as {0:?}.")]
    RootWithoutGait(SolveStatus),
    /// The interior-point solver rejected its input.
    #[error(transparent)]
    Solver(#[from] NlpError),
}
