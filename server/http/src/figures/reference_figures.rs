//! The figures of a reference gait.

use super::recording_traces::StrideSpan;
use gait_optimizer::ReferenceGait;
use gait_optimizer::reference::RecordedStride;
use gaitwright_charts::{Figure, band_in_words, gait_charts};

/// Every figure of a reference gait.
pub(crate) fn of_reference(reference: &ReferenceGait) -> Vec<Figure> {
    let charts = gait_charts::of_reference(reference).into_iter();
    charts.map(|chart| Figure::chart("reference", chart)).collect()
}

/// A description of the figures.
pub(crate) fn in_words(reference: &ReferenceGait) -> String {
    format!(
        "Each curve begins with the heel strike of its leg; the left foot is taken to strike half a stride after the right foot. {}",
        band_in_words(reference)
    )
}

/// The strides of a recording for its charts.
pub(crate) fn stride_spans(strides: &[RecordedStride]) -> Vec<StrideSpan> {
    let span = |(number, stride): (usize, &RecordedStride)| StrideSpan {
        number,
        start_s: stride.start_s,
        end_s: stride.end_s,
        left_out: !stride.is_used,
    };
    (1..).zip(strides).map(span).collect()
}
