//! Quantities of all actions at once.
//!
//! The covariances of the whole grid with the points are never stored: the dimensions are cut in two halves, and each
//! covariance is a product (or two) of a number of the left half and a number of the right half.

use crate::belief::Belief;
use crate::linalg::{BLOCK, Block, add_scaled, add_scaled_products};
use crate::space::{ActionIndex, SearchSpace};

/// The grid seen from a belief's points.
pub(crate) struct Grid<'a> {
    belief: &'a Belief,
    cut: usize,
    left: Half,
    right: Half,
}

/// Covariance terms of all combinations of levels of some of the dimensions with the points, point by point.
struct Half {
    count: usize,
    /// Product terms, then, where the kernel has them, the other ones that couple the halves.
    coupled: Vec<f64>,
    /// Terms of this half alone, where the kernel has them.
    separate: Vec<f64>,
}

impl Half {
    fn new(belief: &Belief, shape: &[usize], from: usize, to: usize, left: bool) -> Self {
        let points = &belief.model().levels;
        let pure = belief.kernel.is_product();
        let count: usize = shape[from..to].iter().product();
        let mut coupled = Vec::with_capacity(count * points.len() * if pure { 1 } else { 2 });
        let (mut others, mut separate) = (Vec::new(), Vec::new());
        if pure {
            let mut products = Vec::with_capacity(count);
            for point in points {
                belief.kernel.products(from, &point[from..to], left, &mut products);
                coupled.extend_from_slice(&products);
            }
            return Self { count, coupled, separate };
        }
        for point in points {
            for symmetric in belief.kernel.combinations(from, &point[from..to]) {
                let (pair, alone) = belief.kernel.split(symmetric, left);
                coupled.push(pair[0]);
                others.push(pair[1]);
                separate.push(alone);
            }
        }
        coupled.append(&mut others);
        Self { count, coupled, separate }
    }

    /// Sums over the points of the separate terms, weighted.
    fn separate_form(&self, weights: &[f64]) -> Vec<f64> {
        let mut form = vec![0.0; self.count];
        for (terms, &weight) in self.separate.chunks_exact(self.count.max(1)).zip(weights) {
            add_scaled(&mut form, weight, terms);
        }
        form
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
        Self { belief, cut, left, right }
    }

    /// `k(x, points) . weights` for every action.
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

    /// Prior covariances of every action with one.
    pub(crate) fn prior_with(&self, space: &SearchSpace, action: ActionIndex) -> Vec<f64> {
        let target = space.levels(action);
        let kernel = &self.belief.kernel;
        let left = kernel.combinations(0, &target[..self.cut]);
        let right = kernel.combinations(self.cut, &target[self.cut..]);
        left.iter().flat_map(|&y| right.iter().map(move |&z| kernel.join(y, z))).collect()
    }

    /// Covariances of a few actions with the points.
    fn columns(&self, actions: &[usize]) -> Block {
        let points = self.belief.model().points.len();
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

    /// Posterior variances of a few actions that are not points.
    pub(crate) fn variances(&self, actions: &[usize]) -> Vec<f64> {
        let model = self.belief.model();
        let total = self.belief.kernel.variance;
        let mut variances = Vec::with_capacity(actions.len());
        for chunk in actions.chunks(BLOCK) {
            let mut block = self.columns(chunk);
            model.prior.solve_lower_block(&mut block);
            let explained = crate::linalg::block_dots(&block, &block);
            let kept = self.belief.approximation().block_variances(&model.prior, block);
            variances.extend((0..chunk.len()).map(|lane| (total - explained[lane] + kept[lane]).max(0.0)));
        }
        variances
    }
}
