//! The filter of the line search: pairs (violation theta, barrier objective phi) of which none may dominate a new
//! iterate.
//!
//! An iterate is acceptable if theta < theta_f or phi < phi_f for every pair (WB06 section 2.3).

/// The filter, with its upper limit on theta.
#[derive(Debug, Clone, Default)]
pub(crate) struct Filter {
    entries: Vec<(f64, f64)>,
    /// Largest acceptable violation.
    pub theta_max: f64,
}

impl Filter {
    pub(crate) fn new(theta_max: f64) -> Self {
        Self { entries: Vec::new(), theta_max }
    }

    /// Removes every pair, because the barrier problem has changed.
    pub(crate) fn clear(&mut self) {
        self.entries.clear();
    }

    /// Whether (theta, phi) is finite, within the limit and not dominated.
    pub(crate) fn accepts(&self, theta: f64, phi: f64) -> bool {
        theta.is_finite()
            && phi.is_finite()
            && theta <= self.theta_max
            && self.entries.iter().all(|&(t, p)| not_above(theta, t, t) || not_above(phi, p, p))
    }

    /// Adds a pair with its margins: theta (1 - gamma_theta), phi - gamma_phi theta.
    pub(crate) fn add(&mut self, theta: f64, phi: f64) {
        let pair = (theta * (1.0 - GAMMA_THETA), phi - GAMMA_PHI * theta);
        self.entries.retain(|&(t, p)| t < pair.0 || p < pair.1);
        self.entries.push(pair);
    }
}

/// Margin of the filter in theta (WB06 gamma_theta).
pub(crate) const GAMMA_THETA: f64 = 1e-5;
/// Margin of the filter in phi (IPOPT `gamma_phi`).
pub(crate) const GAMMA_PHI: f64 = 1e-8;

/// a <= b up to a rounding error of ten units of `scale`.
pub(crate) fn not_above(a: f64, b: f64, scale: f64) -> bool {
    a - b <= 10.0 * f64::EPSILON * scale.abs()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dominated_points_are_rejected() {
        let mut filter = Filter::new(10.0);
        assert!(filter.accepts(1.0, 5.0));
        filter.add(1.0, 5.0);
        assert!(!filter.accepts(1.0, 5.0));
        assert!(!filter.accepts(2.0, 6.0));
        assert!(filter.accepts(0.5, 6.0));
        assert!(filter.accepts(2.0, 4.0));
        assert!(!filter.accepts(11.0, -1.0));
        assert!(!filter.accepts(f64::NAN, 0.0));
    }

    #[test]
    fn new_pair_replaces_the_pairs_it_dominates() {
        let mut filter = Filter::new(10.0);
        filter.add(2.0, 2.0);
        filter.add(1.0, 1.0);
        assert_eq!(filter.entries.len(), 1);
    }
}
