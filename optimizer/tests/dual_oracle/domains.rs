//! The eight domains of a stride: contacts, and joints that follow a Bezier curve.

use crate::Scalar;
use crate::walker::Walker;

#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Kind {
    Ds2,
    Ds3,
    Ss2,
    Ss1,
}

/// A contact row: foot point (0 heel_L, 1 toe_L, 2 heel_R, 3 toe_R) and axis (0 x, 1 z).
pub(crate) type Contact = (usize, usize);

pub(crate) struct Domain {
    pub(crate) kind: Kind,
    /// 0 left, 1 right.
    pub(crate) stance: usize,
    pub(crate) intervals: usize,
    pub(crate) contacts: Vec<Contact>,
    /// Indices into q.
    pub(crate) outputs: Vec<usize>,
    /// Index of the hip velocity.
    pub(crate) hip_velocity: Option<usize>,
}

impl Domain {
    pub(crate) fn points(&self) -> usize {
        2 * self.intervals + 1
    }

    pub(crate) fn opens_with_impact(&self) -> bool {
        matches!(self.kind, Kind::Ds2 | Kind::Ds3)
    }
}

/// From right heel strike, with the given mesh intervals of DS2, DS3, SS2, SS1.
pub(crate) fn stride(intervals: [usize; 4]) -> Vec<Domain> {
    let mut result = Vec::new();
    for (step, stance) in [(0, 1), (1, 0)] {
        let swing = 1 - stance;
        let (heel, toe, trailing) = (2 * stance, 2 * stance + 1, 2 * swing + 1);
        let (st, sw) = (3 + 3 * stance, 3 + 3 * swing);
        let mut add = |kind, intervals, contacts, outputs, hip_velocity| {
            result.push(Domain { kind, stance, intervals, contacts, outputs, hip_velocity });
        };
        add(
            Kind::Ds2,
            intervals[0],
            vec![(heel, 0), (heel, 1), (trailing, 0), (trailing, 1)],
            vec![st, sw, sw + 1, sw + 2],
            Some(2 * step),
        );
        add(
            Kind::Ds3,
            intervals[1],
            vec![(toe, 0), (heel, 1), (toe, 1), (trailing, 0), (trailing, 1)],
            vec![st, sw, sw + 1],
            Some(2 * step + 1),
        );
        add(
            Kind::Ss2,
            intervals[2],
            vec![(toe, 0), (heel, 1), (toe, 1)],
            vec![st, st + 1, sw, sw + 1, sw + 2],
            Some(2 * step + 1),
        );
        add(Kind::Ss1, intervals[3], vec![(toe, 0), (toe, 1)], vec![st, st + 1, st + 2, sw, sw + 1, sw + 2], None);
    }
    result
}

/// Target of a contact row: the right toe at 0, the left toe at x_L - D in the right step and at x_L in the left step,
/// heels behind their toes, the ground at 0.
pub(crate) fn target<D: Scalar>(
    walker: &Walker,
    domain: &Domain,
    (point, axis): Contact,
    right_step: D,
    stride: D,
) -> D {
    if axis == 1 {
        return crate::constant(0.0);
    }
    let side = point / 2;
    let toe = match (side, domain.stance) {
        (1, _) => crate::constant(0.0),
        (_, 1) => right_step - stride,
        _ => right_step,
    };
    let leg = &walker.legs[side];
    if point % 2 == 0 { toe - (leg.heel_behind + leg.toe_ahead) } else { toe }
}
