//! The figures of a reference gait.

use gait_optimizer::ReferenceGait;
use gaitwright_charts::{Chart, Figure, Span, Stroke, gait_charts};
use gaitwright_service::studies::reference_preview::{AngleTrace, ReferencePreview};

/// Every figure of a reference gait.
pub(crate) fn of_reference(reference: &ReferenceGait) -> Vec<Figure> {
    let charts = gait_charts::of_reference(reference).into_iter();
    charts.map(|chart| Figure::chart("reference", chart)).collect()
}

/// The angles of a recording with its heel strikes and numbered strides. Strides that are left out are shaded.
pub(crate) fn preview(preview: &ReferencePreview) -> Vec<Chart> {
    let strides = (1..).zip(&preview.strides);
    let spans: Vec<Span> = strides
        .map(|(number, stride): (u32, _)| Span {
            from: stride.start_s,
            to: stride.end_s,
            name: number.to_string(),
            shaded: !stride.is_used,
        })
        .collect();
    let chart = |trace: &AngleTrace| {
        let mut chart =
            Chart::new(trace.joint, "time, s", "angle, °").with("recorded", 0, Stroke::Solid, trace.points.clone());
        if !preview.strikes_s.is_empty() {
            // Above the curve, which would hide them.
            let angles = || trace.points.iter().map(|(_, angle)| *angle);
            let (low, high) = (angles().fold(f64::INFINITY, f64::min), angles().fold(f64::NEG_INFINITY, f64::max));
            let marks = preview.strikes_s.iter().map(|time| (*time, high + 0.1 * (high - low))).collect();
            chart = chart.with("right heel strike", 1, Stroke::Points, marks);
        }
        chart.spans.clone_from(&spans);
        chart
    };
    preview.traces.iter().map(chart).collect()
}
