//! Expectation propagation (Minka 2001) for probit observations of one utility or the difference of two.
//!
//! Each update chooses the normal factor that matches mean and variance of the site's functional under the exact
//! likelihood of the site times its cavity.

use super::approximation::{Approximate, Approximation, SiteFactor};
use super::site_updates::{Cavity, WorkingApproximation};
use crate::error::{LearnerError, Result};
use crate::interval_likelihood::Link;
use crate::interval_likelihood::LogLikelihood;
use crate::observations::{ObservedPoints, Site};

/// Expectation propagation with sequential updates.
pub(crate) struct ExpectationPropagation {
    /// Largest neglected change at first: of the mean in posterior standard deviations, of the variance as a share.
    pub(crate) tolerance: f64,
    /// Largest number of sweeps over the sites.
    pub(crate) sweeps: usize,
}

impl Default for ExpectationPropagation {
    fn default() -> Self {
        Self { tolerance: 1e-8, sweeps: 320 }
    }
}

/// Logarithm of a site's likelihood integrated over its cavity, with derivatives in the mean of the cavity.
fn mass(site: &Site, cavity: Cavity) -> LogLikelihood {
    let mut interval = site.interval;
    interval.noise = (1.0 / cavity.precision + interval.noise * interval.noise).sqrt();
    interval.log_likelihood(Link::Probit, cavity.mean)
}

/// Number of sweeps after which the tolerance grows tenfold. Far from an interval, or with a narrow one, the moments of a
/// likelihood lose digits to cancellation, which hides smaller changes.
const RELAXED: usize = 40;
/// Number of sweeps after which the factors move half the way only.
const UNDAMPED: usize = 100;
/// Number of sweeps after which mean and covariance are recomputed, to limit the rounding error.
const REFRESH: usize = 10;

/// The factor that matches the moments of the site's likelihood times its cavity.
fn matching_factor(site: &Site, cavity: Cavity) -> Option<SiteFactor> {
    let variance = 1.0 / cavity.precision;
    let at = mass(site, cavity);
    let mean = cavity.mean + variance * at.slope;
    // precision = 1 / tilted - 1 / variance, where tilted = variance (1 - variance curvature).
    let shrink = (variance * at.curvature).min(1.0 - 1e-12);
    let precision = at.curvature / (1.0 - shrink);
    let shift = mean * (cavity.precision + precision) - cavity.mean * cavity.precision;
    (precision.is_finite() && shift.is_finite()).then_some(SiteFactor { precision, shift })
}

impl Approximate for ExpectationPropagation {
    fn approximate(&self, observed: &ObservedPoints, _link: Link) -> Result<Approximation> {
        let (prior, sites) = (&observed.prior, &observed.sites);
        let mut working = WorkingApproximation::of(prior, sites, vec![SiteFactor::default(); sites.len()])?;
        // Settled means that no site needs an update of a mean and a covariance that were just recomputed.
        let (mut recomputed, mut tolerance) = (true, self.tolerance);
        for sweep in 1..=self.sweeps {
            let share = if sweep > UNDAMPED { 0.5 } else { 1.0 };
            let settled = working.sweep(sites, &matching_factor, tolerance, share);
            if settled && recomputed && working.is_sound() {
                return Ok(working.finish(prior));
            }
            if sweep % RELAXED == 0 {
                tolerance *= 10.0;
            }
            recomputed = settled || sweep % REFRESH == 0 || !working.is_sound();
            if recomputed {
                working.refresh(prior, sites)?;
            }
        }
        Err(LearnerError::Numerical(format!("expectation propagation did not converge in {} sweeps", self.sweeps)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::action::ActionIndex;
    use crate::feedback::{Feedback, FeedbackLog};
    use crate::search_space::{Dimension, SearchSpace};
    use crate::settings::{LearnerSettings, Method};
    use crate::utility_inference::posterior;

    #[test]
    fn moments_match_quadrature() {
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
                let p = crate::special_functions::normal_cdf((x - y) / 0.3);
                let w = prior * p * p * crate::special_functions::normal_cdf(y / 0.4);
                mass += w;
                for (k, f) in [x, y].into_iter().enumerate() {
                    first[k] += w * f;
                    second[k] += w * f * f;
                }
            }
        }
        let posterior = posterior(&space, &log, &settings).unwrap();
        for (k, action) in [a, b].into_iter().enumerate() {
            let (mean, sd) = (first[k] / mass, (second[k] / mass - (first[k] / mass).powi(2)).sqrt());
            let got = posterior.predict(action).unwrap();
            assert!((got.mean - mean).abs() < 0.02, "{action}: {got:?} against {mean} {sd}");
            assert!((got.standard_deviation - sd).abs() < 0.02, "{action}: {got:?} against {mean} {sd}");
        }
    }

    #[test]
    fn sweeps_that_do_not_settle_are_an_error() {
        let space =
            SearchSpace::new(vec![Dimension { name: "x".into(), values: vec![0.0, 1.0], lengthscale: 1.0 }]).unwrap();
        let (winner, loser) = (ActionIndex(0), ActionIndex(1));
        let log =
            FeedbackLog { visited: vec![winner, loser], feedback: vec![Feedback::Preference { winner, loser }; 3] };
        let posterior = posterior(&space, &log, &LearnerSettings::published(Method::Eubo)).unwrap();
        let stopped = ExpectationPropagation { sweeps: 2, ..ExpectationPropagation::default() };
        let fitted = stopped.approximate(posterior.utility.observed(), Link::Probit);
        assert!(fitted.is_err_and(|error| error.to_string().contains("did not converge in 2 sweeps")));
    }
}
