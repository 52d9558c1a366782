//! Laplace's approximation: a normal distribution at the posterior's mode.
//!
//! From a cold start, Newton's method in whitened coordinates `f = L v`, `K = L L'`: the objective
//! `1/2 v'v - sum log P` has Hessian `B = I + L' W L`, whose eigenvalues are at least 1 whatever the answers; `K` is
//! never inverted. From the previous answer's mode, where few factors change, each answer's factor is moved to the
//! mode of its own functional given all other answers, in turn; the fixed point is the mode of all. Whenever that is
//! not reached soon, Newton's method takes over.

use super::sites::{Cavity, Match, Working, covariance};
use super::{Approximate, Approximation, Factor, whitened_precision};
use crate::error::{LearnerError, Result};
use crate::linalg::dot;
use crate::model::{Model, Site};
use crate::settings::Link;

/// The mode of the posterior and its curvature there.
pub(crate) struct Laplace;

/// Newton steps before giving up; 5 to 8 are usual from a cold start.
const MAX_STEPS: usize = 200;
/// Squared Newton decrement (the squared distance to the mode in posterior standard deviations) that is accepted.
const DECREMENT: f64 = 1e-10;
/// The same as a share of the objective, whose rounding hides smaller steps.
const RELATIVE_DECREMENT: f64 = 1e-13;
/// Change of a factor, in posterior standard deviations and relative variances, that is left undone.
const TOLERANCE: f64 = 1e-3;
/// Passes over the answers before Newton's method takes over.
const SWEEPS: usize = 20;

/// The mode and curvature along one answer's functional.
struct ModeAlong(Link);

impl Match for ModeAlong {
    fn factor(&self, site: &Site, cavity: Cavity) -> Option<Factor> {
        let at = |d: f64| site.interval.derivatives(self.0, d);
        // The slope of the log likelihood falls with d, so the mode lies between the cavity's mean and one full step.
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
    fn advance(&self, model: &Model, link: Link, previous: Option<&Approximation>) -> Result<Approximation> {
        let (prior, sites) = (&model.prior, &model.sites);
        if let Some(previous) = previous
            && prior.order() / super::REFRESH == previous.mean.len() / super::REFRESH
        {
            let mut working = Working::extend(model, Some(previous));
            if working.sweep(sites, previous.factors.len(), &ModeAlong(link), TOLERANCE, SWEEPS) && working.is_sound() {
                return Ok(working.finish(prior));
            }
        }
        newton(model, link, previous)
    }

    fn evidence(&self, model: &Model, link: Link, approximation: &Approximation) -> Result<f64> {
        let v = &approximation.whitened;
        let precision = whitened_precision(&model.prior, &model.sites, &approximation.factors)?;
        Ok(log_likelihood(&model.sites, link, &approximation.mean) - 0.5 * dot(v, v) - 0.5 * precision.ln_determinant())
    }
}

fn log_likelihood(sites: &[Site], link: Link, f: &[f64]) -> f64 {
    sites.iter().map(|s| s.interval.log_likelihood(link, s.of(f)).value).sum()
}

/// Newton's method in whitened coordinates. A point that is new starts at `v = 0`, its expectation given the others.
fn newton(model: &Model, link: Link, previous: Option<&Approximation>) -> Result<Approximation> {
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
            // At the mode, or no representable decrease is left.
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
    Err(LearnerError::Numerical(format!("the posterior's mode was not found in {MAX_STEPS} Newton steps")))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::belief::{Answer, Chain, Process};
    use crate::kernel::Kernel;
    use crate::likelihood::Interval;
    use crate::random::Random;
    use crate::settings::LearnerSettings;
    use crate::space::{ActionIndex, Dimension, SearchSpace};

    #[test]
    fn the_chain_ends_at_the_mode_that_newton_finds() {
        let dimensions = (0..4)
            .map(|d| Dimension { name: d.to_string(), values: vec![0.0, 1.0, 2.0, 3.0], lengthscale: 1.0 })
            .collect();
        let space = SearchSpace::new(dimensions).unwrap();
        let kernel =
            Kernel::new(&space, &crate::posterior::kernel_shape(&space, &LearnerSettings::default(), &[1.0; 4]));
        for (link, noise, seed) in [(Link::Logistic, 0.02, 1), (Link::Probit, 0.02, 2), (Link::Logistic, 0.5, 3)] {
            let mut random = Random::new(seed, 0);
            let mut answers = Vec::new();
            let mut last = ActionIndex(0);
            for _ in 0..80 {
                let action = ActionIndex(random.below(space.len()));
                let above = random.uniform() < 0.6;
                let (low, high) = if above { (0.0, f64::INFINITY) } else { (f64::NEG_INFINITY, 0.0) };
                answers.push(Answer { plus: action, minus: None, interval: Interval { low, high, noise: 0.1 } });
                if action != last {
                    let interval = Interval { low: 0.0, high: f64::INFINITY, noise };
                    answers.push(Answer { plus: action, minus: Some(last), interval });
                }
                last = action;
            }
            let process = Process { space: &space, kernel: &kernel, link, method: &Laplace };
            let state = Chain::default().advance(&process, &answers).unwrap();
            let exact = newton(&state.model, link, None).unwrap();
            let mut largest = [0.0_f64; 2];
            for i in 0..exact.mean.len() {
                largest[0] = largest[0].max((exact.mean[i] - state.approximation.mean[i]).abs());
                for j in 0..exact.mean.len() {
                    let difference = exact.covariance.at(i, j) - state.approximation.covariance.at(i, j);
                    largest[1] = largest[1].max(difference.abs());
                }
            }
            assert!(largest[0] < 5e-3 && largest[1] < 5e-3, "{link:?} {noise}: {largest:?}");
        }
    }
}
