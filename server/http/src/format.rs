//! Numbers and names as pages show them.

use gait_learner::Prediction;
use gait_optimizer::number_format::{grouped, three_digits};
use gaitwright_charts::power_of_ten;
use gaitwright_service::access::Role;
use gaitwright_store::blind_pairs::OrderedAnswer;
use gaitwright_store::feedback::{FeedbackRow, Source};
use gaitwright_store::measurement_files::MeasurementKind;
use gaitwright_store::studies::{AnswerSource, SimulatedWalks, SimulatedWalksEffect};
use std::fmt::Display;

/// A figure with four decimals, or a dash.
pub(crate) fn decimal(value: Option<f64>) -> String {
    value.map_or_else(|| "–".to_owned(), |value| format!("{value:.4}"))
}

/// Seconds, or a dash.
pub(crate) fn seconds(value: Option<f64>) -> String {
    value.map_or_else(|| "–".to_owned(), |value| format!("{value:.1}"))
}

/// A rounded duration.
pub(crate) fn duration(seconds: f64) -> String {
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

/// A number of any size with three digits: `0.0123`, `2.46 × 10⁻⁷`.
pub(crate) fn number(value: f64) -> String {
    let magnitude = value.abs();
    if value == 0.0 || (1e-3..1e5).contains(&magnitude) {
        return minus(&grouped(&three_digits(value).to_string()));
    }
    let text = format!("{value:.2e}");
    match text.split_once('e') {
        Some((digits, exponent)) => minus(&format!("{digits} × {}", power_of_ten(exponent))),
        None => text,
    }
}

/// With a minus sign that is as wide as a plus sign.
fn minus(text: &str) -> String {
    text.replace('-', "\u{2212}")
}

/// Every digit of a number.
pub(crate) fn exactly(value: f64) -> String {
    minus(&grouped(&value.to_string()))
}

/// The version of the program.
pub(crate) const VERSION: &str = env!("CARGO_PKG_VERSION");

/// `−0.1 to 0.2`.
pub(crate) fn range(minimum: f64, maximum: f64) -> String {
    minus(&format!("{} to {}", grouped(&minimum.to_string()), grouped(&maximum.to_string())))
}

/// The same, or a dash.
pub(crate) fn optional_number(value: Option<f64>) -> String {
    value.map_or_else(|| "–".to_owned(), number)
}

/// A count with separated thousands: `11 664`.
pub(crate) fn count(value: impl Display) -> String {
    grouped(&value.to_string())
}

/// `not_converged` as `not converged`.
pub(crate) fn words(name: &str) -> String {
    name.replace('_', " ")
}

/// A name as part of the name of a file, in which only letters, digits, dots, hyphens and underscores are safe everywhere.
pub(crate) fn file_name(name: &str) -> String {
    name.chars().map(|c| if c.is_alphanumeric() || matches!(c, '.' | '_') { c } else { '-' }).collect()
}

/// With or without muscles.
pub(crate) fn variant(muscles: bool) -> &'static str {
    if muscles { "with muscles" } else { "without muscles" }
}

/// The source of answers.
pub(crate) fn answer_source(source: AnswerSource) -> &'static str {
    match source {
        AnswerSource::GaitRmse => "Gait RMSE",
        AnswerSource::People => "people",
        AnswerSource::Both => "both Gait RMSE and people",
    }
}

/// Effect of simulated walks in a study, in words; `None` without any.
pub(crate) fn simulated_walks(walks: &SimulatedWalks) -> Option<String> {
    let SimulatedWalks { effect, number_of_simulated_walks: number, gait_rmse_tolerance_rad, least_mean_strides } =
        walks;
    let what = match effect {
        SimulatedWalksEffect::None => return None,
        SimulatedWalksEffect::Report => "execution report for each gait".to_owned(),
        SimulatedWalksEffect::TieBreak => format!("break ties in Gait RMSE within {gait_rmse_tolerance_rad} rad"),
        SimulatedWalksEffect::Label => {
            format!("label gaits with fewer than {least_mean_strides} mean strides as not executable")
        }
    };
    Some(format!("simulated walks ({number} on each kind of ground): {what}"))
}

/// The delay of a study besides its solves, in words; empty if it waits for solves only.
pub(crate) fn also_waits_for(source: AnswerSource) -> &'static str {
    if source == AnswerSource::People { ", plus the time that people need to answer" } else { "" }
}

/// The answer of the subject in a lab session; first is walk 2.
pub(crate) fn walks_in_words(answer: OrderedAnswer) -> &'static str {
    match answer {
        OrderedAnswer::First => "walk 2, the first with the device, was better",
        OrderedAnswer::Second => "walk 3, the second with the device, was better",
        OrderedAnswer::NoDifference => "no difference between walk 2 and walk 3",
        OrderedAnswer::CannotTell => "cannot tell which walk was better",
        OrderedAnswer::UnsafeFirst => "walk 2 was unsafe",
        OrderedAnswer::UnsafeSecond => "walk 3 was unsafe",
        OrderedAnswer::UnsafeBoth => "walk 2 and walk 3 were unsafe",
        OrderedAnswer::Retracted => "retracted",
    }
}

/// Where an answer comes from.
pub(crate) fn source(row: &FeedbackRow) -> &'static str {
    // A rater need not be the subject or a clinician; known is only whether the answer is blind.
    match (row.by_rater, row.could_have_known) {
        (true, false) => "a rater",
        (true, true) => "an unblinded rater",
        (false, _) => source_name(row.source),
    }
}

/// The source of an answer that no rater gave.
pub(crate) fn source_name(source: Source) -> &'static str {
    match source {
        Source::Evaluation => "the evaluation",
        Source::GaitRmse => "Gait RMSE",
        Source::Subject => "the subject",
        Source::Clinician => "a clinician",
        Source::Script => "a script",
    }
}

/// The name of a role.
#[allow(clippy::trivially_copy_pass_by_ref)] // templates pass references
pub(crate) fn role(role: &Role) -> &'static str {
    match role {
        Role::Administrator => "administrator",
        Role::Clinician => "clinician",
        Role::Rater => "rater",
    }
}

/// The kind of a measurement file.
#[allow(clippy::trivially_copy_pass_by_ref)] // templates pass references
pub(crate) fn file_kind(kind: &MeasurementKind) -> &'static str {
    match kind {
        MeasurementKind::Emg => "EMG recording",
        MeasurementKind::JointAngles => "joint angles",
    }
}

/// A probability in whole percent.
pub(crate) fn percent(probability: f64) -> String {
    format!("{:.0} %", 100.0 * probability)
}

/// A number with two decimals and its sign.
pub(crate) fn signed(value: f64) -> String {
    // Zero has no minus sign.
    minus(&format!("{:+.2}", if value.abs() < 0.005 { 0.0 } else { value }))
}

/// A utility with its standard deviation: `+0.55 ± 0.68`.
pub(crate) fn utility(utility: &Prediction) -> String {
    format!("{} ± {:.2}", signed(utility.mean), utility.standard_deviation)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_three_digits_without_trailing_zeros() {
        let numbers = [0.0, 1.0, 0.012_345, -79.998, 1234.5, 12345.6, 2.46e-7, -3e-10, 1.5e8].map(number);
        assert_eq!(
            numbers,
            ["0", "1", "0.0123", "−80", "1235", "12\u{202f}346", "2.46 × 10⁻⁷", "−3.00 × 10⁻¹⁰", "1.50 × 10⁸"]
                .map(str::to_owned)
        );
    }
}
