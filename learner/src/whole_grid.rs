//! Means, covariances and variances of all `N` actions at once.
//!
//! The `N x n` covariances with the points are never stored. The dimensions are divided into a left and a right half; a
//! covariance is a short sum of products of one number from each half (`Kernel::split`).

use crate::action::ActionIndex;
use crate::gaussian_process::GaussianProcess;
use crate::linalg::{BLOCK, Block, add_scaled, add_scaled_products};
use crate::search_space::SearchSpace;

/// A whole grid under a Gaussian process.
pub(crate) struct WholeGrid<'a> {
    process: &'a GaussianProcess,
    cut: usize,
    left: Half,
    right: Half,
}

/// Covariance terms of all combinations of levels of one half with the points, point by point.
struct Half {
    /// Number of combinations of levels.
    count: usize,
    /// Coupled terms of [`Kernel::split`](crate::kernel::Kernel::split): all first ones, then, if the kernel has them,
    /// all second ones.
    coupled: Vec<f64>,
    /// Separate terms, if the kernel has them.
    separate: Vec<f64>,
}

impl Half {
    fn new(process: &GaussianProcess, shape: &[usize], from: usize, to: usize, left: bool) -> Self {
        let points = &process.observed().levels;
        let pure = process.kernel.is_product();
        let count: usize = shape[from..to].iter().product();
        let mut coupled = Vec::with_capacity(count * points.len() * if pure { 1 } else { 2 });
        let (mut others, mut separate) = (Vec::new(), Vec::new());
        if pure {
            let mut products = Vec::with_capacity(count);
            for point in points {
                process.kernel.products(from, &point[from..to], left, &mut products);
                coupled.extend_from_slice(&products);
            }
            return Self { count, coupled, separate };
        }
        for point in points {
            for symmetric in process.kernel.combinations(from, &point[from..to]) {
                let (pair, alone) = process.kernel.split(symmetric, left);
                coupled.push(pair[0]);
                others.push(pair[1]);
                separate.push(alone);
            }
        }
        coupled.append(&mut others);
        Self { count, coupled, separate }
    }

    /// Weighted sum of the separate terms over the points.
    fn separate_form(&self, weights: &[f64]) -> Vec<f64> {
        let mut form = vec![0.0; self.count];
        for (terms, &weight) in self.separate.chunks_exact(self.count.max(1)).zip(weights) {
            add_scaled(&mut form, weight, terms);
        }
        form
    }
}

impl<'a> WholeGrid<'a> {
    pub(crate) fn new(space: &SearchSpace, process: &'a GaussianProcess) -> Self {
        let shape = space.shape();
        // The cut that minimises the larger half.
        let cut = (0..=shape.len())
            .min_by_key(|&cut| shape[..cut].iter().product::<usize>().max(shape[cut..].iter().product()))
            .unwrap_or(0);
        let left = Half::new(process, &shape, 0, cut, true);
        let right = Half::new(process, &shape, cut, shape.len(), false);
        Self { process, cut, left, right }
    }

    /// `k(x, points) . weights` for every action `x`.
    pub(crate) fn form(&self, weights: &[f64]) -> Vec<f64> {
        let (rows, columns) = (self.left.count, self.right.count);
        let mut form = vec![0.0; rows * columns];
        if !self.left.separate.is_empty() {
            let (left, right) = (self.left.separate_form(weights), self.right.separate_form(weights));
            for (row, left) in form.chunks_exact_mut(columns).zip(left) {
                for (value, right) in row.iter_mut().zip(&right) {
                    *value = left + right;
                }
            }
        }
        let cycled: Vec<f64> = weights.iter().cycle().take(self.left.coupled.len() / rows.max(1)).copied().collect();
        add_scaled_products(&self.left.coupled, &self.right.coupled, &cycled, &mut form, columns);
        form
    }

    /// Prior covariance of every action with one action.
    pub(crate) fn prior_with(&self, space: &SearchSpace, action: ActionIndex) -> Vec<f64> {
        let target = space.levels(action);
        let kernel = &self.process.kernel;
        let left = kernel.combinations(0, &target[..self.cut]);
        let right = kernel.combinations(self.cut, &target[self.cut..]);
        left.iter().flat_map(|&y| right.iter().map(move |&z| kernel.join(y, z))).collect()
    }

    /// Prior covariances of up to [`BLOCK`] actions with the points.
    fn columns(&self, actions: &[usize]) -> Block {
        let points = self.process.observed().points.len();
        let (rows, columns) = (self.left.count, self.right.count);
        let mut block: Block = vec![[0.0; BLOCK]; points];
        for (i, lanes) in block.iter_mut().enumerate() {
            let (left, right) = (&self.left.coupled[i * rows..], &self.right.coupled[i * columns..]);
            for (lane, action) in lanes.iter_mut().zip(actions) {
                *lane = left[action / columns] * right[action % columns];
            }
            if !self.left.separate.is_empty() {
                let (left, right) = (&left[points * rows..], &right[points * columns..]);
                let (alone_left, alone_right) = (&self.left.separate[i * rows..], &self.right.separate[i * columns..]);
                for (lane, action) in lanes.iter_mut().zip(actions) {
                    let (y, z) = (action / columns, action % columns);
                    *lane += left[y] * right[z] + alone_left[y] + alone_right[z];
                }
            }
        }
        block
    }

    /// Posterior variances, without nugget, of actions given by their indices.
    pub(crate) fn variances(&self, actions: &[usize]) -> Vec<f64> {
        let mut variances = Vec::with_capacity(actions.len());
        for chunk in actions.chunks(BLOCK) {
            variances.extend_from_slice(&self.process.block_variances(self.columns(chunk))[..chunk.len()]);
        }
        variances
    }
}
