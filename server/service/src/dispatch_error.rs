//! Why a job could not be handed to a worker.

use thiserror::Error;

/// A job could not be dispatched. It is retried later.
#[derive(Debug, Error)]
pub enum DispatchError {
    /// The job is too large for the engine.
    #[error("{what} has {bytes} bytes, but the broker accepts at most {limit}. Raise its max_payload.")]
    TooLarge {
        /// The kind of message.
        what: &'static str,
        /// Its size.
        bytes: usize,
        /// The limit of the broker.
        limit: usize,
    },
    /// A message cannot be written or read.
    #[error("A message between service and worker is malformed: {0}.")]
    Message(String),
    /// The engine cannot be reached.
    #[error("{0}")]
    Unreachable(String),
}
