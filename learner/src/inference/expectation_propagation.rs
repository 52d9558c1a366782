//! Expectation propagation (Minka 2001) for probit answers about one utility or the difference of two.
//!
//! Each answer's factor is replaced in turn by the normal one that gives the right mean and variance of `d` when
//! every other answer keeps its normal factor. The covariance of the points is kept whole and every replacement
//! changes it by a matrix of rank one: `O(n^2)` for a replacement, `O(1)` for finding that none is needed.

use super::{Approximate, Approximation, Factor, Spread, whitened_precision};
use crate::error::Result;
use crate::linalg::{Cholesky, Square, add_scaled, dot};
use crate::math;
use crate::model::{Model, Site};
use crate::settings::Link;

/// Matching of means and variances, answer by answer.
pub(crate) struct ExpectationPropagation {
    /// Change of a factor, in posterior standard deviations and relative variances, that is left undone.
    pub(crate) tolerance: f64,
    /// Passes over the answers before stopping.
    pub(crate) sweeps: usize,
}

impl Default for ExpectationPropagation {
    fn default() -> Self {
        Self { tolerance: 1e-4, sweeps: 30 }
    }
}

/// Cavities with less than this share of the marginal's precision are left alone.
const MIN_CAVITY: f64 = 1e-10;
/// Points after which the covariance is computed anew, so that rounding cannot add up.
const REFRESH: usize = 64;

/// The normal distribution being improved.
struct Working {
    covariance: Square,
    mean: Vec<f64>,
    factors: Vec<Factor>,
}

/// Cavity and tilted moments of one answer.
struct Tilted {
    cavity_precision: f64,
    cavity_mean: f64,
    ln_mass: f64,
    factor: Factor,
}

fn variance(site: &Site, covariance: &Square) -> f64 {
    let at = covariance.at(site.plus, site.plus);
    site.minus.map_or(at, |m| at + covariance.at(m, m) - 2.0 * covariance.at(site.plus, m))
}

impl Working {
    fn tilt(&self, site: &Site, factor: Factor) -> Option<Tilted> {
        let variance = variance(site, &self.covariance);
        if variance.is_nan() || variance < 1e-14 {
            return None;
        }
        let cavity_precision = 1.0 / variance - factor.precision;
        if cavity_precision < MIN_CAVITY / variance {
            return None;
        }
        let cavity_variance = 1.0 / cavity_precision;
        let cavity_mean = cavity_variance * (site.of(&self.mean) / variance - factor.shift);
        let mut interval = site.interval;
        interval.noise = (cavity_variance + interval.noise * interval.noise).sqrt();
        let at = interval.log_likelihood(Link::Probit, cavity_mean);
        let mean = cavity_mean + cavity_variance * at.slope;
        // 1 / variance - 1 / cavity variance, with variance = cavity (1 - cavity curvature).
        let shrink = (cavity_variance * at.curvature).min(1.0 - 1e-12);
        let precision = at.curvature / (1.0 - shrink);
        let shift = mean * (cavity_precision + precision) - cavity_mean * cavity_precision;
        (precision.is_finite() && shift.is_finite()).then_some(Tilted {
            cavity_precision,
            cavity_mean,
            ln_mass: at.value,
            factor: Factor { precision, shift },
        })
    }

    /// Replaces one factor; whether it was worth it.
    fn replace(&mut self, index: usize, site: &Site, tolerance: f64) -> bool {
        let old = self.factors[index];
        let Some(tilted) = self.tilt(site, old) else { return false };
        let new = tilted.factor;
        let (more_precision, more_shift) = (new.precision - old.precision, new.shift - old.shift);
        let variance = variance(site, &self.covariance);
        let gain = 1.0 / more_precision.mul_add(variance, 1.0);
        let move_by = (more_shift - more_precision * site.of(&self.mean)) * gain;
        if (move_by * variance.sqrt()).abs() < tolerance && (more_precision * variance * gain).abs() < tolerance {
            return false;
        }
        let mut column = self.covariance.row(site.plus).to_vec();
        if let Some(minus) = site.minus {
            add_scaled(&mut column, -1.0, self.covariance.row(minus));
        }
        add_scaled(&mut self.mean, move_by, &column);
        self.covariance.add_rank_one(-more_precision * gain, &column);
        self.factors[index] = new;
        true
    }

    /// Computes covariance and mean from the factors.
    fn refresh(&mut self, prior: &Cholesky, sites: &[Site]) -> Result<()> {
        let n = prior.order();
        let precision = whitened_precision(prior, sites, &self.factors)?;
        // Columns of L B^-1/2: the covariance is their product.
        let mut columns = Square::zeros(n);
        for i in 0..n {
            let row = columns.row_mut(i);
            row[..=i].copy_from_slice(prior.row(i));
            precision.solve_lower(row);
        }
        self.covariance = columns.outer_product();
        self.mean = self.covariance.multiply(&shifts(n, sites, &self.factors));
        Ok(())
    }
}

/// `sum_s shift_s a_s`.
fn shifts(n: usize, sites: &[Site], factors: &[Factor]) -> Vec<f64> {
    let mut h = vec![0.0; n];
    for (site, factor) in sites.iter().zip(factors) {
        h[site.plus] += factor.shift;
        if let Some(minus) = site.minus {
            h[minus] -= factor.shift;
        }
    }
    h
}

/// The previous distribution with the new points added, each given the others.
fn extend(model: &Model, previous: Option<&Approximation>) -> Working {
    let n = model.prior.order();
    let old = previous.map_or(0, |p| p.mean.len());
    let mut working = match previous {
        Some(Approximation { mean, factors, spread: Spread::Covariance(covariance), .. }) => {
            Working { covariance: covariance.grown(n - old), mean: mean.clone(), factors: factors.clone() }
        }
        _ => Working { covariance: Square::zeros(n), mean: Vec::new(), factors: Vec::new() },
    };
    working.mean.resize(n, 0.0);
    working.factors.resize(model.sites.len(), Factor::default());
    for i in old..n {
        // Row i of the prior factor holds the whitened covariances with the earlier points and what remains.
        let row = model.prior.row(i);
        let mut gain = row[..i].to_vec();
        model.prior.solve_upper(&mut gain);
        let with_others: Vec<f64> = (0..i).map(|j| dot(&working.covariance.row(j)[..i], &gain)).collect();
        let own = row[i] * row[i] + dot(&with_others, &gain);
        working.mean[i] = dot(&working.mean[..i], &gain);
        for (j, &c) in with_others.iter().enumerate() {
            working.covariance.row_mut(j)[i] = c;
        }
        let last = working.covariance.row_mut(i);
        last[..i].copy_from_slice(&with_others);
        last[i] = own;
    }
    working
}

impl Approximate for ExpectationPropagation {
    fn advance(&self, model: &Model, _link: Link, previous: Option<&Approximation>) -> Result<Approximation> {
        let (prior, sites) = (&model.prior, &model.sites);
        let mut working = extend(model, previous);
        let first_new = previous.map_or(0, |p| p.factors.len());
        let old = previous.map_or(0, |p| p.mean.len());
        let mut refresh_due = prior.order() / REFRESH != old / REFRESH;
        let mut changes = 0;
        for (index, site) in sites.iter().enumerate().skip(first_new) {
            changes += usize::from(working.replace(index, site, 0.0));
        }
        for _ in 0..self.sweeps {
            let before = changes;
            for (index, site) in sites.iter().enumerate() {
                changes += usize::from(working.replace(index, site, self.tolerance));
            }
            if refresh_due {
                working.refresh(prior, sites)?;
                refresh_due = false;
            } else if changes == before {
                break;
            }
        }
        let n = prior.order();
        if !working.mean.iter().all(|m| m.is_finite())
            || (0..n).any(|i| working.covariance.at(i, i).is_nan() || working.covariance.at(i, i) < 0.0)
        {
            working.refresh(prior, sites)?;
        }
        let mut whitened = working.mean.clone();
        prior.solve_lower(&mut whitened);
        let mut weights = whitened.clone();
        prior.solve_upper(&mut weights);
        Ok(Approximation {
            mean: working.mean,
            weights,
            whitened,
            factors: working.factors,
            spread: Spread::Covariance(working.covariance),
            evidence: f64::NAN,
        })
    }
}

/// Logarithm of the approximate probability of the answers.
pub(crate) fn evidence(model: &Model, approximation: &Approximation) -> Result<f64> {
    let Spread::Covariance(covariance) = &approximation.spread else { return Ok(approximation.evidence) };
    let working = Working {
        covariance: covariance.clone(),
        mean: approximation.mean.clone(),
        factors: approximation.factors.clone(),
    };
    let mut total = 0.0;
    for (site, &factor) in model.sites.iter().zip(&working.factors) {
        if let Some(t) = working.tilt(site, factor) {
            let q = t.cavity_mean * t.cavity_precision + factor.shift;
            total += t.ln_mass + 0.5 * math::ln_1p(factor.precision / t.cavity_precision)
                - 0.5
                    * (q * q / (t.cavity_precision + factor.precision)
                        - t.cavity_mean * t.cavity_mean * t.cavity_precision);
        }
    }
    let precision = whitened_precision(&model.prior, &model.sites, &working.factors)?;
    let h = shifts(model.points.len(), &model.sites, &working.factors);
    Ok(total - 0.5 * precision.ln_determinant() + 0.5 * dot(&h, &working.mean))
}

#[cfg(test)]
mod tests {
    use crate::feedback::{Feedback, FeedbackLog};
    use crate::posterior::posterior;
    use crate::settings::{LearnerSettings, Method};
    use crate::space::{ActionIndex, Dimension, SearchSpace};

    /// Two actions, a preference and a label: moments by brute-force summation over a fine net.
    #[test]
    fn moments_of_two_answers_match_quadrature() {
        let space =
            SearchSpace::new(vec![Dimension { name: "x".into(), values: vec![0.0, 1.0], lengthscale: 1.0 }]).unwrap();
        let settings =
            LearnerSettings { preference_noise: 0.3, ordinal_noise: 0.4, ..LearnerSettings::of(Method::Eubo) };
        let (a, b) = (ActionIndex(0), ActionIndex(1));
        let log = FeedbackLog {
            visited: vec![a, b],
            feedback: vec![
                Feedback::Preference { winner: a, loser: b },
                Feedback::Label { action: b, category: 1 },
                Feedback::Preference { winner: a, loser: b },
            ],
        };
        let (r, n) = ((-0.5_f64).exp(), 1.0 + 1e-5);
        let det = n * n - r * r;
        let (mut mass, mut first, mut second) = (0.0, [0.0; 2], [0.0; 2]);
        for i in -300..300 {
            for j in -300..300 {
                let (x, y) = (f64::from(i) / 50.0, f64::from(j) / 50.0);
                let prior = (-0.5 * (n * x * x - 2.0 * r * x * y + n * y * y) / det).exp();
                let p = crate::math::normal_cdf((x - y) / 0.3);
                let w = prior * p * p * crate::math::normal_cdf(y / 0.4);
                mass += w;
                for (k, f) in [x, y].into_iter().enumerate() {
                    first[k] += w * f;
                    second[k] += w * f * f;
                }
            }
        }
        let belief = posterior(&space, &log, &settings).unwrap();
        for (k, action) in [a, b].into_iter().enumerate() {
            let (mean, sd) = (first[k] / mass, (second[k] / mass - (first[k] / mass).powi(2)).sqrt());
            let got = belief.predict(action).unwrap();
            assert!((got.mean - mean).abs() < 0.02, "{action}: {got:?} against {mean} {sd}");
            assert!((got.standard_deviation - sd).abs() < 0.02, "{action}: {got:?} against {mean} {sd}");
        }
    }
}
