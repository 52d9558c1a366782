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
    /// The initial guesses did not reach the local optimum that was asked for.
    #[error("The initial guesses reached local optima 1 to {reached}, but not number {number}.")]
    NoLocalOptimum {
        /// The number that was asked for.
        number: usize,
        /// Number of local optima.
        reached: usize,
    },
    /// The interior-point solver rejected its input.
    #[error(transparent)]
    Solver(#[from] NlpError),
}
