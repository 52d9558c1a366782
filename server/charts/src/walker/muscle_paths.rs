//! The paths of the ten muscles over the segments.
//!
//! The model of the muscles has moment arms, not attachments. These paths show on which side of which joints a muscle
//! pulls; they are drawn, not computed.

use super::body_outline::Lengths;
use super::segment::Segment;
use crate::gait_series::MUSCLES;
use gait_optimizer::gait::stick_figure::StickFigure;

/// Points through which a muscle is drawn, each in the frame of a segment, in units of a drawing.
pub(crate) type MusclePath = Vec<(Segment, [f64; 2])>;

/// Whether a muscle belongs to the left leg.
pub(super) fn is_left(muscle: usize) -> bool {
    MUSCLES.get(muscle).is_some_and(|name| name.ends_with("_L"))
}

/// The paths in the order of [`MUSCLES`].
pub(super) fn muscle_paths(stick_figure: &StickFigure) -> [MusclePath; 10] {
    let lengths = Lengths::of(stick_figure);
    let t = lengths.trunk;
    let trunk = |x: f64, up: f64| (Segment::Trunk, [x * t, -up * t]);
    let thigh = |x: f64, along: f64| (Segment::LeftThigh, [x * t, along * lengths.thigh]);
    let right = |x: f64, along: f64| (Segment::RightThigh, [x * t, along * lengths.residual_thigh()]);
    let shank = |x: f64, along: f64| (Segment::LeftShank, [x * t, along * lengths.shank]);
    let heel = (Segment::LeftFoot, [-0.9 * lengths.left_foot.behind, 0.5 * lengths.left_foot.height]);
    let instep = (Segment::LeftFoot, [0.13 * t, 0.35 * lengths.left_foot.height]);
    [
        vec![trunk(-0.13, -0.04), thigh(-0.14, 0.45), thigh(-0.10, 0.90), shank(-0.10, 0.10)],
        vec![trunk(-0.17, 0.20), trunk(-0.20, 0.02), thigh(-0.13, 0.28)],
        vec![trunk(0.05, 0.30), trunk(0.13, 0.03), thigh(0.07, 0.25)],
        vec![thigh(-0.08, 0.93), shank(-0.13, 0.12), shank(-0.13, 0.38), shank(-0.055, 0.86), heel],
        vec![thigh(0.11, 0.30), thigh(0.12, 0.68), thigh(0.11, 0.98), shank(0.08, 0.10)],
        vec![shank(-0.05, 0.20), shank(-0.08, 0.48), shank(-0.04, 0.86), heel],
        vec![shank(0.05, 0.14), shank(0.06, 0.50), shank(0.045, 0.92), instep],
        vec![trunk(-0.13, -0.04), right(-0.14, 0.40), right(-0.10, 0.88)],
        vec![trunk(-0.17, 0.20), trunk(-0.20, 0.02), right(-0.13, 0.28)],
        vec![trunk(0.05, 0.30), trunk(0.13, 0.03), right(0.07, 0.25)],
    ]
}
