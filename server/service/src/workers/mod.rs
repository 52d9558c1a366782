//! Workers: what runs a solve. They never see the database.
//!
//! A worker gets an [`Assignment`], reports iterations, and gives back a [`Finding`]. What hands assignments out is an
//! engine ([`Dispatch`]): threads of this process ([`InProcess`]), or workers elsewhere behind a broker ([`nats`]).
//! Solves are CPU work: each runs on a thread of its own and never on the async runtime.

mod after_solves;
mod board;
mod certify;
mod dispatch;
mod evaluate;
mod explain;
mod in_process;
pub mod nats;

pub use after_solves::AfterSolves;
pub use board::{Board, Progress, Track};
pub use certify::{Certify, GaitCertifier};
pub use dispatch::{Attempt, Dispatch, DispatchError, Finding, News, Receipt};
pub use evaluate::{Assignment, Evaluate, GaitSolver};
pub use explain::{Explain, GaitExplainer, Unexplained};
pub use in_process::{IN_PROCESS, InProcess, LEASE};
