//! The figures of a reference gait.

use gait_optimizer::ReferenceGait;
use gaitwright_charts::{Figure, gait_charts};

/// Every figure of a reference gait.
pub(crate) fn of_reference(reference: &ReferenceGait) -> Vec<Figure> {
    let charts = gait_charts::of_reference(reference).into_iter();
    charts.map(|chart| Figure::chart("reference", chart)).collect()
}
