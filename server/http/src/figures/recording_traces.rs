//! Charts of a recording before it is stored: a signal over time, with right heel strikes and numbered strides.

use gaitwright_charts::{Chart, Span, Stroke};

/// A stride of the recording.
#[derive(Debug, Clone, Copy)]
pub(crate) struct StrideSpan {
    pub(crate) number: usize,
    pub(crate) start_s: f64,
    pub(crate) end_s: f64,
    /// Whether it is left out, so that it is shaded.
    pub(crate) left_out: bool,
}

/// A signal over time: its title, the label of its axis, the name of its line, and its points.
pub(crate) fn trace(
    (title, axis, line): (&str, &str, &str),
    points: &[(f64, f64)],
    strikes_s: &[f64],
    strides: &[StrideSpan],
) -> Chart {
    let mut chart = Chart::new(title, "time, s", axis).with(line, 0, Stroke::Solid, points.to_vec());
    if !strikes_s.is_empty() {
        // Above the trace, which would hide them.
        let values = || points.iter().map(|(_, value)| *value);
        let (low, high) = (values().fold(f64::INFINITY, f64::min), values().fold(f64::NEG_INFINITY, f64::max));
        let marks = strikes_s.iter().map(|time| (*time, high + 0.1 * (high - low))).collect();
        chart = chart.with("right heel strike", 1, Stroke::Points, marks);
    }
    let span = |stride: &StrideSpan| Span {
        from: stride.start_s,
        to: stride.end_s,
        name: stride.number.to_string(),
        shaded: stride.left_out,
    };
    chart.spans = strides.iter().map(span).collect();
    chart
}
