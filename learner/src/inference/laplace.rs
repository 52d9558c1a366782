//! Laplace's approximation: a normal distribution at the mode of the posterior.
//!
//! Newton's method works in whitened coordinates `f = L v`, `K = L L'`. The Hessian of the objective `1/2 v'v - sum log
//! P` is `B = I + L' W L`, whose eigenvalues are at least 1, and `K` is never inverted (Rasmussen and Williams 2006,
//! algorithm 3.1).
//!
//! From a previous approximation few factors change, so sweeps of site updates are faster. Each update moves a factor
//! to the mode of the site's functional given its cavity; the fixed point is the mode of the posterior. If the sweeps
//! do not converge, Newton's method continues.

use super::approximation::{Approximate, Approximation, Factor, REFRESH, whitened_precision};
use super::site_updates::{Cavity, FactorRule, WorkingApproximation, covariance};
use crate::error::{LearnerError, Result};
use crate::likelihood::Link;
use crate::linalg::dot;
use crate::observations::{ObservedPoints, Site};

/// Laplace's approximation.
pub(crate) struct Laplace;

/// Largest number of Newton steps.
const MAX_STEPS: usize = 200;
/// Squared Newton decrement at convergence: the squared distance to the mode in posterior standard deviations.
const DECREMENT: f64 = 1e-10;
/// The same as a share of the objective, because its rounding error hides smaller steps.
const RELATIVE_DECREMENT: f64 = 1e-13;
/// Largest neglected change of a site: of the mean in posterior standard deviations, of the variance as a share.
const TOLERANCE: f64 = 1e-3;
/// Largest number of sweeps over the sites before Newton's method takes over.
const SWEEPS: usize = 20;

/// Chooses the factor from mode and curvature of the site's likelihood times its cavity.
struct ModeAlong(Link);

impl FactorRule for ModeAlong {
    fn factor(&self, site: &Site, cavity: Cavity) -> Option<Factor> {
        let at = |d: f64| site.interval.derivatives(self.0, d);
        // The slope of the log-likelihood decreases in d, so the mode lies between the cavity mean and this point.
        let reach = cavity.mean + at(cavity.mean).slope / cavity.precision;
        let (mut low, mut high) = (cavity.mean.min(reach), cavity.mean.max(reach));
        let mut d = 0.5 * (low + high);
        for _ in 0..100 {
            let here = at(d);
            let rise = (d - cavity.mean) * cavity.precision - here.slope;
            let newton = d - rise / (cavity.precision + here.curvature);
            if rise > 0.0 {
                high = d;
            } else {
                low = d;
            }
            let next = if newton > low && newton < high { newton } else { 0.5 * (low + high) };
            let done = (next - d).abs() * cavity.precision.sqrt() < 1e-9;
            d = next;
            if done {
                break;
            }
        }
        let here = at(d);
        let shift = here.slope + here.curvature * d;
        (here.curvature.is_finite() && shift.is_finite()).then_some(Factor { precision: here.curvature, shift })
    }

    fn settled(&self, site: &Site, present: Factor, mean: f64, variance: f64) -> bool {
        let here = site.interval.derivatives(self.0, mean);
        let force = present.shift - present.precision * mean - here.slope;
        (force * variance.sqrt()).abs() < 0.5 * TOLERANCE
            && ((present.precision - here.curvature) * variance).abs() < 0.5 * TOLERANCE
    }
}

impl Approximate for Laplace {
    fn advance(
        &self,
        observed: &ObservedPoints,
        link: Link,
        previous: Option<&Approximation>,
    ) -> Result<Approximation> {
        let (prior, sites) = (&observed.prior, &observed.sites);
        if let Some(previous) = previous
            && prior.order() / REFRESH == previous.mean.len() / REFRESH
        {
            let mut working = WorkingApproximation::extend(observed, Some(previous));
            if working.sweep(sites, previous.factors.len(), &ModeAlong(link), TOLERANCE, SWEEPS) && working.is_sound() {
                return Ok(working.finish(prior));
            }
        }
        newton(observed, link, previous)
    }

    fn log_evidence(&self, observed: &ObservedPoints, link: Link, approximation: &Approximation) -> Result<f64> {
        let v = &approximation.whitened;
        let precision = whitened_precision(&observed.prior, &observed.sites, &approximation.factors)?;
        Ok(log_likelihood(&observed.sites, link, &approximation.mean)
            - 0.5 * dot(v, v)
            - 0.5 * precision.ln_determinant())
    }
}

fn log_likelihood(sites: &[Site], link: Link, f: &[f64]) -> f64 {
    sites.iter().map(|s| s.interval.log_likelihood(link, s.of(f)).value).sum()
}

/// Newton's method with a backtracking line search. A new point starts at `v = 0`, its conditional prior mean.
fn newton(observed: &ObservedPoints, link: Link, previous: Option<&Approximation>) -> Result<Approximation> {
    let (prior, sites) = (&observed.prior, &observed.sites);
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
        let enough = DECREMENT.max(RELATIVE_DECREMENT * value.abs());
        let mut length = 1.0;
        let mut moved = None;
        while decrement > enough && length > 1e-10 {
            let trial: Vec<f64> = v.iter().zip(&step).map(|(v, s)| v - length * s).collect();
            let trial_f = prior.multiply(&trial);
            let trial_value = 0.5 * dot(&trial, &trial) - log_likelihood(sites, link, &trial_f);
            if trial_value <= value - 1e-4 * length * decrement {
                moved = Some((trial, trial_f, trial_value));
                break;
            }
            length *= 0.5;
        }
        let Some(next) = moved else {
            // Converged, or the objective cannot decrease in double precision.
            let mut weights = v.clone();
            prior.solve_upper(&mut weights);
            return Ok(Approximation {
                mean: f,
                weights,
                whitened: v,
                factors,
                covariance: covariance(prior, &precision),
            });
        };
        (v, f, value) = next;
    }
    Err(LearnerError::Numerical(format!("Laplace's approximation did not converge in {MAX_STEPS} Newton steps")))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::action::ActionIndex;
    use crate::kernel::Kernel;
    use crate::likelihood::Interval;
    use crate::observations::Observation;
    use crate::random::Random;
    use crate::search_space::{Dimension, SearchSpace};
    use crate::settings::LearnerSettings;
    use crate::update_chain::{ProcessModel, UpdateChain};

    #[test]
    fn update_chain_ends_at_the_mode_of_newtons_method() {
        let dimensions = (0..4)
            .map(|d| Dimension { name: d.to_string(), values: vec![0.0, 1.0, 2.0, 3.0], lengthscale: 1.0 })
            .collect();
        let space = SearchSpace::new(dimensions).unwrap();
        let kernel = Kernel::new(&space, &crate::learner::kernel_shape(&space, &LearnerSettings::default(), &[1.0; 4]));
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
            let fit = UpdateChain::default().advance(&model, &observations).unwrap();
            let exact = newton(&fit.observed, link, None).unwrap();
            let mut largest = [0.0_f64; 2];
            for i in 0..exact.mean.len() {
                largest[0] = largest[0].max((exact.mean[i] - fit.approximation.mean[i]).abs());
                for j in 0..exact.mean.len() {
                    let difference = exact.covariance.at(i, j) - fit.approximation.covariance.at(i, j);
                    largest[1] = largest[1].max(difference.abs());
                }
            }
            assert!(largest[0] < 5e-3 && largest[1] < 5e-3, "{link:?} {noise}: {largest:?}");
        }
    }
}
