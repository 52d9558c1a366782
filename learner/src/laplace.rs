//! Laplace's approximation: a normal distribution at the posterior's mode.
//!
//! Newton's method in whitened coordinates `f = L v`, `K = L L^T`. The objective `1/2 v'v - sum log P` has Hessian
//! `B = I + L' W L`, whose eigenvalues are at least 1 whatever the data; `K` is never inverted.

use crate::error::{LearnerError, Result};
use crate::linalg::{Cholesky, Square, dot};
use crate::model::Site;
use crate::settings::Link;

/// The mode and the factor of the whitened precision there.
#[derive(Debug, Clone)]
pub(crate) struct Mode {
    pub(crate) whitened: Vec<f64>,
    pub(crate) mean: Vec<f64>,
    /// Factor of `B`: the posterior covariance is `L B^-1 L'`.
    pub(crate) precision: Cholesky,
}

/// Newton steps before giving up; 5 to 8 are usual from a cold start.
const MAX_STEPS: usize = 100;
/// Squared Newton decrement at which the mode is accepted.
const DECREMENT: f64 = 1e-12;

fn objective(sites: &[Site], link: Link, v: &[f64], f: &[f64]) -> f64 {
    let likelihood: f64 = sites.iter().map(|s| s.interval.log_likelihood(link, s.of(f)).value).sum();
    0.5 * dot(v, v) - likelihood
}

/// Finds the mode from the start `v`.
pub(crate) fn mode(prior: &Cholesky, sites: &[Site], link: Link, mut v: Vec<f64>) -> Result<Mode> {
    let n = v.len();
    let mut f = prior.multiply(&v);
    let mut value = objective(sites, link, &v, &f);
    for _ in 0..MAX_STEPS {
        let mut slope = vec![0.0; n];
        let mut curvature = Square::zeros(n);
        for site in sites {
            let at = site.interval.log_likelihood(link, site.of(&f));
            slope[site.plus] += at.slope;
            curvature.row_mut(site.plus)[site.plus] += at.curvature;
            if let Some(minus) = site.minus {
                slope[minus] -= at.slope;
                curvature.row_mut(minus)[minus] += at.curvature;
                curvature.row_mut(minus)[site.plus] -= at.curvature;
                curvature.row_mut(site.plus)[minus] -= at.curvature;
            }
        }
        let precision = Cholesky::new(&whitened_precision(prior, &curvature))?;
        let pull = prior.multiply_transposed(&slope);
        let gradient: Vec<f64> = v.iter().zip(&pull).map(|(v, p)| v - p).collect();
        let mut step = gradient.clone();
        precision.solve(&mut step);
        let decrement = dot(&gradient, &step);
        if decrement <= DECREMENT {
            return Ok(Mode { whitened: v, mean: f, precision });
        }
        let mut length = 1.0;
        loop {
            let trial: Vec<f64> = v.iter().zip(&step).map(|(v, s)| v - length * s).collect();
            let trial_f = prior.multiply(&trial);
            let trial_value = objective(sites, link, &trial, &trial_f);
            if trial_value <= value - 1e-4 * length * decrement {
                (v, f, value) = (trial, trial_f, trial_value);
                break;
            }
            length *= 0.5;
            if length < 1e-10 {
                // No representable decrease is left: the mode to rounding.
                return Ok(Mode { whitened: v, mean: f, precision });
            }
        }
    }
    Err(LearnerError::Numerical(format!("the posterior's mode was not found in {MAX_STEPS} Newton steps")))
}

/// `I + L' W L`, lower triangle.
fn whitened_precision(prior: &Cholesky, curvature: &Square) -> Square {
    let n = curvature.order();
    let lower = prior.lower();
    // rows of W L, skipping the zeros of W
    let mut product = Square::zeros(n);
    for i in 0..n {
        for k in 0..n {
            let w = curvature.at(i, k);
            if w != 0.0 {
                crate::linalg::add_scaled(&mut product.row_mut(i)[..=k], w, &lower.row(k)[..=k]);
            }
        }
    }
    let mut result = Square::zeros(n);
    for k in 0..n {
        // L' has a column per row of L: entry (i, j) gains L_ki (WL)_kj for i <= k.
        for i in 0..=k {
            let l = lower.at(k, i);
            if l != 0.0 {
                crate::linalg::add_scaled(&mut result.row_mut(i)[..=i], l, &product.row(k)[..=i]);
            }
        }
    }
    for i in 0..n {
        result.row_mut(i)[i] += 1.0;
    }
    result
}
