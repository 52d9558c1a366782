//! Expected gain over the incumbent, and cheap upper bounds that prune the search for its maximum.

use crate::special_functions;

/// `E max(X, 0)` for `X` normal with the given mean and variance.
pub(super) fn expected_gain(mean: f64, variance: f64) -> f64 {
    let sd = variance.max(1e-18).sqrt();
    let z = mean / sd;
    mean * special_functions::normal_cdf(z) + sd * special_functions::normal_density(z)
}

/// Upper bounds of [`expected_gain`] by linear interpolation of the convex `h(z) = z Phi(z) + phi(z)`.
pub(super) struct GainBound {
    table: Vec<f64>,
}

impl GainBound {
    const REACH: f64 = 8.0;
    const STEPS: f64 = 32.0;

    pub(super) fn new() -> Self {
        let h = |i: u32| {
            let z = f64::from(i) / Self::STEPS - Self::REACH;
            z * special_functions::normal_cdf(z) + special_functions::normal_density(z)
        };
        Self { table: (0..=512).map(h).collect() }
    }

    pub(super) fn of(&self, mean: f64, variance: f64) -> f64 {
        // The increment covers the rounding error of the variance.
        let sd = (variance.max(0.0) + 1e-9).sqrt();
        let at = (mean / sd + Self::REACH) * Self::STEPS;
        if at >= 511.0 {
            return mean + sd * 1e-9;
        }
        let at = at.max(0.0);
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "within 0..511")]
        let i = at as usize;
        let weight = at - i as f64;
        sd * (self.table[i] + weight * (self.table[i + 1] - self.table[i]))
    }
}

/// Upper bounds of the standard normal distribution function by linear interpolation left of 0, where it is convex.
pub(super) struct ProbabilityBound {
    table: Vec<f64>,
}

impl ProbabilityBound {
    pub(super) fn new() -> Self {
        let at = |i: u32| special_functions::normal_cdf(f64::from(i) / GainBound::STEPS - GainBound::REACH);
        Self { table: (0..=256).map(at).collect() }
    }

    pub(super) fn of(&self, z: f64) -> f64 {
        let at = ((z + GainBound::REACH) * GainBound::STEPS).max(0.0);
        if at >= 255.0 {
            return 1.0;
        }
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "within 0..255")]
        let i = at as usize;
        let weight = at - i as f64;
        // The factor covers the rounding error of the interpolation.
        (self.table[i] + weight * (self.table[i + 1] - self.table[i])) * (1.0 + 1e-12)
    }
}
