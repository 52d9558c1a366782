//! Factorisations of the KKT matrix behind one trait (`kkt_solver`), chosen by structure and setting in `linear_solver`:
//! `multifrontal` (`front`, `null_space`, `bunch_kaufman`, `substitution`; `schedule` and `thread_pool` share the work among threads), `supernodal` (faer) and
//! `delayed_pivots`, the most trusted; fallbacks are analysed when they are needed (`lazy_solver`).

mod aligned;
mod block_columns;
mod bunch_kaufman;
mod delayed_pivots;
mod dense_kernels;
mod front;
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
mod supernodal;
mod thread_pool;

pub(super) use dense_kernels::{all_finite, largest_magnitude};
pub(super) use kkt_solver::{Change, Inertia, KktSolver};
pub(super) use linear_solver::choose;
pub(super) use ordering::check_blocks;
