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

/// Heel strikes of a foot: their name, colour and height above the trace, in ranges of the signal.
type FootMarks = (&'static str, usize, f64);
const RIGHT: FootMarks = ("right heel strike", 1, 0.1);
const LEFT: FootMarks = ("left heel strike", 2, 0.2);

/// Adds heel strikes above the trace, which would hide them.
fn with_strikes(chart: Chart, points: &[(f64, f64)], (name, colour, height): FootMarks, strikes_s: &[f64]) -> Chart {
    if strikes_s.is_empty() {
        return chart;
    }
    let values = || points.iter().map(|(_, value)| *value);
    let (low, high) = (values().fold(f64::INFINITY, f64::min), values().fold(f64::NEG_INFINITY, f64::max));
    let marks = strikes_s.iter().map(|time| (*time, high + height * (high - low))).collect();
    chart.with(name, colour, Stroke::Points, marks)
}

/// A joint angle, °, over time with the range of normal walking.
pub(crate) fn angle_over_time(title: &str, points: &[(f64, f64)], (low, high): (f64, f64)) -> Chart {
    let chart = Chart::new(title, "time, s", "angle, °");
    let chart = match points.first().zip(points.last()) {
        Some(((first, _), (last, _))) => {
            chart.with_band("range of normal walking", 7, vec![(*first, low, high), (*last, low, high)])
        }
        None => chart,
    };
    chart.with("this file", 0, Stroke::Solid, points.to_vec())
}

/// A column of a file as recorded, with the heel strikes of both feet. `threshold`: heel strikes are where the column rises
/// above it.
pub(crate) fn column_trace(
    name: &str,
    points: &[(f64, f64)],
    (right_s, left_s): (&[f64], &[f64]),
    threshold: Option<f64>,
) -> Chart {
    let chart = Chart::new(name, "time, s", "recorded value").with("as recorded", 0, Stroke::Solid, points.to_vec());
    let ends = points.first().zip(points.last()).zip(threshold);
    let chart = match ends {
        Some((((first, _), (last, _)), threshold)) => {
            let line = vec![(*first, threshold), (*last, threshold)];
            chart.with("contact threshold", 4, Stroke::Dashed, line)
        }
        None => chart,
    };
    with_strikes(with_strikes(chart, points, RIGHT, right_s), points, LEFT, left_s)
}

/// A signal over time: its title, the label of its axis, the name of its line, and its points.
pub(crate) fn trace(
    (title, axis, line): (&str, &str, &str),
    points: &[(f64, f64)],
    strikes_s: &[f64],
    strides: &[StrideSpan],
) -> Chart {
    let chart = Chart::new(title, "time, s", axis).with(line, 0, Stroke::Solid, points.to_vec());
    let mut chart = with_strikes(chart, points, RIGHT, strikes_s);
    let span = |stride: &StrideSpan| Span {
        from: stride.start_s,
        to: stride.end_s,
        name: stride.number.to_string(),
        shaded: stride.left_out,
    };
    chart.spans = strides.iter().map(span).collect();
    chart
}
