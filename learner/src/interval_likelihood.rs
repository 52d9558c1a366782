//! The interval likelihood: one likelihood for every kind of feedback.
//!
//! Feedback says that a linear functional `d` of the utility, observed with noise of scale `c`, lies in an interval:
//!
//! `P(feedback | d) = g((high - d) / c) - g((low - d) / c)`,   `g` the logistic or normal distribution function.
//!
//! - preference: `d = f_winner - f_loser > 0`
//! - suggestion: the same, with its own noise
//! - no difference: `|f_a - f_b| < width`
//! - label: `d = f_action` between the thresholds of its category (ordinal regression, Chu and Ghahramani 2005)

use serde::{Deserialize, Serialize};

use crate::special_functions;

/// Distribution function of the noise: maps a difference in utility, divided by the noise scale, to a probability.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Link {
    /// `1 / (1 + exp(-z))`.
    Logistic,
    /// The standard normal distribution function.
    Probit,
}

/// An interval of the functional and the scale of the noise, all in units of utility.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Interval {
    pub(crate) low: f64,
    pub(crate) high: f64,
    pub(crate) noise: f64,
}

/// Logarithm of the likelihood with its derivatives in `d`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct LogLikelihood {
    pub(crate) value: f64,
    pub(crate) slope: f64,
    /// Minus the second derivative. Both links are log-concave, so it is never negative.
    pub(crate) curvature: f64,
}

impl Interval {
    pub(crate) fn log_likelihood(&self, link: Link, d: f64) -> LogLikelihood {
        let (low, high) = ((self.low - d) / self.noise, (self.high - d) / self.noise);
        self.scaled(match link {
            Link::Logistic => logistic(low, high),
            Link::Probit => probit(low, high),
        })
    }

    /// Likelihood, with absolute precision. Use [`Self::log_likelihood`] for logarithms: below 1e-16 digits are lost.
    pub(crate) fn probability(&self, link: Link, d: f64) -> f64 {
        let below = |bound: f64| match link {
            _ if bound.is_infinite() => f64::from(u8::from(bound > 0.0)),
            Link::Logistic => sigmoids((bound - d) / self.noise).0,
            Link::Probit => special_functions::normal_cdf((bound - d) / self.noise),
        };
        (below(self.high) - below(self.low)).max(0.0)
    }

    fn scaled(&self, standard: LogLikelihood) -> LogLikelihood {
        LogLikelihood {
            value: standard.value,
            slope: standard.slope / self.noise,
            curvature: standard.curvature / (self.noise * self.noise),
        }
    }
}

/// `sigma(z)` and `sigma(-z)` from one exponential.
fn sigmoids(z: f64) -> (f64, f64) {
    let e = special_functions::exp(-z.abs());
    let (large, small) = (1.0 / (1.0 + e), e / (1.0 + e));
    if z >= 0.0 { (large, small) } else { (small, large) }
}

/// `sigma(u) - sigma(l) = sigma(u) sigma(-l) (1 - exp(l - u))` avoids cancellation; only the first two factors depend
/// on `d`.
fn logistic(low: f64, high: f64) -> LogLikelihood {
    let (below_high, beyond_high) = sigmoids(high);
    let (beyond_low, above_low) = sigmoids(low);
    let gap = high - low;
    let narrow = if gap.is_finite() { special_functions::ln(-libm::expm1(-gap)) } else { 0.0 };
    let tail = |z: f64| if z == f64::INFINITY { 0.0 } else { special_functions::ln_sigmoid(z) };
    LogLikelihood {
        value: tail(high) + tail(-low) + narrow,
        slope: beyond_low - beyond_high,
        curvature: below_high * beyond_high + above_low * beyond_low,
    }
}

/// With `t` standard normal, `slope = E[t | l < t < u]` and `curvature = 1 - Var[t | l < t < u]`.
fn probit(low: f64, high: f64) -> LogLikelihood {
    if high == f64::INFINITY {
        return probit_above(low, 1.0);
    }
    if low == f64::NEG_INFINITY {
        return probit_above(-high, -1.0);
    }
    if low > 0.0 || (low + high > 0.0 && low > -high) {
        // In the left tail the distribution function keeps its relative precision.
        let mirrored = probit(-high, -low);
        return LogLikelihood { slope: -mirrored.slope, ..mirrored };
    }
    let gap = high - low;
    if gap < 1e-3 {
        // Across a narrow interval the density is log-linear: a uniform density tilted by exp(-middle s).
        let middle = 0.5 * (low + high);
        let tilt = middle * gap;
        let shift = if tilt.abs() < 1e-2 { -tilt / 12.0 } else { 0.5 / libm::tanh(-0.5 * tilt) + 1.0 / tilt };
        let spread = if tilt.abs() < 1e-2 {
            1.0 / 12.0
        } else {
            let s = 2.0 * libm::sinh(0.5 * tilt.clamp(-600.0, 600.0));
            1.0 / (tilt * tilt) - 1.0 / (s * s)
        };
        let half = 0.5 * tilt.abs();
        // ln(2 sinh(half) / (2 half)) without overflow.
        let ln_mean = if half < 1e-2 {
            half * half / 6.0
        } else {
            half + special_functions::ln_1p(-special_functions::exp(-2.0 * half)) - special_functions::ln(2.0 * half)
        };
        return LogLikelihood {
            value: -0.5 * middle * middle - 0.918_938_533_204_672_8 + special_functions::ln(gap) + ln_mean,
            slope: middle + gap * shift,
            curvature: (1.0 - gap * gap * spread).clamp(0.0, 1.0),
        };
    }
    let (ln_high, ln_low) = (special_functions::ln_normal_cdf(high), special_functions::ln_normal_cdf(low));
    let value = ln_high + special_functions::ln_1p(-special_functions::exp(ln_low - ln_high));
    let density = |z: f64| special_functions::exp(-0.5 * z * z - 0.918_938_533_204_672_8 - value);
    let (at_high, at_low) = (density(high), density(low));
    let slope = (at_low - at_high).clamp(low, high);
    let variance = 1.0 + low * at_low - high * at_high - slope * slope;
    LogLikelihood { value, slope, curvature: (1.0 - variance).clamp(0.0, 1.0) }
}

/// The interval `(low, inf)` for `sign = 1`; mirrored for `sign = -1`.
fn probit_above(low: f64, sign: f64) -> LogLikelihood {
    let ratio = special_functions::inverse_mills(-low);
    let value = if low == f64::NEG_INFINITY { 0.0 } else { special_functions::ln_normal_cdf(-low) };
    let curvature = if low == f64::NEG_INFINITY { 0.0 } else { (ratio * (ratio - low)).clamp(0.0, 1.0) };
    LogLikelihood { value, slope: if low == f64::NEG_INFINITY { 0.0 } else { sign * ratio }, curvature }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slope_and_curvature_match_finite_differences() {
        let intervals = [
            (0.0, f64::INFINITY, 0.02),
            (f64::NEG_INFINITY, 0.3, 0.1),
            (-0.5, 0.4, 0.1),
            (-0.02, 0.02, 0.02),
            (0.0, 1e-4, 0.2),
            (-1.0, 1.0, 5.0),
        ];
        for (low, high, noise) in intervals {
            let interval = Interval { low, high, noise };
            for link in [Link::Logistic, Link::Probit] {
                for d in [-1.3, -0.2, -0.01, 0.0, 0.005, 0.3, 1.7] {
                    let h = 1e-5 * noise;
                    let at = interval.log_likelihood(link, d);
                    let (left, right) = (interval.log_likelihood(link, d - h), interval.log_likelihood(link, d + h));
                    let slope = (right.value - left.value) / (2.0 * h);
                    let curvature = -(right.slope - left.slope) / (2.0 * h);
                    let scale = 1.0 / noise;
                    assert!(
                        (slope - at.slope).abs() < 2e-4 * (scale + at.slope.abs()),
                        "{interval:?} {link:?} {d}: slope {} against {slope}",
                        at.slope
                    );
                    assert!(
                        (curvature - at.curvature).abs() < 2e-3 * scale * scale,
                        "{interval:?} {link:?} {d}: curvature {} against {curvature}",
                        at.curvature
                    );
                }
            }
        }
    }

    #[test]
    fn category_probabilities_sum_to_one() {
        let bounds = [f64::NEG_INFINITY, -0.5, -0.1, 0.3, 0.7, f64::INFINITY];
        for link in [Link::Logistic, Link::Probit] {
            for d in [-2.0, -0.3, 0.0, 0.31, 5.0] {
                let total: f64 = bounds
                    .windows(2)
                    .map(|b| Interval { low: b[0], high: b[1], noise: 0.1 }.log_likelihood(link, d).value.exp())
                    .sum();
                assert!((total - 1.0).abs() < 1e-12, "{link:?} {d} {total}");
                for b in bounds.windows(2) {
                    let interval = Interval { low: b[0], high: b[1], noise: 0.1 };
                    let gap = interval.probability(link, d) - interval.log_likelihood(link, d).value.exp();
                    assert!(gap.abs() < 1e-13, "{link:?} {d} {b:?} {gap}");
                }
            }
        }
    }

    #[test]
    fn log_likelihood_is_finite_in_the_tails() {
        for link in [Link::Logistic, Link::Probit] {
            for d in [-1e8, -1e3, 1e3, 1e8] {
                for (low, high) in [(0.0, f64::INFINITY), (f64::NEG_INFINITY, 0.0), (-1.0, 1.0), (0.0, 1e-4)] {
                    let at = Interval { low, high, noise: 1e-3 }.log_likelihood(link, d);
                    assert!(at.value.is_finite() && at.slope.is_finite() && at.curvature >= 0.0, "{link:?} {d} {at:?}");
                    assert!(at.value <= 1e-9, "{link:?} {d} {at:?}");
                }
            }
        }
    }
}
