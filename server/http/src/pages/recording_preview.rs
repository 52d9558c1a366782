//! The preview of a recording before it is stored, which the forms for EMG, joint angles and reference gaits share: its signals
//! with right heel strikes, its strides, and whether it would be accepted.

use super::page_chart::{PageChart, shared_legend};
use crate::figures::recording_traces::{StrideSpan, trace};
use crate::figures::{lab_charts, reference_figures};
use crate::form_errors;
use crate::refused_fields::FieldLabels;
use gaitwright_charts::{Chart, gait_charts};
use gaitwright_service::error::Error;
use gaitwright_service::studies::lab::{EmgPreview, JointAnglePreview, Stride};
use gaitwright_service::studies::reference_preview::ReferencePreview;

/// A preview as the page shows it.
#[derive(Debug)]
pub(super) struct RecordingPreview {
    /// Why the recording would be refused; empty if it would be accepted.
    pub(super) refused: Vec<String>,
    /// A doubt about a recording that would be accepted.
    pub(super) warning: Option<String>,
    /// The legend of the charts, if they share it.
    pub(super) legend: Vec<(String, String)>,
    pub(super) charts: Vec<PageChart>,
    pub(super) strides: Vec<StrideRow>,
    /// Whether strides can be rejected in the form.
    pub(super) can_reject: bool,
    /// The mean of the strides, its heading, and the legend of its charts.
    pub(super) mean: Vec<PageChart>,
    pub(super) mean_heading: &'static str,
    pub(super) mean_legend: Vec<(String, String)>,
}

/// A stride in the table.
#[derive(Debug)]
pub(super) struct StrideRow {
    pub(super) number: usize,
    pub(super) start_s: f64,
    pub(super) duration_s: f64,
    pub(super) usage: &'static str,
}

impl RecordingPreview {
    fn new(charts: &[Chart], strides: &[StrideSpan], usage: impl Fn(usize) -> &'static str) -> Self {
        let mut charts: Vec<PageChart> = charts.iter().map(PageChart::new).collect();
        let row = |(place, stride): (usize, &StrideSpan)| StrideRow {
            number: stride.number,
            start_s: stride.start_s,
            duration_s: stride.end_s - stride.start_s,
            usage: usage(place),
        };
        Self {
            refused: Vec::new(),
            warning: None,
            legend: shared_legend(&mut charts),
            charts,
            strides: strides.iter().enumerate().map(row).collect(),
            can_reject: false,
            mean: Vec::new(),
            mean_heading: "Mean stride",
            mean_legend: Vec::new(),
        }
    }

    /// An EMG recording.
    pub(super) fn of_emg(preview: &EmgPreview, labels: FieldLabels) -> Self {
        let left_out = |stride: &Stride| stride.rejected || !stride.is_plausible;
        let span = |stride: &Stride| StrideSpan {
            number: stride.number as usize,
            start_s: stride.start_s,
            end_s: stride.end_s,
            left_out: left_out(stride),
        };
        let strides: Vec<StrideSpan> = preview.strides.iter().map(span).collect();
        let charts: Vec<Chart> = preview
            .traces
            .iter()
            .map(|channel| {
                let title = format!("{}: column {}", lab_charts::muscle_name(channel.channel), channel.column);
                let strikes: Vec<f64> = channel.at_strikes.iter().map(|(time, _)| *time).collect();
                trace((&title, "raw signal", "raw signal"), &channel.points, &strikes, &strides)
            })
            .collect();
        let usage = |place: usize| match preview.strides[place] {
            Stride { rejected: true, .. } => "rejected",
            Stride { is_plausible: false, .. } => "left out: too short or too long",
            Stride { .. } => "used",
        };
        let refused = in_words(&preview.refused, labels);
        let mut mean: Vec<PageChart> = lab_charts::cycles_of_file(&preview.cycles).iter().map(PageChart::new).collect();
        let mean_legend = shared_legend(&mut mean);
        let mean_heading = "Result: mean activity over the gait cycle";
        Self { refused, can_reject: true, mean, mean_heading, mean_legend, ..Self::new(&charts, &strides, usage) }
    }

    /// Joint angles of a walk in the lab.
    pub(super) fn of_joint_angles(preview: &JointAnglePreview, labels: FieldLabels) -> Self {
        let strides = reference_figures::stride_spans(&preview.strides);
        let chart = |(joint, points): &(&str, Vec<(f64, f64)>)| {
            trace((lab_charts::joint_name(joint), "angle, °", "recorded"), points, &preview.strikes_s, &strides)
        };
        let charts: Vec<Chart> = preview.traces.iter().map(chart).collect();
        let usage = |place: usize| {
            if preview.strides[place].is_used { "plausible" } else { "too short, too long, or with a gap" }
        };
        let refused = in_words(&preview.refused, labels);
        Self { refused, ..Self::new(&charts, &strides, usage) }
    }

    /// A recording for a reference gait.
    pub(super) fn of_reference(preview: &ReferencePreview, labels: FieldLabels) -> Self {
        let strides = reference_figures::stride_spans(&preview.strides);
        let charts = preview.traces.iter();
        let charts: Vec<Chart> = charts
            .map(|angles| trace((angles.joint, "angle, °", "recorded"), &angles.points, &preview.strikes_s, &strides))
            .collect();
        let usage = |place: usize| {
            if preview.strides[place].is_used { "used" } else { "left out: too short, too long, or with a gap" }
        };
        let (mut mean, refused, warning): (Vec<PageChart>, _, _) = match &preview.reference {
            Ok(found) => {
                let charts = gait_charts::of_reference(found).iter().map(PageChart::new).collect();
                (charts, Vec::new(), found.warning().ok().flatten())
            }
            Err(error) => (Vec::new(), vec![form_errors::of_form(error, labels)], None),
        };
        let mean_legend = shared_legend(&mut mean);
        Self { refused, warning, mean, mean_legend, ..Self::new(&charts, &strides, usage) }
    }
}

fn in_words(refused: &[Error], labels: FieldLabels) -> Vec<String> {
    refused.iter().map(|error| form_errors::of_form(error, labels)).collect()
}
