//! The signals of an EMG file before its columns are mapped to muscles, as the page shows them.

use super::page_chart::{PageChart, shared_legend};
use crate::figures::recording_traces::column_trace;
use crate::form_errors;
use crate::refused_fields::FieldLabels;
use gaitwright_charts::Chart;
use gaitwright_service::studies::lab::{ColumnTrace, EmgOverview, EmgReading};

/// Largest number of columns that are drawn.
const MAX_DRAWN: usize = 48;
/// The note of the chart of a column with heel strikes.
const OF_STRIKES: &str = "Heel strikes are where this signal rises above the threshold.";

/// Every column of a file.
#[derive(Debug)]
pub(super) struct SignalsPreview {
    pub(super) legend: Vec<(String, String)>,
    pub(super) charts: Vec<PageChart>,
    /// How many columns are not drawn.
    pub(super) not_drawn: usize,
    /// Where heel strikes come from and how many there are; empty if they are unknown.
    pub(super) strikes: String,
    /// Why heel strikes are unknown; empty if they are known.
    pub(super) refused_strikes: String,
}

impl SignalsPreview {
    /// The signals without charts, for steps that do not show them.
    pub(super) fn without_charts(overview: &EmgOverview, reading: &EmgReading, labels: FieldLabels) -> Self {
        let refused = overview.refused_strikes.as_ref().map(|error| form_errors::of_form(error, labels));
        let strikes = if refused.is_some() { String::new() } else { in_words(overview, reading) };
        let refused_strikes = refused.unwrap_or_default();
        Self { legend: Vec::new(), charts: Vec::new(), not_drawn: 0, strikes, refused_strikes }
    }

    /// The same with a chart for each column.
    pub(super) fn new(overview: &EmgOverview, reading: &EmgReading, labels: FieldLabels) -> Self {
        let of_strikes = |column: &ColumnTrace| {
            let columns = [&reading.heel_strike_column, &reading.left_heel_strike_column];
            columns.into_iter().any(|known| known.as_ref() == Some(&column.name))
        };
        let strikes = (&overview.right_strikes_s[..], &overview.left_strikes_s[..]);
        let chart = |column: &ColumnTrace| -> (Chart, bool) {
            let threshold = of_strikes(column).then_some(reading.heel_strike_threshold);
            (column_trace(&column.name, &column.points, strikes, threshold), threshold.is_some())
        };
        let drawn = overview.columns.iter().take(MAX_DRAWN).map(chart);
        let mut charts: Vec<PageChart> = drawn
            .map(|(chart, of_strikes)| PageChart {
                note: if of_strikes { OF_STRIKES } else { "" },
                ..PageChart::new(&chart)
            })
            .collect();
        Self {
            legend: shared_legend(&mut charts),
            charts,
            not_drawn: overview.columns.len().saturating_sub(MAX_DRAWN),
            ..Self::without_charts(overview, reading, labels)
        }
    }
}

/// Columns, duration and sampling rate of a file.
pub(super) fn facts(overview: &EmgOverview) -> String {
    let columns = match overview.columns.len() {
        1 => "1 column".to_owned(),
        many => format!("{many} columns"),
    };
    format!("{columns}, {:.1} s at {:.0} Hz", overview.duration_s, overview.rate_hz)
}

/// Where heel strikes come from, and how many there are.
fn in_words(overview: &EmgOverview, reading: &EmgReading) -> String {
    let side = |strikes: usize, side: &str, column: Option<&String>| {
        let from = column.map_or_else(
            || "from the given times".to_owned(),
            |column| format!("from column {column}, above {}", reading.heel_strike_threshold),
        );
        let plural = if strikes == 1 { "" } else { "s" };
        format!("{strikes} {side} heel strike{plural} {from}.")
    };
    let right = side(overview.right_strikes_s.len(), "right", reading.heel_strike_column.as_ref());
    let left = match overview.left_strikes_s.len() {
        0 => "Left heel strikes are taken to be half a stride after the right ones.".to_owned(),
        many => side(many, "left", reading.left_heel_strike_column.as_ref()),
    };
    let chosen = if overview.guessed_strikes.is_some() {
        " This column looks like heel strikes; choose another one if it is not."
    } else {
        ""
    };
    format!("{right}{chosen} {left}")
}
