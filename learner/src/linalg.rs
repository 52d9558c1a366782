//! Small dense linear algebra whose every operation has one fixed order: equal inputs give equal bits on any machine.

use crate::error::{LearnerError, Result};

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
}

/// Inner product in eight interleaved partial sums.
pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut sums = [0.0; 8];
    let (a8, b8) = (a.chunks_exact(8), b.chunks_exact(8));
    let rest: f64 = a8.remainder().iter().zip(b8.remainder()).map(|(x, y)| x * y).sum();
    for (x, y) in a8.zip(b8) {
        for k in 0..8 {
            sums[k] += x[k] * y[k];
        }
    }
    ((sums[0] + sums[4]) + (sums[2] + sums[6])) + ((sums[1] + sums[5]) + (sums[3] + sums[7])) + rest
}

/// `y += a x`.
pub(crate) fn add_scaled(y: &mut [f64], a: f64, x: &[f64]) {
    for (y, x) in y.iter_mut().zip(x) {
        *y += a * x;
    }
}

/// A lower triangular factor `L` with `A = L L^T`.
#[derive(Debug, Clone)]
pub(crate) struct Cholesky {
    factor: Square,
}

impl Cholesky {
    /// Factors a symmetric positive definite matrix, of which the lower triangle is read.
    pub(crate) fn new(matrix: &Square) -> Result<Self> {
        let n = matrix.order();
        let mut factor = Square::zeros(n);
        for i in 0..n {
            let (done, current) = factor.data.split_at_mut(i * n);
            for j in 0..i {
                let row = &done[j * n..j * n + n];
                current[j] = (matrix.at(i, j) - dot(&row[..j], &current[..j])) / row[j];
            }
            let pivot = matrix.at(i, i) - dot(&current[..i], &current[..i]);
            if !(pivot > 0.0 && pivot.is_finite()) {
                return Err(LearnerError::Numerical(format!("pivot {i} of {n} of a covariance is {pivot:e}")));
            }
            current[i] = pivot.sqrt();
        }
        Ok(Self { factor })
    }

    pub(crate) fn lower(&self) -> &Square {
        &self.factor
    }

    /// `L x`.
    pub(crate) fn multiply(&self, x: &[f64]) -> Vec<f64> {
        (0..x.len()).map(|i| dot(&self.factor.row(i)[..=i], &x[..=i])).collect()
    }

    /// `L^T x`.
    pub(crate) fn multiply_transposed(&self, x: &[f64]) -> Vec<f64> {
        let mut y = vec![0.0; x.len()];
        for (i, &xi) in x.iter().enumerate() {
            add_scaled(&mut y[..=i], xi, &self.factor.row(i)[..=i]);
        }
        y
    }

    /// Solves `L x = b` in place.
    pub(crate) fn solve_lower(&self, x: &mut [f64]) {
        for i in 0..x.len() {
            let row = self.factor.row(i);
            x[i] = (x[i] - dot(&row[..i], &x[..i])) / row[i];
        }
    }

    /// Solves `L^T x = b` in place.
    pub(crate) fn solve_upper(&self, x: &mut [f64]) {
        for i in (0..x.len()).rev() {
            let row = self.factor.row(i);
            let xi = x[i] / row[i];
            x[i] = xi;
            add_scaled(&mut x[..i], -xi, &row[..i]);
        }
    }

    /// Solves `A x = b` in place.
    pub(crate) fn solve(&self, x: &mut [f64]) {
        self.solve_lower(x);
        self.solve_upper(x);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_factor_reproduces_its_matrix() {
        let n = 23;
        let matrix =
            Square::from_fn(n, |i, j| (-0.1 * (i as f64 - j as f64).powi(2)).exp() + if i == j { 0.1 } else { 0.0 });
        let factor = Cholesky::new(&matrix).unwrap();
        let x: Vec<f64> = (0..n).map(|i| (i as f64).sin()).collect();
        let product = factor.multiply(&factor.multiply_transposed(&x));
        for i in 0..n {
            assert!((product[i] - dot(matrix.row(i), &x)).abs() < 1e-12);
        }
        let mut back = product;
        factor.solve(&mut back);
        assert!(back.iter().zip(&x).all(|(a, b)| (a - b).abs() < 1e-10));
        assert!(Cholesky::new(&Square::from_fn(2, |_, _| 1.0)).is_err());
    }
}
