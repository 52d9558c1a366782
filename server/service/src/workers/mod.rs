//! Workers and engines that run solves. They never access the database.
//!
//! A worker receives an [`Assignment`], reports iterations, and returns an [`AssignmentResult`]. An engine ([`Dispatch`])
//! distributes assignments: to threads of this process ([`InProcess`]), or to workers on other machines through a
//! broker (`nats`). Solves are CPU-bound, so each runs on its own thread and never on the async runtime.

mod after_solves;
mod certify;
mod dispatch;
mod evaluate;
mod explain;
mod in_process;
#[cfg(feature = "nats")]
pub mod nats;
mod solve_progress;

pub use after_solves::AfterSolves;
pub use certify::{Certify, GaitCertifier};
pub use dispatch::{Assignment, AssignmentResult, Attempt, Dispatch, EngineMessage, Receipt};
pub use evaluate::{Evaluate, GaitSolver};
pub use explain::{Explain, GaitExplainer, SolveToExplain};
pub use in_process::{IN_PROCESS, InProcess, LEASE};
pub use solve_progress::{RunningSolves, SolveProgress, Track};
