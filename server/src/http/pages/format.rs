//! Numbers as people read them.

use crate::store::feedback::Source;
use crate::store::studies::FeedbackMode;
use gait_optimizer::TunedBounds;

/// A figure with four decimals, or a dash.
pub(super) fn figure(value: Option<f64>) -> String {
    value.map_or_else(|| "–".to_owned(), |value| format!("{value:.4}"))
}

/// Seconds, or a dash.
pub(super) fn seconds(value: Option<f64>) -> String {
    value.map_or_else(|| "–".to_owned(), |value| format!("{value:.1}"))
}

/// A duration as people say it.
pub(super) fn duration(seconds: f64) -> String {
    let minutes = seconds / 60.0;
    if seconds < 1.0 {
        "a second".to_owned()
    } else if seconds < 90.0 {
        format!("{seconds:.0} s")
    } else if minutes < 90.0 {
        format!("{minutes:.0} min")
    } else {
        format!("{:.1} h", minutes / 60.0)
    }
}

/// A very small number, or a dash.
pub(super) fn tiny(value: Option<f64>) -> String {
    value.map_or_else(|| "–".to_owned(), |value| format!("{value:.0e}"))
}

/// `not_converged` as `not converged`.
pub(super) fn words(name: &str) -> String {
    name.replace('_', " ")
}

/// With or without muscles.
pub(super) fn variant(muscles: bool) -> &'static str {
    if muscles { "with muscles" } else { "without muscles" }
}

/// Who answers the comparisons.
pub(super) fn answers_by(mode: FeedbackMode) -> &'static str {
    match mode {
        FeedbackMode::Automatic => "Gait RMSE",
        FeedbackMode::Human => "people",
        FeedbackMode::Mixed => "Gait RMSE and people",
    }
}

/// Where an answer comes from.
pub(super) fn source(source: Source) -> &'static str {
    match source {
        Source::Convergence => "the solver",
        Source::GaitRmse => "Gait RMSE",
        Source::Subject => "the subject",
        Source::Clinician => "a clinician",
        Source::Script => "a script",
    }
}

/// A probability in whole percent.
pub(super) fn percent(probability: f64) -> String {
    format!("{:.0} %", 100.0 * probability)
}

/// A number with two decimals and its sign.
pub(super) fn signed(value: f64) -> String {
    // No zero is written as -0.
    format!("{:+.2}", if value.abs() < 0.005 { 0.0 } else { value }).replace('-', "\u{2212}")
}

/// What a bound limits, with its unit; empty for what is no bound.
pub(super) fn meaning(name: &str) -> &'static str {
    TunedBounds::NAMES.iter().position(|known| *known == name).map_or("", |place| TunedBounds::MEANINGS[place])
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
