//! Factorisations of the KKT matrix behind one trait (`kkt_solver`), chosen by structure and setting in
//! `linear_solver`.
//!
//! `multifrontal` uses `symbolic_analysis`, `front`, `null_space`, `bunch_kaufman` and `substitution`; `schedule` and
//! `thread_pool` distribute its work over threads. `supernodal` is that of faer. `delayed_pivots` is the slowest and
//! most reliable. Fallbacks are analysed on first use (`lazy_solver`).

mod aligned;
mod block_columns;
mod bunch_kaufman;
mod delayed_pivots;
mod dense_kernels;
mod front;
mod front_factor;
mod kkt_matrix;
mod kkt_solver;
mod lazy_solver;
mod linear_solver;
#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod matrix_tests;
mod multifrontal;
mod null_space;
mod ordering;
mod schedule;
mod substitution;
#[cfg(feature = "supernodal")]
mod supernodal;
mod symbolic_analysis;
mod thread_pool;

pub(crate) use dense_kernels::{all_finite, largest_magnitude};
pub(crate) use kkt_matrix::KktMatrix;
pub(crate) use kkt_solver::{Inertia, KktSolver, MatrixChange};
pub(crate) use linear_solver::choose;
pub(crate) use ordering::check_blocks;
