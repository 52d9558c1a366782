//! Approximating the posterior of the points' utilities by a normal distribution.
//!
//! An approximation replaces the likelihood of every answer by `exp(shift d - precision d^2 / 2)` in its functional
//! `d`; the two methods differ in how they choose the two numbers. [`Approximate::advance`] starts from the
//! approximation of the same answers without the newest ones.

mod expectation_propagation;
mod laplace;
mod sites;

pub(crate) use expectation_propagation::ExpectationPropagation;
pub(crate) use laplace::Laplace;

use crate::error::Result;
use crate::linalg::{Block, Cholesky, Square, add_scaled, block_dots};
use crate::model::{Model, Site};
use crate::settings::Link;

/// Points after which an approximation is computed anew, so that rounding cannot add up.
const REFRESH: usize = 64;

/// The normal factor that stands for one answer.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Factor {
    pub(crate) precision: f64,
    pub(crate) shift: f64,
}

/// A normal distribution of the points' utilities.
#[derive(Debug, Clone)]
pub(crate) struct Approximation {
    pub(crate) mean: Vec<f64>,
    /// `K^-1 mean`.
    pub(crate) weights: Vec<f64>,
    /// `L^-1 mean`.
    pub(crate) whitened: Vec<f64>,
    pub(crate) factors: Vec<Factor>,
    pub(crate) covariance: Square,
}

/// A method of approximation.
pub(crate) trait Approximate {
    /// The approximation for all answers of the model, given the one for its first points and answers.
    ///
    /// The result is a function of the arguments alone.
    fn advance(&self, model: &Model, link: Link, previous: Option<&Approximation>) -> Result<Approximation>;

    /// Logarithm of the approximate probability of all answers.
    fn evidence(&self, model: &Model, link: Link, approximation: &Approximation) -> Result<f64>;
}

impl Approximation {
    /// Two vectors whose inner products with those of another action are posterior covariances, given the action's
    /// whitened prior covariances with the points.
    pub(crate) fn project(&self, prior: &Cholesky, whitened: &[f64]) -> (Vec<f64>, Vec<f64>) {
        let mut left = whitened.to_vec();
        prior.solve_upper(&mut left);
        let right = self.covariance.multiply(&left);
        (left, right)
    }

    /// For a block of actions: the posterior variance their utilities owe to the points.
    pub(crate) fn block_variances(&self, prior: &Cholesky, mut whitened: Block) -> [f64; crate::linalg::BLOCK] {
        prior.solve_upper_block(&mut whitened);
        block_dots(&whitened, &self.covariance.multiply_block(&whitened))
    }
}

/// The factor of `B = I + L' W L`, `W = sum_s precision_s a_s a_s'`.
pub(crate) fn whitened_precision(prior: &Cholesky, sites: &[Site], factors: &[Factor]) -> Result<Cholesky> {
    let n = prior.order();
    // Rows of W L, from the few non-zeros of W.
    let mut product = Square::zeros(n);
    for (site, factor) in sites.iter().zip(factors) {
        let w = factor.precision;
        if w == 0.0 {
            continue;
        }
        add_scaled(product.row_mut(site.plus), w, prior.row(site.plus));
        if let Some(minus) = site.minus {
            add_scaled(product.row_mut(site.plus), -w, prior.row(minus));
            add_scaled(product.row_mut(minus), -w, prior.row(site.plus));
            add_scaled(product.row_mut(minus), w, prior.row(minus));
        }
    }
    Cholesky::new(&prior.identity_plus_transposed_product(&product))
}

#[cfg(test)]
mod against_sampling;
