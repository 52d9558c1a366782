//! A primal-dual interior-point solver for sparse nonlinear programs
//!
//! ```text
//! minimise f(x)  subject to  x_L <= x <= x_U,  g_L <= g(x) <= g_U
//! ```
//!
//! with exact first and second derivatives. The method is the filter line search of Wächter and Biegler, *On the
//! implementation of an interior-point filter line-search algorithm for large-scale nonlinear programming*, Math.
//! Program. 106, 2006, cited as WB06 throughout. A program whose structure is a tree of blocks, such as an optimal
//! control problem on a mesh, can say so ([`EliminationBlocks`]); a multifrontal factorisation then follows the tree,
//! on several threads if asked. The result does not depend on the number of threads.
//!
//! The path of a solve: `solve` -> `formulation` (slacks, fixed variables, scaling) -> `interior_point`, the loop over
//! `optimality`, `barrier_update`, `search_direction` (`inertia_correction`, `newton`, `kkt`, `factorisation`) and
//! `line_search` (`line_search_filter`), with `restoration` where no step is acceptable -> [`NlpResult`].
//!
//! # Example
//!
//! Problem 71 of Hock and Schittkowski:
//!
//! ```
//! use interior_point::{NlpSettings, NlpStatus, NonlinearProgram, SparsityPattern, StartPoint, solve};
//!
//! struct Hs071 {
//!     jacobian: SparsityPattern,
//!     hessian: SparsityPattern,
//! }
//!
//! impl NonlinearProgram for Hs071 {
//!     fn variables(&self) -> usize {
//!         4
//!     }
//!     fn rows(&self) -> usize {
//!         2
//!     }
//!     fn variable_bounds(&self, lower: &mut [f64], upper: &mut [f64]) {
//!         lower.fill(1.0);
//!         upper.fill(5.0);
//!     }
//!     fn row_bounds(&self, lower: &mut [f64], upper: &mut [f64]) {
//!         lower.copy_from_slice(&[25.0, 40.0]);
//!         upper.copy_from_slice(&[f64::INFINITY, 40.0]);
//!     }
//!     fn jacobian_pattern(&self) -> &SparsityPattern {
//!         &self.jacobian
//!     }
//!     fn hessian_pattern(&self) -> &SparsityPattern {
//!         &self.hessian
//!     }
//!     fn objective(&self, x: &[f64]) -> f64 {
//!         x[0] * x[3] * (x[0] + x[1] + x[2]) + x[2]
//!     }
//!     fn gradient(&self, x: &[f64], gradient: &mut [f64]) {
//!         gradient[0] = x[3] * (2.0 * x[0] + x[1] + x[2]);
//!         gradient[1] = x[0] * x[3];
//!         gradient[2] = x[0] * x[3] + 1.0;
//!         gradient[3] = x[0] * (x[0] + x[1] + x[2]);
//!     }
//!     fn constraints(&self, x: &[f64], values: &mut [f64]) {
//!         values[0] = x.iter().product();
//!         values[1] = x.iter().map(|v| v * v).sum();
//!     }
//!     fn jacobian(&self, x: &[f64], values: &mut [f64]) {
//!         let product: f64 = x.iter().product();
//!         for (column, v) in values.chunks_exact_mut(2).zip(x) {
//!             column.copy_from_slice(&[product / v, 2.0 * v]);
//!         }
//!     }
//!     fn hessian(&self, x: &[f64], sigma: f64, y: &[f64], values: &mut [f64]) {
//!         let product: f64 = x.iter().product();
//!         let of_f = [2.0 * x[3], x[3], x[3], 2.0 * x[0] + x[1] + x[2], 0.0, 0.0, x[0], 0.0, x[0], 0.0];
//!         let mut k = 0;
//!         for j in 0..4 {
//!             for i in j..4 {
//!                 let of_rows = if i == j { 2.0 * y[1] } else { y[0] * product / (x[i] * x[j]) };
//!                 values[k] = sigma * of_f[k] + of_rows;
//!                 k += 1;
//!             }
//!         }
//!     }
//! }
//!
//! let dense: Vec<_> = (0..4).flat_map(|j| (0..2).map(move |i| (i, j))).collect();
//! let lower_triangle: Vec<_> = (0..4).flat_map(|j| (j..4).map(move |i| (i, j))).collect();
//! let problem = Hs071 {
//!     jacobian: SparsityPattern::from_entries(2, 4, &dense).0,
//!     hessian: SparsityPattern::from_entries(4, 4, &lower_triangle).0,
//! };
//! let start = StartPoint::Cold(vec![1.0, 5.0, 5.0, 1.0]);
//! let result = solve(&problem, &start, &NlpSettings::default(), &mut |_| {}, &|| false)?;
//! assert_eq!(result.status, NlpStatus::Converged);
//! assert!((result.objective - 17.014_017_3).abs() < 1e-6);
//! # Ok::<(), interior_point::NlpError>(())
//! ```

mod barrier;
mod barrier_update;
mod factorisation;
mod formulation;
mod fraction_to_boundary;
mod inertia_correction;
mod interior_point;
mod iterate;
mod line_search;
mod line_search_filter;
mod line_search_state;
mod method_constants;
mod newton_system;
mod nonlinear_program;
mod optimality;
mod primal_dual;
mod program_checks;
mod restoration;
mod search_direction;
mod sensitivity;
mod settings;
mod solve;
mod starting_point;
mod status;
mod vector_instructions;

#[doc(hidden)]
pub use method_constants::MethodConstants;
pub use nonlinear_program::{EliminationBlocks, NonlinearProgram, SparsityPattern};
pub use sensitivity::{ParameterDerivative, Sensitivity, SensitivityError, sensitivities};
pub use settings::{BarrierStrategy, BoundMultiplierStart, LinearSolver, NlpSettings};
pub use solve::solve;
pub use starting_point::{StartPoint, WarmPoint};
pub use status::{NlpCounts, NlpError, NlpIteration, NlpPhase, NlpResult, NlpStatus, Residuals, Timing};
pub use vector_instructions::vector_instructions;
