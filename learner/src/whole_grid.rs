//! Means, covariances and variances of all `N` actions at once.
//!
//! The `N x n` covariances with the points are never stored. The dimensions are divided into a left and a right half; a
//! covariance is the product of one number from each half.

use crate::action::ActionIndex;
use crate::gaussian_process::GaussianProcess;
use crate::linalg::{BLOCK, Block, add_scaled_products};
use crate::search_space::SearchSpace;

/// A whole grid under a Gaussian process.
pub(crate) struct WholeGrid<'a> {
    process: &'a GaussianProcess,
    cut: usize,
    left: Half,
    right: Half,
}

/// Covariance factors of all combinations of levels of one half with the points, point by point. Those of the left half
/// contain the prior variance.
struct Half {
    /// Number of combinations of levels.
    count: usize,
    factors: Vec<f64>,
}

impl Half {
    fn new(process: &GaussianProcess, shape: &[usize], from: usize, to: usize, scale: f64) -> Self {
        let points = &process.observed().levels;
        let count: usize = shape[from..to].iter().product();
        let mut factors = Vec::with_capacity(count * points.len());
        let mut products = Vec::with_capacity(count);
        for point in points {
            process.kernel.products(from, &point[from..to], scale, &mut products);
            factors.extend_from_slice(&products);
        }
        Self { count, factors }
    }
}

impl<'a> WholeGrid<'a> {
    pub(crate) fn new(space: &SearchSpace, process: &'a GaussianProcess) -> Self {
        let shape = space.shape();
        // The cut that minimises the larger half. Correlations of descriptors have no halves: the right one is empty.
        let least = if space.descriptors().is_some() { shape.len() } else { 0 };
        let cut = (least..=shape.len())
            .min_by_key(|&cut| shape[..cut].iter().product::<usize>().max(shape[cut..].iter().product()))
            .unwrap_or(0);
        let left = Half::new(process, &shape, 0, cut, process.kernel.variance);
        let right = Half::new(process, &shape, cut, shape.len(), 1.0);
        Self { process, cut, left, right }
    }

    /// `k(x, points) . weights` for every action `x`.
    pub(crate) fn form(&self, weights: &[f64]) -> Vec<f64> {
        let (rows, columns) = (self.left.count, self.right.count);
        let mut form = vec![0.0; rows * columns];
        add_scaled_products(&self.left.factors, &self.right.factors, weights, &mut form, columns);
        form
    }

    /// Prior covariance of every action with one action.
    pub(crate) fn prior_with(&self, space: &SearchSpace, action: ActionIndex) -> Vec<f64> {
        let target = space.levels(action);
        let kernel = &self.process.kernel;
        let left = kernel.combinations(0, &target[..self.cut]);
        let right = kernel.combinations(self.cut, &target[self.cut..]);
        left.iter().flat_map(|y| right.iter().map(move |z| kernel.variance * y * z)).collect()
    }

    /// Prior covariances of up to [`BLOCK`] actions with the points.
    fn columns(&self, actions: &[usize]) -> Block {
        let points = self.process.observed().points.len();
        let (rows, columns) = (self.left.count, self.right.count);
        let mut block: Block = vec![[0.0; BLOCK]; points];
        for (i, lanes) in block.iter_mut().enumerate() {
            let (left, right) = (&self.left.factors[i * rows..], &self.right.factors[i * columns..]);
            for (lane, action) in lanes.iter_mut().zip(actions) {
                *lane = left[action / columns] * right[action % columns];
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
