//! Solves that have not ended.

use gaitwright_store::{Instant, solve_jobs};
use serde::Serialize;
use utoipa::ToSchema;

/// A solve that has not ended.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct OpenSolve {
    /// Number of times that it was given to a worker.
    attempts: u32,
    /// Attempts that crashed or ended with an error.
    failures: u32,
    /// Attempts whose worker stopped responding.
    losses: u32,
    /// Worker that has it. Null while it is queued.
    worker: Option<String>,
    /// End of the lease, unless it is renewed. Null while the solve is queued.
    lease_until: Option<Instant>,
    /// Time of queueing.
    created_at: Instant,
}

impl From<solve_jobs::OpenSolve> for OpenSolve {
    fn from(row: solve_jobs::OpenSolve) -> Self {
        let solve_jobs::OpenSolve {
            attempts,
            failures,
            losses,
            worker,
            lease_until,
            created_at,
            trial_id: _,
            study_id: _,
        } = row;
        Self { attempts, failures, losses, worker, lease_until, created_at }
    }
}
