//! Workers: what runs a solve. They never see the database.
//!
//! A worker gets an [`Assignment`], reports iterations, and gives back a [`Finding`]. Solves are CPU work: each
//! runs on a thread of its own, at most as many at a time as the pool has slots, and never on the async runtime.

mod board;
mod evaluate;
mod pool;

pub use board::{Board, Progress, Track};
pub use evaluate::{Assignment, Evaluate, GaitSolver};
pub use pool::{Finding, Pool, Slot};
