//! The Gaussian process given its observations: moments, joint samples and covariances of any actions.

use std::sync::Arc;

use crate::action::ActionIndex;
use crate::error::Result;
use crate::fit::Fit;
use crate::inference::Approximation;
use crate::kernel::Kernel;
use crate::linalg::{BLOCK, Block, Cholesky, Square, block_dots, dot};
use crate::observations::ObservedPoints;
use crate::random::Random;

/// Share of the prior variance that bounds the rounding error of a covariance.
const ROUNDING: f64 = 1e-9;

/// A Gaussian process over the actions, conditioned on its observations.
#[derive(Debug, Clone)]
pub(crate) struct GaussianProcess {
    pub(crate) kernel: Arc<Kernel>,
    pub(crate) fit: Arc<Fit>,
}

/// Values from which the moments of one action follow, computed once.
pub(crate) struct View {
    levels: Vec<usize>,
    slot: Option<usize>,
    /// Whitened prior covariances with the points, `L^-1 k`.
    prior: Vec<f64>,
    /// [`Approximation::project`] of `prior`.
    left: Vec<f64>,
    right: Vec<f64>,
    /// Posterior mean.
    pub(crate) mean: f64,
}

impl GaussianProcess {
    pub(crate) fn observed(&self) -> &ObservedPoints {
        &self.fit.observed
    }

    pub(crate) fn approximation(&self) -> &Approximation {
        &self.fit.approximation
    }

    /// Posterior mean of an action.
    pub(crate) fn mean(&self, action: ActionIndex, levels: &[usize]) -> f64 {
        match self.observed().slot(action) {
            Some(slot) => self.approximation().mean[slot],
            None => dot(&self.kernel.column(levels, &self.observed().levels), &self.approximation().weights),
        }
    }

    pub(crate) fn view(&self, action: ActionIndex, levels: Vec<usize>) -> View {
        let observed = self.observed();
        let slot = observed.slot(action);
        let mut prior = self.kernel.column(&levels, &observed.levels);
        if let Some(slot) = slot {
            prior[slot] += self.kernel.nugget;
        }
        let mean =
            slot.map_or_else(|| dot(&prior, &self.approximation().weights), |slot| self.approximation().mean[slot]);
        observed.prior.solve_lower(&mut prior);
        let (left, right) = self.approximation().project(&observed.prior, &prior);
        View { levels, slot, prior, left, right, mean }
    }

    /// Posterior covariance of two actions.
    pub(crate) fn covariance(&self, a: &View, b: &View) -> f64 {
        let same = a.slot.is_some() && a.slot == b.slot;
        let prior = self.kernel.covariance(&a.levels, &b.levels) + if same { self.kernel.nugget } else { 0.0 };
        prior - dot(&a.prior, &b.prior) + dot(&a.left, &b.right)
    }

    /// Posterior variance of an action.
    pub(crate) fn variance(&self, a: &View) -> f64 {
        self.covariance(a, a).max(0.0)
    }

    /// For a block of actions, given by their prior covariances with the points: their posterior variances without
    /// nugget.
    pub(crate) fn block_variances(&self, mut columns: Block) -> [f64; BLOCK] {
        let observed = self.observed();
        observed.prior.solve_lower_block(&mut columns);
        let explained = block_dots(&columns, &columns);
        let kept = self.approximation().block_variances(&observed.prior, columns);
        std::array::from_fn(|lane| (self.kernel.variance - explained[lane] + kept[lane]).max(0.0))
    }

    /// Posterior covariance matrix of distinct actions, regularised for a Cholesky factorisation.
    ///
    /// The covariance of a point contains its nugget; other actions get theirs here. A point gets a ridge instead,
    /// because rounding can make its variance negative.
    pub(crate) fn joint_covariance(&self, views: &[View]) -> Square {
        let ridge = |view: &View| match view.slot {
            Some(_) => ROUNDING * self.kernel.variance,
            None => self.kernel.nugget,
        };
        Square::from_fn(views.len(), |i, j| {
            self.covariance(&views[i], &views[j]) + if i == j { ridge(&views[i]) } else { 0.0 }
        })
    }

    /// Posterior mean and variance of the difference of two actions.
    pub(crate) fn difference(&self, a: &View, b: &View) -> (f64, f64) {
        let variance = self.covariance(a, a) + self.covariance(b, b) - 2.0 * self.covariance(a, b);
        (a.mean - b.mean, variance.max(0.0))
    }

    /// A joint sample of the utilities of all points, and of other actions given by their levels.
    pub(crate) fn sample(&self, others: &[Vec<usize>], random: &mut Random) -> Result<(Vec<f64>, Vec<f64>)> {
        let observed = self.observed();
        let noise: Vec<f64> = observed.points.iter().map(|_| random.normal()).collect();
        let covariance = self.approximation().covariance.ridged(ROUNDING * self.kernel.variance);
        let spread = Cholesky::new(&covariance)?.multiply(&noise);
        let points: Vec<f64> = self.approximation().mean.iter().zip(spread).map(|(m, s)| m + s).collect();
        let mut whitened = points.clone();
        observed.prior.solve_lower(&mut whitened);
        let columns: Vec<Vec<f64>> = others
            .iter()
            .map(|levels| {
                let mut column = self.kernel.column(levels, &observed.levels);
                observed.prior.solve_lower(&mut column);
                column
            })
            .collect();
        let remaining = Square::from_fn(others.len(), |i, j| {
            let ridge = if i == j { self.kernel.nugget } else { 0.0 };
            self.kernel.covariance(&others[i], &others[j]) - dot(&columns[i], &columns[j]) + ridge
        });
        let noise: Vec<f64> = others.iter().map(|_| random.normal()).collect();
        let spread = Cholesky::new(&remaining)?.multiply(&noise);
        let others = columns.iter().zip(spread).map(|(column, s)| dot(column, &whitened) + s).collect();
        Ok((points, others))
    }

    /// Weights `c` with `Cov(f(x), f(y)) = k(x, y) + k(x, points) . c` for a view of `y` and every other `x`.
    pub(crate) fn covariance_weights(&self, view: &View) -> Vec<f64> {
        let prior = &self.observed().prior;
        let mut kept = view.right.clone();
        prior.solve(&mut kept);
        let mut removed = view.prior.clone();
        prior.solve_upper(&mut removed);
        kept.iter().zip(removed).map(|(kept, removed)| kept - removed).collect()
    }
}
