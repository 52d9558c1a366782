//! Laplace's approximation: a normal distribution at the posterior's mode.
//!
//! Newton's method in whitened coordinates `f = L v`, `K = L L'`. The objective `1/2 v'v - sum log P` has Hessian
//! `B = I + L' W L`, whose eigenvalues are at least 1 whatever the answers; `K` is never inverted. A point that is new
//! starts at `v = 0`, its expectation given the others.

use super::{Approximate, Approximation, Factor, Spread, whitened_precision};
use crate::error::{LearnerError, Result};
use crate::linalg::dot;
use crate::model::{Model, Site};
use crate::settings::Link;

/// The mode of the posterior and its curvature there.
pub(crate) struct Laplace;

/// Newton steps before giving up; 5 to 8 are usual from a cold start, 2 to 3 from the previous answer's mode.
const MAX_STEPS: usize = 200;
/// Squared Newton decrement (the squared distance to the mode in posterior standard deviations) that is accepted.
const DECREMENT: f64 = 1e-10;

fn log_likelihood(sites: &[Site], link: Link, f: &[f64]) -> f64 {
    sites.iter().map(|s| s.interval.log_likelihood(link, s.of(f)).value).sum()
}

impl Approximate for Laplace {
    fn advance(&self, model: &Model, link: Link, previous: Option<&Approximation>) -> Result<Approximation> {
        let (prior, sites) = (&model.prior, &model.sites);
        let n = prior.order();
        let mut v = previous.map_or_else(Vec::new, |p| p.whitened.clone());
        v.resize(n, 0.0);
        let mut f = prior.multiply(&v);
        let mut value = 0.5 * dot(&v, &v) - log_likelihood(sites, link, &f);
        for _ in 0..MAX_STEPS {
            let mut slope = vec![0.0; n];
            let factors: Vec<Factor> = sites
                .iter()
                .map(|site| {
                    let d = site.of(&f);
                    let at = site.interval.log_likelihood(link, d);
                    slope[site.plus] += at.slope;
                    if let Some(minus) = site.minus {
                        slope[minus] -= at.slope;
                    }
                    Factor { precision: at.curvature, shift: at.slope + at.curvature * d }
                })
                .collect();
            let precision = whitened_precision(prior, sites, &factors)?;
            let pull = prior.multiply_transposed(&slope);
            let gradient: Vec<f64> = v.iter().zip(&pull).map(|(v, p)| v - p).collect();
            let mut step = gradient.clone();
            precision.solve(&mut step);
            let decrement = dot(&gradient, &step);
            let mut length = 1.0;
            let mut moved = None;
            while decrement > DECREMENT && length > 1e-10 {
                let trial: Vec<f64> = v.iter().zip(&step).map(|(v, s)| v - length * s).collect();
                let trial_f = prior.multiply(&trial);
                let trial_value = 0.5 * dot(&trial, &trial) - log_likelihood(sites, link, &trial_f);
                if trial_value <= value - 1e-4 * length * decrement {
                    moved = Some((trial, trial_f, trial_value));
                    break;
                }
                length *= 0.5;
            }
            match moved {
                Some(next) => (v, f, value) = next,
                // At the mode, or no representable decrease is left.
                None => {
                    let mut weights = v.clone();
                    prior.solve_upper(&mut weights);
                    let evidence = -value - 0.5 * precision.ln_determinant();
                    let spread = Spread::Precision(precision);
                    return Ok(Approximation { mean: f, weights, whitened: v, factors, spread, evidence });
                }
            }
        }
        Err(LearnerError::Numerical(format!("the posterior's mode was not found in {MAX_STEPS} Newton steps")))
    }
}
