//! Small dense linear algebra with a fixed order of operations.
//!
//! Cholesky factors are built row by row, so that appending a row gives the same bits as a new factorisation.

mod kernels;

pub(crate) use kernels::{add_scaled, add_scaled_products, block_dots, dot};

use crate::error::{LearnerError, Result};

/// Number of vectors in a [`Block`].
pub(crate) const BLOCK: usize = kernels::LANES;

/// [`BLOCK`] vectors stored side by side.
pub(crate) type Block = Vec<[f64; BLOCK]>;

/// A square matrix, row-major.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Square {
    n: usize,
    data: Vec<f64>,
}

impl Square {
    pub(crate) fn zeros(n: usize) -> Self {
        Self { n, data: vec![0.0; n * n] }
    }

    pub(crate) fn from_fn(n: usize, f: impl Fn(usize, usize) -> f64) -> Self {
        let mut matrix = Self::zeros(n);
        for i in 0..n {
            for j in 0..n {
                matrix.data[i * n + j] = f(i, j);
            }
        }
        matrix
    }

    pub(crate) fn order(&self) -> usize {
        self.n
    }

    pub(crate) fn at(&self, i: usize, j: usize) -> f64 {
        self.data[i * self.n + j]
    }

    pub(crate) fn row(&self, i: usize) -> &[f64] {
        &self.data[i * self.n..(i + 1) * self.n]
    }

    pub(crate) fn row_mut(&mut self, i: usize) -> &mut [f64] {
        &mut self.data[i * self.n..(i + 1) * self.n]
    }

    /// The matrix plus a multiple of the identity.
    pub(crate) fn ridged(&self, ridge: f64) -> Self {
        let mut ridged = self.clone();
        for i in 0..self.n {
            ridged.data[i * self.n + i] += ridge;
        }
        ridged
    }

    /// `A x`.
    pub(crate) fn multiply(&self, x: &[f64]) -> Vec<f64> {
        let mut y = vec![0.0; self.n];
        kernels::multiply(&self.data, x, &mut y);
        y
    }

    /// `A X`.
    pub(crate) fn multiply_block(&self, x: &[[f64; BLOCK]]) -> Block {
        let mut y = vec![[0.0; BLOCK]; self.n];
        kernels::multiply_block(&self.data, x, &mut y);
        y
    }

    /// `A += sum_k a_k x_k x_k'`.
    pub(crate) fn add_rank_ones(&mut self, changes: &[(f64, Vec<f64>)]) {
        kernels::add_rank_ones(&mut self.data, changes, self.n);
    }

    /// `A A'`.
    pub(crate) fn outer_product(&self) -> Self {
        let mut product = Self::zeros(self.n);
        kernels::outer_product(&self.data, &mut product.data, self.n);
        product
    }
}

/// The Cholesky factor `L` of `A = L L'`, its rows packed one after the other.
#[derive(Debug, Clone, Default)]
pub(crate) struct Cholesky {
    n: usize,
    packed: Vec<f64>,
}

impl Cholesky {
    /// Factors a symmetric positive definite matrix. Reads its lower triangle only.
    ///
    /// # Errors
    /// If a pivot is not positive.
    pub(crate) fn new(matrix: &Square) -> Result<Self> {
        let mut factor = Self::default();
        factor.packed.reserve(matrix.order() * (matrix.order() + 1) / 2);
        for i in 0..matrix.order() {
            factor.append(&matrix.row(i)[..=i])?;
        }
        Ok(factor)
    }

    /// Appends a row of the matrix up to its diagonal.
    ///
    /// # Errors
    /// If the pivot is not positive; the factor stays as it was.
    pub(crate) fn append(&mut self, row: &[f64]) -> Result<()> {
        let n = self.n;
        let start = self.packed.len();
        self.packed.extend_from_slice(row);
        let (done, new) = self.packed.split_at_mut(start);
        let pivot = kernels::append_row(done, new);
        if !(pivot > 0.0 && pivot.is_finite()) {
            self.packed.truncate(start);
            return Err(LearnerError::Numerical(format!(
                "a covariance matrix is not positive definite: pivot {n} is {pivot:e}"
            )));
        }
        new[n] = pivot.sqrt();
        self.n += 1;
        Ok(())
    }

    pub(crate) fn order(&self) -> usize {
        self.n
    }

    /// Row `i` up to its diagonal.
    pub(crate) fn row(&self, i: usize) -> &[f64] {
        &self.packed[i * (i + 1) / 2..(i + 1) * (i + 2) / 2]
    }

    /// `L x`.
    pub(crate) fn multiply(&self, x: &[f64]) -> Vec<f64> {
        let mut y = vec![0.0; x.len()];
        kernels::lower_multiply(&self.packed, x, &mut y);
        y
    }

    /// `L' x`.
    pub(crate) fn multiply_transposed(&self, x: &[f64]) -> Vec<f64> {
        let mut y = vec![0.0; x.len()];
        kernels::upper_multiply(&self.packed, x, &mut y);
        y
    }

    /// Solves `L x = b` in place.
    pub(crate) fn solve_lower(&self, x: &mut [f64]) {
        kernels::forward(&self.packed, x);
    }

    /// Solves `L' x = b` in place.
    pub(crate) fn solve_upper(&self, x: &mut [f64]) {
        kernels::backward(&self.packed, x);
    }

    /// Solves `A x = b` in place.
    pub(crate) fn solve(&self, x: &mut [f64]) {
        self.solve_lower(x);
        self.solve_upper(x);
    }

    /// Solves `L X = B` in place.
    pub(crate) fn solve_lower_block(&self, x: &mut [[f64; BLOCK]]) {
        kernels::forward_block(&self.packed, x);
    }

    /// Solves `L' X = B` in place.
    pub(crate) fn solve_upper_block(&self, x: &mut [[f64; BLOCK]]) {
        kernels::backward_block(&self.packed, x);
    }

    /// Lower triangle of `I + L' P`.
    pub(crate) fn identity_plus_transposed_product(&self, p: &Square) -> Square {
        let mut result = Square::zeros(self.n);
        kernels::add_lower_product(&self.packed, &p.data, &mut result.data, self.n);
        for i in 0..self.n {
            result.row_mut(i)[i] += 1.0;
        }
        result
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn matrix(n: usize) -> Square {
        Square::from_fn(n, |i, j| (-0.1 * (i as f64 - j as f64).powi(2)).exp() + if i == j { 0.1 } else { 0.0 })
    }

    #[test]
    fn cholesky_factor_reproduces_its_matrix() {
        let n = 43;
        let matrix = matrix(n);
        let factor = Cholesky::new(&matrix).unwrap();
        let x: Vec<f64> = (0..n).map(|i| (i as f64).sin()).collect();
        let product = factor.multiply(&factor.multiply_transposed(&x));
        for (p, q) in product.iter().zip(matrix.multiply(&x)) {
            assert!((p - q).abs() < 1e-12);
        }
        let mut back = product.clone();
        factor.solve(&mut back);
        assert!(back.iter().zip(&x).all(|(a, b)| (a - b).abs() < 1e-10));
        let mut block: Block = product.iter().map(|&p| [p; BLOCK]).collect();
        factor.solve_lower_block(&mut block);
        factor.solve_upper_block(&mut block);
        assert!(block.iter().zip(&x).all(|(a, b)| (a[3] - b).abs() < 1e-10));
        assert!(Cholesky::new(&Square::from_fn(2, |_, _| 1.0)).is_err());
    }

    #[test]
    fn appending_rows_gives_the_bits_of_a_new_factorisation() {
        let whole = Cholesky::new(&matrix(50)).unwrap();
        let mut grown = Cholesky::new(&Square::from_fn(20, |i, j| matrix(50).at(i, j))).unwrap();
        for i in 20..50 {
            grown.append(&matrix(50).row(i)[..=i]).unwrap();
        }
        assert_eq!(whole.packed, grown.packed);
    }
}
