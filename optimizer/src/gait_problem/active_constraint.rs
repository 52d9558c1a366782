//! Decides whether a constraint is active at a solution.

/// Smallest distance of an inactive constraint, relative to its bound, or scaled if the bound is less than 1.
const MIN_DISTANCE: f64 = 1e-6;

/// Whether a constraint is active at a solution, from its multiplier and its distance from its limit. The one rule for
/// unchanged bounds and sensitivities.
pub(crate) fn is_active(distance: f64, multiplier: f64, limit: f64) -> bool {
    multiplier > distance || distance < least_distance(limit)
}

/// Smallest distance of an inactive constraint from its limit.
pub(super) fn least_distance(limit: f64) -> f64 {
    MIN_DISTANCE * limit.abs().max(1.0)
}
