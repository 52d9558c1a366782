//! Quantities of all actions at once.
//!
//! The covariances of the whole grid with the points are never stored: the dimensions are cut in two halves, and each
//! covariance is a product (or two) of a number of the left half and a number of the right half.

use crate::belief::Belief;
use crate::linalg::{BLOCK, Block, multiply_two};
use crate::space::{ActionIndex, SearchSpace};

/// The grid seen from a belief's points.
pub(crate) struct Grid<'a> {
    belief: &'a Belief,
    left: Half,
    right: Half,
}

/// Covariance terms of the levels of some of the dimensions with the points.
struct Half {
    count: usize,
    /// Per combination of levels: product terms of all points, then, where the kernel has them, the other ones.
    coupled: Vec<f64>,
    separate: Vec<f64>,
}

impl Half {
    fn row(&self, i: usize) -> &[f64] {
        let width = self.coupled.len() / self.count.max(1);
        &self.coupled[i * width..(i + 1) * width]
    }

    fn new(belief: &Belief, shape: &[usize], from: usize, to: usize, left: bool) -> Self {
        let model = belief.model();
        let points = model.points.len();
        let pure = belief.kernel.is_product();
        let count: usize = shape[from..to].iter().product();
        let width = if pure { points } else { 2 * points };
        let mut coupled = vec![0.0; count * width];
        let mut separate = vec![0.0; if pure { 0 } else { count * points }];
        let mut levels = vec![0; to - from];
        for i in 0..count {
            let mut rest = i;
            for (level, &n) in levels.iter_mut().zip(&shape[from..to]).rev() {
                *level = rest % n;
                rest /= n;
            }
            for (p, point) in model.levels.iter().enumerate() {
                let symmetric = belief.kernel.symmetric(from, &levels, &point[from..to]);
                let (pair, alone) = belief.kernel.split(symmetric, left);
                coupled[i * width + p] = pair[0];
                if !pure {
                    coupled[i * width + points + p] = pair[1];
                    separate[i * points + p] = alone;
                }
            }
        }
        Self { count, coupled, separate }
    }

    /// Inner products of the separate terms with a vector.
    fn separate_forms(&self, weights: &[f64]) -> Vec<f64> {
        if self.separate.is_empty() {
            return vec![0.0; self.count];
        }
        self.separate.chunks_exact(weights.len()).map(|row| crate::linalg::dot(row, weights)).collect()
    }
}

impl<'a> Grid<'a> {
    pub(crate) fn new(space: &SearchSpace, belief: &'a Belief) -> Self {
        let shape = space.shape();
        // The cut that makes the larger half smallest.
        let cut = (0..=shape.len())
            .min_by_key(|&cut| shape[..cut].iter().product::<usize>().max(shape[cut..].iter().product()))
            .unwrap_or(0);
        let left = Half::new(belief, &shape, 0, cut, true);
        let right = Half::new(belief, &shape, cut, shape.len(), false);
        Self { belief, left, right }
    }

    /// `k(x, points) . a` and `k(x, points) . b` for every action.
    pub(crate) fn forms(&self, a: &[f64], b: &[f64]) -> (Vec<f64>, Vec<f64>) {
        let (rows, columns) = (self.left.count, self.right.count);
        let mut results = (vec![0.0; rows * columns], vec![0.0; rows * columns]);
        let separate = |half: &Half| (half.separate_forms(a), half.separate_forms(b));
        let (left_alone, right_alone) = (separate(&self.left), separate(&self.right));
        let points = a.len();
        if points == 0 {
            return results;
        }
        for y in 0..rows {
            let row = self.left.row(y);
            let with_a: Vec<f64> = row.iter().enumerate().map(|(i, u)| u * a[i % points]).collect();
            let with_b: Vec<f64> = row.iter().enumerate().map(|(i, u)| u * b[i % points]).collect();
            let range = y * columns..(y + 1) * columns;
            let (into_a, into_b) = (&mut results.0[range.clone()], &mut results.1[range]);
            multiply_two(&self.right.coupled, &with_a, &with_b, into_a, into_b);
            if !self.left.separate.is_empty() {
                for z in 0..columns {
                    into_a[z] += left_alone.0[y] + right_alone.0[z];
                    into_b[z] += left_alone.1[y] + right_alone.1[z];
                }
            }
        }
        results
    }

    /// Prior covariances of every action with one.
    pub(crate) fn prior_with(&self, space: &SearchSpace, action: ActionIndex) -> Vec<f64> {
        let shape = space.shape();
        let target = space.levels(action);
        let mut levels = vec![0; shape.len()];
        let mut covariances = Vec::with_capacity(self.left.count * self.right.count);
        for _ in 0..self.left.count * self.right.count {
            covariances.push(self.belief.kernel.covariance(&levels, &target));
            for (level, &n) in levels.iter_mut().zip(&shape).rev() {
                *level += 1;
                if *level < n {
                    break;
                }
                *level = 0;
            }
        }
        covariances
    }

    /// Covariances of an action with the points.
    fn column(&self, action: usize, into: &mut [[f64; BLOCK]], lane: usize) {
        let (y, z) = (action / self.right.count, action % self.right.count);
        let (u, w) = (self.left.row(y), self.right.row(z));
        let points = into.len();
        for i in 0..points {
            into[i][lane] = u[i] * w[i];
        }
        if !self.left.separate.is_empty() {
            let alone_y = &self.left.separate[y * points..];
            let alone_z = &self.right.separate[z * points..];
            for i in 0..points {
                into[i][lane] += u[points + i] * w[points + i] + alone_y[i] + alone_z[i];
            }
        }
    }

    /// Posterior variances of a few actions that are not points.
    pub(crate) fn variances(&self, actions: &[usize]) -> Vec<f64> {
        let model = self.belief.model();
        let total = self.belief.kernel.variance;
        let mut variances = Vec::with_capacity(actions.len());
        for chunk in actions.chunks(BLOCK) {
            let mut block: Block = vec![[0.0; BLOCK]; model.points.len()];
            for (lane, &action) in chunk.iter().enumerate() {
                self.column(action, &mut block, lane);
            }
            model.prior.solve_lower_block(&mut block);
            let explained = crate::linalg::block_dots(&block, &block);
            let kept = self.belief.approximation().block_variances(&model.prior, block);
            variances.extend((0..chunk.len()).map(|lane| (total - explained[lane] + kept[lane]).max(0.0)));
        }
        variances
    }
}
