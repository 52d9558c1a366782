//! The outlines of a body with a prosthesis on its right leg.
//!
//! The model has joints and links; flesh, head and the housings of the prosthesis are drawn around them. Widths are
//! shares of the length of the trunk, from hip to shoulder.

use super::segment::{Segment, UNITS_PER_M};
use gait_optimizer::gait::stick_figure::StickFigure;
use std::fmt::Write;

/// Share of the human thigh that the socket of the prosthesis leaves free.
const ABOVE_SOCKET: f64 = 0.62;

/// A part of the body with an outline in the frame of its segment.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct BodyPart {
    pub(crate) segment: Segment,
    /// Class in the style sheet.
    pub(crate) class: &'static str,
    /// The `d` of its path.
    pub(crate) outline: String,
}

/// Lengths in units of a drawing.
pub(super) struct Lengths {
    /// From hip to shoulder.
    pub(super) trunk: f64,
    pub(super) thigh: f64,
    pub(super) shank: f64,
    /// From hip to the axle of the prosthetic knee.
    pub(super) right_thigh: f64,
    right_shank: f64,
    pub(super) left_foot: Foot,
    right_foot: Foot,
}

/// Contact points of a foot from its ankle, in units of a drawing.
pub(super) struct Foot {
    pub(super) height: f64,
    pub(super) behind: f64,
    ahead: f64,
}

impl Lengths {
    pub(super) fn of(stick_figure: &StickFigure) -> Self {
        let between = |a: [f64; 2], b: [f64; 2]| (a[0] - b[0]).hypot(a[1] - b[1]) * UNITS_PER_M;
        let foot = |ankle: [f64; 2], heel: [f64; 2], toe: [f64; 2]| {
            let sole = between(heel, toe).max(1e-6);
            let behind = between(ankle, heel).powi(2);
            // The foot of the perpendicular from the ankle to the sole.
            let along = (sole * sole + behind - between(ankle, toe).powi(2)) / (2.0 * sole);
            Foot { height: (behind - along * along).max(0.0).sqrt(), behind: along, ahead: sole - along }
        };
        let (left, right) = (&stick_figure.left, &stick_figure.right);
        Self {
            trunk: between(stick_figure.hip, stick_figure.shoulder),
            thigh: between(stick_figure.hip, left.knee),
            shank: between(left.knee, left.ankle),
            right_thigh: between(stick_figure.hip, right.knee),
            right_shank: between(right.knee, right.ankle),
            left_foot: foot(left.ankle, left.heel, left.toe),
            right_foot: foot(right.ankle, right.heel, right.toe),
        }
    }

    /// The human part of the right thigh.
    pub(super) fn residual_thigh(&self) -> f64 {
        self.thigh.min(self.right_thigh)
    }
}

/// The parts of the body in a walker, in the order in which they are drawn: the right leg is nearest.
pub(crate) fn parts(stick_figure: &StickFigure) -> Vec<BodyPart> {
    let lengths = Lengths::of(stick_figure);
    let t = lengths.trunk;
    let human = lengths.residual_thigh();
    let part = |segment, class, outline| BodyPart { segment, class, outline };
    vec![
        part(Segment::LeftFoot, "left", foot(t, &lengths.left_foot)),
        part(Segment::LeftShank, "left", shank(t, lengths.shank)),
        part(Segment::LeftThigh, "left", thigh(t, lengths.thigh)),
        part(Segment::Trunk, "trunk", trunk(t)),
        part(Segment::RightThigh, "right", thigh(t, human)),
        part(Segment::RightFoot, "device", device_foot(t, &lengths.right_foot)),
        part(Segment::RightShank, "device", device_shank(t, lengths.right_shank)),
        part(Segment::RightThigh, "device", socket(t, human, lengths.right_thigh)),
        part(Segment::RightShank, "axle", axle(0.05 * t, 0.0)),
        part(Segment::RightShank, "axle", axle(0.035 * t, lengths.right_shank)),
    ]
}

/// Two legs without a prosthesis, for a reference gait. Both have the size of the left one.
pub(super) fn human_parts(stick_figure: &StickFigure) -> Vec<BodyPart> {
    let lengths = Lengths::of(stick_figure);
    let t = lengths.trunk;
    let leg = |class, [thigh_of, shank_of, foot_of]: [Segment; 3]| {
        [
            BodyPart { segment: foot_of, class, outline: foot(t, &lengths.left_foot) },
            BodyPart { segment: shank_of, class, outline: shank(t, lengths.shank) },
            BodyPart { segment: thigh_of, class, outline: thigh(t, lengths.thigh) },
        ]
    };
    let mut parts = Vec::from(leg("left", [Segment::LeftThigh, Segment::LeftShank, Segment::LeftFoot]));
    parts.push(BodyPart { segment: Segment::Trunk, class: "trunk", outline: trunk(t) });
    parts.extend(leg("right", [Segment::RightThigh, Segment::RightShank, Segment::RightFoot]));
    parts
}

/// A closed path: its start, and its lines (one point) and cubic curves (three points).
fn outline(start: [f64; 2], pieces: &[&[[f64; 2]]]) -> String {
    let mut path = format!("M{:.1} {:.1}", start[0], start[1]);
    for piece in pieces {
        path.push(if piece.len() == 1 { 'L' } else { 'C' });
        for (place, [x, y]) in piece.iter().enumerate() {
            // Writing to a String cannot fail.
            let _ = write!(path, "{}{x:.1} {y:.1}", if place == 0 { "" } else { " " });
        }
    }
    path.push('Z');
    path
}

/// A path with straight sides.
fn polygon(points: &[[f64; 2]]) -> String {
    let lines: Vec<&[[f64; 2]]> = points.iter().skip(1).map(std::slice::from_ref).collect();
    outline(points.first().copied().unwrap_or_default(), &lines)
}

/// Trunk, neck and head.
fn trunk(t: f64) -> String {
    let at = |x: f64, up: f64| [x * t, -up * t];
    outline(
        at(-0.13, -0.08),
        &[
            // Buttock, back and neck.
            &[at(-0.27, -0.06), at(-0.27, 0.16), at(-0.19, 0.28)],
            &[at(-0.15, 0.40), at(-0.15, 0.46), at(-0.19, 0.58)],
            &[at(-0.25, 0.76), at(-0.21, 0.93), at(-0.10, 1.01)],
            &[at(-0.075, 1.06), at(-0.075, 1.10), at(-0.08, 1.20)],
            // Head, with a nose that shows where the walker goes.
            &[at(-0.21, 1.30), at(-0.18, 1.63), at(0.05, 1.63)],
            &[at(0.18, 1.63), at(0.23, 1.52), at(0.215, 1.43)],
            &[at(0.265, 1.345)],
            &[at(0.22, 1.325)],
            &[at(0.225, 1.29), at(0.23, 1.24), at(0.20, 1.18)],
            &[at(0.17, 1.155), at(0.12, 1.165), at(0.09, 1.17)],
            // Throat, chest and belly.
            &[at(0.07, 1.10), at(0.06, 1.06), at(0.08, 1.01)],
            &[at(0.18, 0.94), at(0.22, 0.82), at(0.21, 0.68)],
            &[at(0.20, 0.52), at(0.16, 0.46), at(0.17, 0.34)],
            &[at(0.18, 0.20), at(0.18, 0.02), at(0.10, -0.06)],
        ],
    )
}

fn thigh(t: f64, length: f64) -> String {
    let at = |x: f64, along: f64| [x * t, along * length];
    let knee = length + 0.13 * t;
    outline(
        at(-0.19, 0.0),
        &[
            &[at(-0.19, 0.35), at(-0.125, 0.70), at(-0.10, 1.0)],
            &[[-0.10 * t, knee], [0.11 * t, knee], at(0.11, 1.0)],
            &[at(0.15, 0.70), at(0.21, 0.35), at(0.17, 0.0)],
            &[[0.15 * t, -0.21 * t], [-0.17 * t, -0.21 * t], at(-0.19, 0.0)],
        ],
    )
}

fn shank(t: f64, length: f64) -> String {
    let at = |x: f64, along: f64| [x * t, along * length];
    let ankle = length + 0.07 * t;
    outline(
        at(-0.10, 0.0),
        &[
            &[[-0.10 * t, -0.12 * t], [0.10 * t, -0.12 * t], at(0.10, 0.0)],
            &[at(0.10, 0.40), at(0.075, 0.75), at(0.065, 1.0)],
            &[[0.06 * t, ankle], [-0.06 * t, ankle], at(-0.065, 1.0)],
            &[at(-0.07, 0.80), at(-0.175, 0.55), at(-0.165, 0.30)],
            &[at(-0.16, 0.15), at(-0.12, 0.08), at(-0.10, 0.0)],
        ],
    )
}

fn foot(t: f64, foot: &Foot) -> String {
    let (h, heel, ball) = (foot.height, -foot.behind, foot.ahead);
    outline(
        [-0.075 * t, -0.02 * t],
        &[
            &[[-0.09 * t, 0.3 * h], [heel - 0.03 * t, 0.4 * h], [heel - 0.035 * t, 0.7 * h]],
            &[[heel - 0.035 * t, h], [heel - 0.02 * t, h], [heel, h]],
            // The foot of the model is rigid and turns about the ball, so the toes are short.
            &[[ball, h]],
            &[[ball + 0.08 * t, h], [ball + 0.08 * t, 0.55 * h], [ball + 0.01 * t, 0.42 * h]],
            &[[0.6 * ball, 0.3 * h], [0.11 * t, 0.15 * h], [0.075 * t, -0.02 * t]],
            &[[0.05 * t, -0.08 * t], [-0.05 * t, -0.08 * t], [-0.075 * t, -0.02 * t]],
        ],
    )
}

/// The cuff around the human thigh and the bar to the knee of the prosthesis.
fn socket(t: f64, human: f64, length: f64) -> String {
    let top = ABOVE_SOCKET * human;
    let bottom = human.min(length - 0.05 * t);
    polygon(&[
        [-0.16 * t, top],
        [0.18 * t, top],
        [0.14 * t, bottom],
        [0.09 * t, bottom + 0.06 * t],
        [0.07 * t, length],
        [-0.07 * t, length],
        [-0.09 * t, bottom + 0.06 * t],
        [-0.13 * t, bottom],
    ])
}

/// Knee housing, drive and pylon.
fn device_shank(t: f64, length: f64) -> String {
    polygon(&[
        [-0.06 * t, -0.12 * t],
        [0.06 * t, -0.12 * t],
        [0.12 * t, -0.05 * t],
        [0.12 * t, 0.40 * length],
        [0.05 * t, 0.52 * length],
        [0.05 * t, length - 0.07 * t],
        [0.075 * t, length],
        [0.05 * t, length + 0.07 * t],
        [-0.05 * t, length + 0.07 * t],
        [-0.075 * t, length],
        [-0.05 * t, length - 0.07 * t],
        [-0.05 * t, 0.52 * length],
        [-0.12 * t, 0.40 * length],
        [-0.12 * t, -0.05 * t],
    ])
}

fn device_foot(t: f64, foot: &Foot) -> String {
    let (h, heel, ball) = (foot.height, -foot.behind, foot.ahead);
    polygon(&[
        [-0.06 * t, 0.0],
        [-0.07 * t, 0.55 * h],
        [heel, 0.75 * h],
        [heel, h],
        [ball + 0.02 * t, h],
        [ball + 0.03 * t, 0.80 * h],
        [0.10 * t, 0.5 * h],
        [0.06 * t, 0.0],
    ])
}

/// A circle on the axis of a segment.
fn axle(radius: f64, along: f64) -> String {
    let (arc, across) = (format!("a{radius:.1} {radius:.1} 0 1 0"), 2.0 * radius);
    format!("M{:.1} {along:.1}{arc} {across:.1} 0{arc} {:.1} 0Z", -radius, -across)
}

#[cfg(test)]
mod tests {
    use super::super::segment::tests::standing;
    use super::*;

    #[test]
    fn prosthesis_has_parts_of_its_own_and_human_parts_have_curves() {
        let parts = parts(&standing());
        let of =
            |segment: Segment, class: &str| parts.iter().filter(|p| p.segment == segment && p.class == class).count();
        assert_eq!((of(Segment::RightThigh, "right"), of(Segment::RightThigh, "device")), (1, 1));
        assert_eq!((of(Segment::RightShank, "device"), of(Segment::RightFoot, "device")), (1, 1));
        assert_eq!((of(Segment::LeftShank, "left"), of(Segment::RightShank, "right")), (1, 0));
        for part in &parts {
            assert_eq!(part.outline.contains('C'), !matches!(part.class, "device" | "axle"), "{part:?}");
            assert!(!part.outline.contains("NaN"), "{part:?}");
        }
    }

    #[test]
    fn lengths_follow_from_the_joints() {
        let lengths = Lengths::of(&standing());
        for (found, expected) in [
            (lengths.trunk, 50.0),
            (lengths.thigh, 43.0),
            (lengths.right_thigh, 51.0),
            (lengths.left_foot.height, 7.0),
            (lengths.left_foot.behind, 6.0),
            (lengths.left_foot.ahead, 15.0),
        ] {
            assert!((found - expected).abs() < 1e-9, "{found} {expected}");
        }
    }

    #[test]
    fn reference_gait_is_drawn_without_a_prosthesis() {
        assert!(human_parts(&standing()).iter().all(|part| part.class != "device" && part.class != "axle"));
    }
}
