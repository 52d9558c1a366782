//! A general sparse nonlinear-programming solver. It knows nothing of walking.

mod problem;

pub use problem::{EliminationBlocks, NonlinearProgram, SparsityPattern};
