//! A general sparse nonlinear-programming solver. It knows nothing of walking.
//!
//! minimise f(x) subject to x_L <= x <= x_U and g_L <= g(x) <= g_U, with exact sparse derivatives, by a primal-dual
//! interior point with a filter line search (Wächter & Biegler, Math. Program. 106, 2006). The path of a solve:
//!
//! `solve` -> `formulation` (slacks, fixed variables, scaling) -> `interior_point` { `optimality`, `barrier`,
//! `inertia_correction`, `newton` (assembly in `kkt`, `factorisation`), `line_search` with `filter`, and `restoration` when the line search fails } -> `status::NlpResult`.

mod barrier;
mod factorisation;
mod filter;
mod formulation;
mod inertia_correction;
mod interior_point;
mod kkt;
mod line_search;
mod newton;
mod optimality;
mod problem;
mod restoration;
mod settings;
mod solve;
mod start;
mod status;

pub use problem::{EliminationBlocks, NonlinearProgram, SparsityPattern};
pub use settings::{BarrierStrategy, BoundMultiplierStart, DualRegularisation, LinearSolver, NlpSettings};
pub use solve::solve;
pub use start::{StartPoint, WarmPoint};
pub use status::{Counts, NlpError, NlpIteration, NlpResult, NlpStatus, Phase, Residuals, Timing};
