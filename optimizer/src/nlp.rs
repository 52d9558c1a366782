//! A general sparse nonlinear-programming solver. It knows nothing of walking.
//!
//! minimise f(x) subject to x_L <= x <= x_U and g_L <= g(x) <= g_U, with exact sparse derivatives, by a primal-dual
//! interior point with a filter line search (Wächter & Biegler, Math. Program. 106, 2006). The path of a solve:
//!
//! `solve` -> `formulation` (slacks, fixed variables, scaling) -> `interior_point` { `optimality`, `barrier`,
//! `inertia_correction`, `newton` (assembly in `kkt`, factorisation behind `kkt_solver`: `multifrontal` (`front`,
//! `null_space`, `bunch_kaufman`, `dense_kernels`), `supernodal` or `delayed_pivots`, chosen in `linear_solver`,
//! fallbacks analysed when they are needed (`lazy_solver`)),
//! `line_search` with `filter`, and `feasibility` when the line search fails } -> `status::NlpResult`.

mod barrier;
mod block_columns;
mod bunch_kaufman;
mod delayed_pivots;
mod dense_kernels;
mod feasibility;
mod filter;
mod formulation;
mod front;
mod inertia_correction;
mod interior_point;
mod kkt;
mod kkt_solver;
mod lazy_solver;
mod line_search;
mod linear_solver;
#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod matrix_tests;
mod multifrontal;
mod newton;
mod null_space;
mod optimality;
mod ordering;
mod problem;
mod schedule;
mod settings;
mod solve;
mod start;
mod status;
mod substitution;
mod supernodal;

pub use problem::{EliminationBlocks, NonlinearProgram, SparsityPattern};
pub use settings::{BarrierStrategy, BoundMultiplierStart, DualRegularisation, LinearSolver, NlpSettings};
pub use solve::solve;
pub use start::{StartPoint, WarmPoint};
pub use status::{Counts, NlpError, NlpIteration, NlpResult, NlpStatus, Phase, Residuals, Timing};
