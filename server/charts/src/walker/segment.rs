//! The segments of the walker and where a stick figure puts them.

use gait_optimizer::gait::stick_figure::StickFigure;

/// Units of a drawing per metre.
pub(crate) const UNITS_PER_M: f64 = 100.0;

/// A rigid segment. `web/static/walker_body.mjs` has the same names and frames.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Segment {
    Trunk,
    LeftThigh,
    LeftShank,
    LeftFoot,
    RightThigh,
    RightShank,
    RightFoot,
}

/// Where a segment is: its origin in units of the drawing, y down, and its rotation, clockwise.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Placement {
    pub(crate) x: f64,
    pub(crate) y: f64,
    pub(crate) degrees: f64,
}

impl Segment {
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Trunk => "trunk",
            Self::LeftThigh => "left.thigh",
            Self::LeftShank => "left.shank",
            Self::LeftFoot => "left.foot",
            Self::RightThigh => "right.thigh",
            Self::RightShank => "right.shank",
            Self::RightFoot => "right.foot",
        }
    }

    /// The origin of the frame, the two joints that direct it, and the direction from the first to the second one at
    /// rest: up, down or forward, in degrees clockwise from forward.
    fn frame(self, stick_figure: &StickFigure) -> ([f64; 2], [f64; 2], [f64; 2], f64) {
        let (left, right) = (&stick_figure.left, &stick_figure.right);
        match self {
            Self::Trunk => (stick_figure.hip, stick_figure.hip, stick_figure.shoulder, -90.0),
            Self::LeftThigh => (stick_figure.hip, stick_figure.hip, left.knee, 90.0),
            Self::LeftShank => (left.knee, left.knee, left.ankle, 90.0),
            Self::LeftFoot => (left.ankle, left.heel, left.toe, 0.0),
            Self::RightThigh => (stick_figure.hip, stick_figure.hip, right.knee, 90.0),
            Self::RightShank => (right.knee, right.knee, right.ankle, 90.0),
            Self::RightFoot => (right.ankle, right.heel, right.toe, 0.0),
        }
    }

    /// Where the segment is in a drawing whose origin is on the ground below the hip.
    pub(crate) fn placement(self, stick_figure: &StickFigure) -> Placement {
        let (origin, from, to, rest) = self.frame(stick_figure);
        let degrees = (from[1] - to[1]).atan2(to[0] - from[0]).to_degrees() - rest;
        Placement {
            x: (origin[0] - stick_figure.hip[0]) * UNITS_PER_M,
            y: -origin[1] * UNITS_PER_M,
            degrees: (degrees + 180.0).rem_euclid(360.0) - 180.0,
        }
    }
}

impl Placement {
    /// The value of a `transform` attribute.
    pub(crate) fn transform(&self) -> String {
        format!("translate({:.1} {:.1})rotate({:.1})", self.x, self.y, self.degrees)
    }

    /// A place of the segment in the drawing, in its units.
    pub(crate) fn applied(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let (sine, cosine) = self.degrees.to_radians().sin_cos();
        [self.x + x * cosine - y * sine, self.y + x * sine + y * cosine]
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use gait_optimizer::gait::stick_figure::LegPoints;

    /// A person who stands: all segments are at rest.
    pub(crate) fn standing() -> StickFigure {
        let leg = |knee: f64, ankle: f64| LegPoints {
            knee: [2.0, knee],
            ankle: [2.0, ankle],
            heel: [1.94, 0.0],
            toe: [2.15, 0.0],
        };
        StickFigure {
            time_s: 0.0,
            hip: [2.0, 0.93],
            shoulder: [2.0, 1.43],
            left: leg(0.5, 0.07),
            right: leg(0.42, 0.07),
        }
    }

    #[test]
    fn segments_of_a_standing_person_are_not_rotated() {
        use Segment::{LeftFoot, LeftShank, LeftThigh, RightFoot, RightShank, RightThigh, Trunk};
        for segment in [Trunk, LeftThigh, LeftShank, LeftFoot, RightThigh, RightShank, RightFoot] {
            let placement = segment.placement(&standing());
            assert!(placement.degrees.abs() < 1e-9, "{}: {placement:?}", segment.name());
        }
        let knee = Segment::LeftThigh.placement(&standing()).applied([0.0, 43.0]);
        assert!(knee[0].abs() < 1e-9 && (knee[1] + 50.0).abs() < 1e-9, "{knee:?}");
    }

    #[test]
    fn flexed_hip_moves_the_knee_forward() {
        let mut stick_figure = standing();
        stick_figure.left.knee = [2.43, 0.93];
        let placement = Segment::LeftThigh.placement(&stick_figure);
        assert!((placement.degrees + 90.0).abs() < 1e-9, "{placement:?}");
        let knee = placement.applied([0.0, 43.0]);
        assert!((knee[0] - 43.0).abs() < 1e-9 && (knee[1] + 93.0).abs() < 1e-9, "{knee:?}");
    }
}
