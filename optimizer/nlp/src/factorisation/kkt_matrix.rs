//! Assembly of the reduced KKT matrix, order n + m, lower triangle in compressed columns:
//!
//! ```text
//! [ H + diag(d)      J^T     ]
//! [     J        -diag(e)    ]
//! ```
//!
//! d: barrier terms, proximal curvature and delta_w of x; e: the eliminated row variables and delta_c of a row,
//! e_i = sum_k a_k^2 / d_k + delta_c.

use super::dense_kernels::all_finite;
use crate::formulation::{Formulation, RowForm, entries};

/// Pattern and values, with the position of each part.
#[derive(Debug, Clone)]
pub(crate) struct KktMatrix {
    pub order: usize,
    pub column_starts: Vec<usize>,
    pub row_indices: Vec<usize>,
    pub values: Vec<f64>,
    hessian_position: Vec<usize>,
    jacobian_position: Vec<usize>,
    diagonal_position: Vec<usize>,
    /// The Hessian's part of the diagonal of x.
    hessian_diagonal: Vec<f64>,
    /// Whether all derivatives are finite.
    finite: bool,
}

impl KktMatrix {
    /// The pattern: Hessian, Jacobian and the full diagonal.
    pub(crate) fn new(form: &Formulation) -> Self {
        let (n, order) = (form.n, form.n + form.m);
        let hessian = form.program.hessian_pattern();
        let jacobian = form.program.jacobian_pattern();
        let mut column_starts = vec![0];
        let mut row_indices = Vec::new();
        let mut hessian_position = vec![0; hessian.row_indices.len()];
        let mut jacobian_position = vec![0; jacobian.row_indices.len()];
        let mut diagonal_position = vec![0; order];
        for j in 0..n {
            diagonal_position[j] = row_indices.len();
            row_indices.push(j);
            for q in hessian.column_starts[j]..hessian.column_starts[j + 1] {
                let i = hessian.row_indices[q];
                if i == j {
                    hessian_position[q] = diagonal_position[j];
                } else {
                    hessian_position[q] = row_indices.len();
                    row_indices.push(i);
                }
            }
            for q in jacobian.column_starts[j]..jacobian.column_starts[j + 1] {
                jacobian_position[q] = row_indices.len();
                row_indices.push(n + jacobian.row_indices[q]);
            }
            column_starts.push(row_indices.len());
        }
        for i in n..order {
            diagonal_position[i] = row_indices.len();
            row_indices.push(i);
            column_starts.push(row_indices.len());
        }
        let values = vec![0.0; row_indices.len()];
        Self {
            order,
            column_starts,
            row_indices,
            values,
            hessian_position,
            jacobian_position,
            diagonal_position,
            hessian_diagonal: vec![0.0; n],
            finite: true,
        }
    }

    /// Fills in the derivatives.
    pub(crate) fn assemble(&mut self, hessian: Option<&[f64]>, jacobian: &[f64]) {
        let values = &mut self.values;
        values.fill(0.0);
        if let Some(hessian) = hessian {
            for (v, &q) in hessian.iter().zip(&self.hessian_position) {
                values[q] = *v;
            }
        }
        for (v, &q) in jacobian.iter().zip(&self.jacobian_position) {
            values[q] = *v;
        }
        self.finite = all_finite(values);
        for (v, &q) in self.hessian_diagonal.iter_mut().zip(&self.diagonal_position) {
            *v = values[q];
        }
    }

    /// Sets the diagonal of the assembled matrix. `diagonal` has the length of w and is positive for row variables.
    /// Returns whether all values are finite.
    pub(crate) fn set_diagonal(&mut self, form: &Formulation, diagonal: &[f64], delta_c: f64) -> bool {
        let values = &mut self.values;
        let (of_x, of_rows) = self.diagonal_position.split_at(form.n);
        for (((h, d), fixed), &q) in self.hessian_diagonal.iter().zip(diagonal).zip(&form.fixed).zip(of_x) {
            values[q] = h + if fixed.is_some() { 1.0 } else { *d };
        }
        for (row, &q) in form.rows.iter().zip(of_rows) {
            values[q] = if *row == RowForm::Free { -1.0 } else { -delta_c };
        }
        for (a, d) in form.row_variables.iter().zip(&diagonal[form.n..]) {
            values[of_rows[a.row]] -= 1.0 / d;
        }
        self.finite && self.diagonal_position.iter().all(|&q| values[q].is_finite())
    }
}

/// Couplings (row, column) of the KKT matrix, for the check of elimination blocks.
pub(crate) fn couplings<'a>(form: &'a Formulation) -> impl Iterator<Item = (usize, usize)> + 'a {
    let n = form.n;
    let hessian = entries(form.program.hessian_pattern()).map(|(_, i, j)| (i, j));
    hessian.chain(entries(form.program.jacobian_pattern()).map(move |(_, i, j)| (n + i, j)))
}
