//! Small dense linear algebra whose every operation has one fixed order.
//!
//! Sums run in sixteen interleaved partial sums and every product is fused into its addition, whatever the width of
//! the machine's vectors: equal inputs give equal bits on any machine. `pulp` compiles the kernels for the vector
//! units found at run time. Factors are built row by row, so that appending a point gives the same bits as starting
//! again with it.

#![allow(clippy::inline_always, reason = "a kernel is compiled for the vector unit of the function it is inlined into")]

use pulp::Arch;

use crate::error::{LearnerError, Result};

/// Number of interleaved partial sums of an inner product.
const LANES: usize = 16;

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

    /// The matrix with `extra` rows and columns of zeros added.
    pub(crate) fn grown(&self, extra: usize) -> Self {
        let mut grown = Self::zeros(self.n + extra);
        for i in 0..self.n {
            grown.row_mut(i)[..self.n].copy_from_slice(self.row(i));
        }
        grown
    }

    /// `A x`.
    pub(crate) fn multiply(&self, x: &[f64]) -> Vec<f64> {
        Arch::new().dispatch(|| (0..self.n).map(|i| dot_inline(self.row(i), x)).collect())
    }

    /// `A += a x x'`.
    pub(crate) fn add_rank_one(&mut self, a: f64, x: &[f64]) {
        let n = self.n;
        Arch::new().dispatch(|| {
            for (row, &xi) in self.data.chunks_exact_mut(n.max(1)).zip(x) {
                add_scaled_inline(row, a * xi, x);
            }
        });
    }
}

#[inline(always)]
fn dot_inline(a: &[f64], b: &[f64]) -> f64 {
    let n = a.len().min(b.len());
    let (a, b) = (&a[..n], &b[..n]);
    let mut sums = [0.0_f64; LANES];
    let (a_chunks, b_chunks) = (a.chunks_exact(LANES), b.chunks_exact(LANES));
    let (a_rest, b_rest) = (a_chunks.remainder(), b_chunks.remainder());
    for (x, y) in a_chunks.zip(b_chunks) {
        for k in 0..LANES {
            sums[k] = x[k].mul_add(y[k], sums[k]);
        }
    }
    for (k, (x, y)) in a_rest.iter().zip(b_rest).enumerate() {
        sums[k] = x.mul_add(*y, sums[k]);
    }
    let mut width = LANES / 2;
    while width > 0 {
        for k in 0..width {
            sums[k] += sums[k + width];
        }
        width /= 2;
    }
    sums[0]
}

#[inline(always)]
fn add_scaled_inline(y: &mut [f64], a: f64, x: &[f64]) {
    for (y, x) in y.iter_mut().zip(x) {
        *y = a.mul_add(*x, *y);
    }
}

/// Inner product.
pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    Arch::new().dispatch(|| dot_inline(a, b))
}

/// Inner products of `a` with two vectors.
#[inline(always)]
pub(crate) fn dots_inline(a: &[f64], b: &[f64], c: &[f64]) -> (f64, f64) {
    (dot_inline(a, b), dot_inline(a, c))
}

/// `y += a x`.
pub(crate) fn add_scaled(y: &mut [f64], a: f64, x: &[f64]) {
    Arch::new().dispatch(|| add_scaled_inline(y, a, x));
}

/// A lower triangular factor `L` with `A = L L^T`, rows packed one after the other.
#[derive(Debug, Clone, Default)]
pub(crate) struct Cholesky {
    n: usize,
    packed: Vec<f64>,
}

impl Cholesky {
    /// Factors a symmetric positive definite matrix, of which the lower triangle is read.
    pub(crate) fn new(matrix: &Square) -> Result<Self> {
        let mut factor = Self::default();
        factor.packed.reserve(matrix.order() * (matrix.order() + 1) / 2);
        for i in 0..matrix.order() {
            factor.append(&matrix.row(i)[..=i])?;
        }
        Ok(factor)
    }

    /// Appends a row of the matrix: its covariances with the earlier ones, then its variance.
    pub(crate) fn append(&mut self, row: &[f64]) -> Result<()> {
        let n = self.n;
        let mut new = row.to_vec();
        let pivot = Arch::new().dispatch(|| {
            forward(&self.packed, &mut new[..n]);
            new[n] - dot_inline(&new[..n], &new[..n])
        });
        if !(pivot > 0.0 && pivot.is_finite()) {
            return Err(LearnerError::Numerical(format!("pivot {n} of a covariance is {pivot:e}")));
        }
        new[n] = pivot.sqrt();
        self.packed.extend_from_slice(&new);
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

    /// `ln det A`.
    pub(crate) fn ln_determinant(&self) -> f64 {
        (0..self.n).map(|i| 2.0 * crate::math::ln(self.row(i)[i])).sum()
    }

    /// `L x`.
    pub(crate) fn multiply(&self, x: &[f64]) -> Vec<f64> {
        Arch::new().dispatch(|| (0..x.len()).map(|i| dot_inline(self.row(i), &x[..=i])).collect())
    }

    /// `L^T x`.
    pub(crate) fn multiply_transposed(&self, x: &[f64]) -> Vec<f64> {
        let mut y = vec![0.0; x.len()];
        Arch::new().dispatch(|| {
            for (i, &xi) in x.iter().enumerate() {
                add_scaled_inline(&mut y[..=i], xi, self.row(i));
            }
        });
        y
    }

    /// Solves `L x = b` in place.
    pub(crate) fn solve_lower(&self, x: &mut [f64]) {
        Arch::new().dispatch(|| forward(&self.packed, x));
    }

    /// Solves `L^T x = b` in place.
    pub(crate) fn solve_upper(&self, x: &mut [f64]) {
        Arch::new().dispatch(|| {
            for i in (0..x.len()).rev() {
                let row = self.row(i);
                let xi = x[i] / row[i];
                x[i] = xi;
                add_scaled_inline(&mut x[..i], -xi, &row[..i]);
            }
        });
    }

    /// Solves `A x = b` in place.
    pub(crate) fn solve(&self, x: &mut [f64]) {
        self.solve_lower(x);
        self.solve_upper(x);
    }

    /// Solves `L X = B` in place for [`LANES`] right-hand sides stored side by side.
    pub(crate) fn solve_lower_many(&self, x: &mut [[f64; LANES]]) {
        Arch::new().dispatch(|| {
            for i in 0..x.len() {
                let row = self.row(i);
                let (done, current) = x.split_at_mut(i);
                let mut sums = current[0];
                for (l, d) in row[..i].iter().zip(done.iter()) {
                    for k in 0..LANES {
                        sums[k] = (-l).mul_add(d[k], sums[k]);
                    }
                }
                for k in 0..LANES {
                    current[0][k] = sums[k] / row[i];
                }
            }
        });
    }

    /// Solves `L^T X = B` in place for [`LANES`] right-hand sides stored side by side.
    pub(crate) fn solve_upper_many(&self, x: &mut [[f64; LANES]]) {
        Arch::new().dispatch(|| {
            for i in (0..x.len()).rev() {
                let row = self.row(i);
                let (done, current) = x.split_at_mut(i);
                for k in 0..LANES {
                    current[0][k] /= row[i];
                }
                let xi = current[0];
                for (l, d) in row[..i].iter().zip(done.iter_mut()) {
                    for k in 0..LANES {
                        d[k] = (-l).mul_add(xi[k], d[k]);
                    }
                }
            }
        });
    }
}

#[inline(always)]
fn forward(packed: &[f64], x: &mut [f64]) {
    let mut start = 0;
    for i in 0..x.len() {
        let row = &packed[start..=start + i];
        x[i] = (x[i] - dot_inline(&row[..i], &x[..i])) / row[i];
        start += i + 1;
    }
}

/// A block of [`LANES`] vectors stored side by side.
pub(crate) type Block = Vec<[f64; LANES]>;

/// Number of vectors in a [`Block`].
pub(crate) const BLOCK: usize = LANES;

/// Inner products, vector by vector, of two blocks.
pub(crate) fn block_dots(a: &[[f64; LANES]], b: &[[f64; LANES]]) -> [f64; LANES] {
    Arch::new().dispatch(|| {
        let mut sums = [0.0_f64; LANES];
        for (x, y) in a.iter().zip(b) {
            for k in 0..LANES {
                sums[k] = x[k].mul_add(y[k], sums[k]);
            }
        }
        sums
    })
}

/// `A X` for a block.
pub(crate) fn block_multiply(a: &Square, x: &[[f64; LANES]]) -> Block {
    Arch::new().dispatch(|| {
        (0..a.order())
            .map(|i| {
                let mut sums = [0.0_f64; LANES];
                for (&l, d) in a.row(i).iter().zip(x) {
                    for k in 0..LANES {
                        sums[k] = l.mul_add(d[k], sums[k]);
                    }
                }
                sums
            })
            .collect()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn matrix(n: usize) -> Square {
        Square::from_fn(n, |i, j| (-0.1 * (i as f64 - j as f64).powi(2)).exp() + if i == j { 0.1 } else { 0.0 })
    }

    #[test]
    fn a_factor_reproduces_its_matrix() {
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
        factor.solve_lower_many(&mut block);
        factor.solve_upper_many(&mut block);
        assert!(block.iter().zip(&x).all(|(a, b)| (a[3] - b).abs() < 1e-10));
        assert!(Cholesky::new(&Square::from_fn(2, |_, _| 1.0)).is_err());
    }

    #[test]
    fn appending_gives_the_bits_of_starting_again() {
        let whole = Cholesky::new(&matrix(50)).unwrap();
        let mut grown = Cholesky::new(&Square::from_fn(20, |i, j| matrix(50).at(i, j))).unwrap();
        for i in 20..50 {
            grown.append(&matrix(50).row(i)[..=i]).unwrap();
        }
        assert_eq!(whole.packed, grown.packed);
    }
}
