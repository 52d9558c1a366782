//! Laplace's approximation: a normal distribution at the mode of the posterior.
//!
//! Newton's method works in whitened coordinates `f = L v`, `K = L L'`. The Hessian of the objective `1/2 v'v - sum log
//! P` is `B = I + L' W L`, whose eigenvalues are at least 1, and `K` is never inverted (Rasmussen and Williams 2006,
//! algorithm 3.1).

use super::approximation::{Approximate, Approximation, covariance, whitened_precision};
use crate::error::{LearnerError, Result};
use crate::interval_likelihood::Link;
use crate::linalg::dot;
use crate::observations::{ObservedPoints, Site};

/// Laplace's approximation.
pub(crate) struct Laplace;

/// Largest number of Newton steps.
const MAX_STEPS: usize = 1000;
/// Squared Newton decrement, the squared distance to the mode in posterior standard deviations, from which on the
/// convergence is quadratic: one more full step ends at the mode to rounding error.
const DECREMENT: f64 = 1e-10;
/// Squared Newton decrement as a share of the objective, whose rounding error hides smaller steps from the line search.
const RELATIVE_DECREMENT: f64 = 1e-13;

impl Approximate for Laplace {
    /// Newton's method with a backtracking line search, from the prior mean.
    fn approximate(&self, observed: &ObservedPoints, link: Link) -> Result<Approximation> {
        let (prior, sites) = (&observed.prior, &observed.sites);
        let n = prior.order();
        let mut v = vec![0.0; n];
        let mut f = vec![0.0; n];
        let mut value = -log_likelihood(sites, link, &f);
        let mut at_mode = false;
        for _ in 0..MAX_STEPS {
            let mut slope = vec![0.0; n];
            let curvatures: Vec<f64> = sites
                .iter()
                .map(|site| {
                    let at = site.interval.log_likelihood(link, site.of(&f));
                    slope[site.plus] += at.slope;
                    if let Some(minus) = site.minus {
                        slope[minus] -= at.slope;
                    }
                    at.curvature
                })
                .collect();
            let precision = whitened_precision(prior, sites, curvatures.into_iter())?;
            let pull = prior.multiply_transposed(&slope);
            let gradient: Vec<f64> = v.iter().zip(&pull).map(|(v, p)| v - p).collect();
            let mut step = gradient.clone();
            precision.solve(&mut step);
            let decrement = dot(&gradient, &step);
            let enough = DECREMENT.max(RELATIVE_DECREMENT * value.abs());
            let moved = |length: f64| {
                let v: Vec<f64> = v.iter().zip(&step).map(|(v, s)| v - length * s).collect();
                let f = prior.multiply(&v);
                let value = 0.5 * dot(&v, &v) - log_likelihood(sites, link, &f);
                (v, f, value)
            };
            let next = if at_mode {
                None
            } else if decrement <= enough {
                at_mode = true;
                Some(moved(1.0))
            } else {
                let lengths = std::iter::successors(Some(1.0), |length| Some(0.5 * length));
                let trials = lengths.take_while(|&length| length > 1e-10).map(|length| (length, moved(length)));
                trials
                    .into_iter()
                    .find(|(length, trial)| trial.2 <= value - 1e-4 * length * decrement)
                    .map(|found| found.1)
            };
            let Some(next) = next else {
                // At the mode, or the objective cannot decrease in double precision.
                prior.solve_upper(&mut v);
                return Ok(Approximation { mean: f, weights: v, covariance: covariance(prior, &precision) });
            };
            (v, f, value) = next;
        }
        Err(LearnerError::Numerical(format!("Laplace's approximation did not converge in {MAX_STEPS} Newton steps")))
    }
}

fn log_likelihood(sites: &[Site], link: Link, f: &[f64]) -> f64 {
    sites.iter().map(|s| s.interval.log_likelihood(link, s.of(f)).value).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::action::ActionIndex;
    use crate::fit::{Fit, ProcessModel};
    use crate::interval_likelihood::Interval;
    use crate::observations::Observation;
    use crate::random::Random;
    use crate::search_space::{Dimension, SearchSpace};
    use crate::settings::LearnerSettings;

    #[test]
    fn mean_is_the_mode_to_rounding_error() {
        let dimensions = (0..4)
            .map(|d| Dimension { name: d.to_string(), values: vec![0.0, 1.0, 2.0, 3.0], lengthscale: 1.0 })
            .collect();
        let space = SearchSpace::new(dimensions).unwrap();
        let kernel = crate::utility_inference::kernel(&space, &LearnerSettings::default());
        for (link, noise, seed) in [(Link::Logistic, 0.02, 1), (Link::Probit, 0.02, 2), (Link::Logistic, 0.5, 3)] {
            let mut random = Random::new(seed, 0);
            let mut observations = Vec::new();
            let mut last = ActionIndex(0);
            for _ in 0..80 {
                let action = ActionIndex(random.below(space.len()));
                let above = random.uniform() < 0.6;
                let (low, high) = if above { (0.0, f64::INFINITY) } else { (f64::NEG_INFINITY, 0.0) };
                observations.push(Observation {
                    plus: action,
                    minus: None,
                    interval: Interval { low, high, noise: 0.1 },
                });
                if action != last {
                    let interval = Interval { low: 0.0, high: f64::INFINITY, noise };
                    observations.push(Observation { plus: action, minus: Some(last), interval });
                }
                last = action;
            }
            let model = ProcessModel { space: &space, kernel: &kernel, link, method: &Laplace };
            let fit = Fit::of(&model, &observations).unwrap();
            let Approximation { mean, weights, .. } = &fit.approximation;
            let whitened = fit.observed.prior.multiply_transposed(weights);
            let mut slope = vec![0.0; mean.len()];
            for site in &fit.observed.sites {
                let at = site.interval.log_likelihood(link, site.of(mean));
                slope[site.plus] += at.slope;
                if let Some(minus) = site.minus {
                    slope[minus] -= at.slope;
                }
            }
            let pull = fit.observed.prior.multiply_transposed(&slope);
            let largest = whitened.iter().zip(&pull).fold(0.0_f64, |largest, (v, p)| largest.max((v - p).abs()));
            assert!(largest < 1e-9, "{link:?} {noise}: {largest}");
        }
    }
}
