//! Numbers as people read them.

use gait_optimizer::TunedBounds;

/// A figure with four decimals, or a dash.
pub(super) fn figure(value: Option<f64>) -> String {
    value.map_or_else(|| "–".to_owned(), |value| format!("{value:.4}"))
}

/// Seconds, or a dash.
pub(super) fn seconds(value: Option<f64>) -> String {
    value.map_or_else(|| "–".to_owned(), |value| format!("{value:.1}"))
}

/// A very small number, or a dash.
pub(super) fn tiny(value: Option<f64>) -> String {
    value.map_or_else(|| "–".to_owned(), |value| format!("{value:.0e}"))
}

/// `not_converged` as `not converged`.
pub(super) fn words(name: &str) -> String {
    name.replace('_', " ")
}

/// One bound: name, value, what it limits.
pub(super) struct Bound {
    pub(super) name: &'static str,
    pub(super) value: String,
    pub(super) meaning: &'static str,
}

/// The bounds of an action.
pub(super) fn bounds(action: &TunedBounds) -> Vec<Bound> {
    TunedBounds::NAMES
        .iter()
        .zip(action.to_array())
        .zip(TunedBounds::MEANINGS)
        .map(|((name, value), meaning)| Bound { name, value: value.to_string(), meaning })
        .collect()
}
