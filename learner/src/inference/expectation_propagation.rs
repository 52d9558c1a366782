//! Expectation propagation (Minka 2001) for probit answers about one utility or the difference of two.
//!
//! Each answer's factor is replaced in turn by the normal one that gives the right mean and variance of its functional
//! when every other answer keeps its normal factor.

use super::sites::{Cavity, Match, Working, shifts};
use super::{Approximate, Approximation, Factor, whitened_precision};
use crate::error::Result;
use crate::likelihood::LogLikelihood;
use crate::linalg::dot;
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

/// Logarithm, slope and curvature of an answer's probability under its cavity, in the cavity's mean.
fn mass(site: &Site, cavity: Cavity) -> LogLikelihood {
    let mut interval = site.interval;
    interval.noise = (1.0 / cavity.precision + interval.noise * interval.noise).sqrt();
    interval.log_likelihood(Link::Probit, cavity.mean)
}

impl Match for ExpectationPropagation {
    fn factor(&self, site: &Site, cavity: Cavity) -> Option<Factor> {
        let variance = 1.0 / cavity.precision;
        let at = mass(site, cavity);
        let mean = cavity.mean + variance * at.slope;
        // 1 / tilted variance - 1 / cavity variance, with tilted = cavity (1 - cavity curvature).
        let shrink = (variance * at.curvature).min(1.0 - 1e-12);
        let precision = at.curvature / (1.0 - shrink);
        let shift = mean * (cavity.precision + precision) - cavity.mean * cavity.precision;
        (precision.is_finite() && shift.is_finite()).then_some(Factor { precision, shift })
    }
}

impl Approximate for ExpectationPropagation {
    fn advance(&self, model: &Model, _link: Link, previous: Option<&Approximation>) -> Result<Approximation> {
        let (prior, sites) = (&model.prior, &model.sites);
        let mut working = Working::extend(model, previous);
        let old = previous.map_or(0, |p| p.mean.len());
        working.sweep(sites, previous.map_or(0, |p| p.factors.len()), self, self.tolerance, self.sweeps);
        if prior.order() / super::REFRESH != old / super::REFRESH || !working.is_sound() {
            working.refresh(prior, sites)?;
            working.sweep(sites, sites.len(), self, self.tolerance, self.sweeps);
        }
        Ok(working.finish(prior))
    }

    fn evidence(&self, model: &Model, _link: Link, approximation: &Approximation) -> Result<f64> {
        let working = Working::of(approximation);
        let mut total = 0.0;
        for (site, &factor) in model.sites.iter().zip(&working.factors) {
            if let Some(cavity) = working.cavity(site, factor) {
                // The answer's share: its mass under the cavity, less what its normal factor would give.
                let q = cavity.mean * cavity.precision + factor.shift;
                total += mass(site, cavity).value + 0.5 * math::ln_1p(factor.precision / cavity.precision)
                    - 0.5
                        * (q * q / (cavity.precision + factor.precision)
                            - cavity.mean * cavity.mean * cavity.precision);
            }
        }
        let precision = whitened_precision(&model.prior, &model.sites, &working.factors)?;
        let h = shifts(model.points.len(), &model.sites, &working.factors);
        Ok(total - 0.5 * precision.ln_determinant() + 0.5 * dot(&h, &working.mean))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
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
            LearnerSettings { preference_noise: 0.3, ordinal_noise: 0.4, ..LearnerSettings::published(Method::Eubo) };
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
        let evidence = ExpectationPropagation::default()
            .evidence(belief.utility.model(), Link::Probit, belief.utility.approximation())
            .unwrap();
        let exact = (mass / 2500.0 / (std::f64::consts::TAU * det.sqrt())).ln();
        // The approximation itself is off by 0.026 here: two equal answers are not independent given their factors.
        assert!((evidence - exact).abs() < 0.05, "{evidence} {exact}");
        for (k, action) in [a, b].into_iter().enumerate() {
            let (mean, sd) = (first[k] / mass, (second[k] / mass - (first[k] / mass).powi(2)).sqrt());
            let got = belief.predict(action).unwrap();
            assert!((got.mean - mean).abs() < 0.02, "{action}: {got:?} against {mean} {sd}");
            assert!((got.standard_deviation - sd).abs() < 0.02, "{action}: {got:?} against {mean} {sd}");
        }
    }
}
