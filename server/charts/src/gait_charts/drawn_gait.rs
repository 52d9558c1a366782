//! A gait as charts draw it.

use crate::Stroke;
use gait_optimizer::Gait;

/// Label of the axis of the stride.
pub(super) const STRIDE: &str = "gait cycle from right heel strike, %";

/// Number of drawn points for each node of a gait.
const DRAWN_PARTS: usize = 6;

/// A gait as it is drawn: smooth between its nodes.
pub fn drawn(gait: &Gait) -> Gait {
    gait.refined(DRAWN_PARTS)
}

/// Stroke of a gait among several; a reference gait is dotted.
pub(super) fn stroke(place: usize) -> Stroke {
    const STROKES: [Stroke; 4] = [Stroke::Solid, Stroke::Dashed, Stroke::DashDotted, Stroke::LongDashed];
    STROKES[place % STROKES.len()]
}
