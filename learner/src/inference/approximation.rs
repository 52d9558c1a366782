//! The normal approximation of a posterior, and the interface of the methods that compute it.
//!
//! An approximation replaces the likelihood of each site by a normal factor `exp(shift d - precision d^2 / 2)` of its
//! functional `d`. The methods differ in how they choose `shift` and `precision`.

use crate::error::Result;
use crate::interval_likelihood::Link;
use crate::linalg::{Block, Cholesky, Square, add_scaled, block_dots};
use crate::observations::{ObservedPoints, Site};

/// The normal factor of one site, in natural parameters.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct SiteFactor {
    pub(crate) precision: f64,
    pub(crate) shift: f64,
}

/// The approximate posterior of the utilities at the `n` points, `K = L L'` their prior covariance.
#[derive(Debug, Clone)]
pub(crate) struct Approximation {
    pub(crate) mean: Vec<f64>,
    /// `K^-1 mean`, length `n`.
    pub(crate) weights: Vec<f64>,
    pub(crate) covariance: Square,
}

/// A method of approximate inference.
pub(crate) trait Approximate {
    /// The approximation for all sites.
    fn approximate(&self, observed: &ObservedPoints, link: Link) -> Result<Approximation>;
}

impl Approximation {
    /// From an action's whitened prior covariances `w = L^-1 k`: `left = L'^-1 w` and `right = S left`, `S` the
    /// posterior covariance. The product of `left` and another action's `right` is the part of their covariance due to
    /// the points.
    pub(crate) fn project(&self, prior: &Cholesky, whitened: &[f64]) -> (Vec<f64>, Vec<f64>) {
        let mut left = whitened.to_vec();
        prior.solve_upper(&mut left);
        let right = self.covariance.multiply(&left);
        (left, right)
    }

    /// For a block of actions: the part of their posterior variance due to the points.
    pub(crate) fn block_variances(&self, prior: &Cholesky, mut whitened: Block) -> [f64; crate::linalg::BLOCK] {
        prior.solve_upper_block(&mut whitened);
        block_dots(&whitened, &self.covariance.multiply_block(&whitened))
    }
}

/// Cholesky factor of `B = I + L' W L`, `W = sum_s precision_s a_s a_s'`, `a_s` the coefficients of site `s`.
pub(crate) fn whitened_precision(
    prior: &Cholesky,
    sites: &[Site],
    precisions: impl Iterator<Item = f64>,
) -> Result<Cholesky> {
    let n = prior.order();
    // W L: each site has at most two non-zero coefficients.
    let mut product = Square::zeros(n);
    for (site, w) in sites.iter().zip(precisions) {
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

/// Posterior covariance `L B^-1 L'`; `precision` is the Cholesky factor of `B`.
pub(super) fn covariance(prior: &Cholesky, precision: &Cholesky) -> Square {
    let n = prior.order();
    let mut columns = Square::zeros(n);
    for i in 0..n {
        let row = columns.row_mut(i);
        row[..=i].copy_from_slice(prior.row(i));
        precision.solve_lower(row);
    }
    columns.outer_product()
}
