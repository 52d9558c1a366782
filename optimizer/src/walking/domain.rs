//! The eight domains of the stride and their cycle.
//!
//! Edges (guard, reset): DS2 -> DS3 stance toe lands (impact); DS3 -> SS2 trailing toe unloads (identity);
//! SS2 -> SS1 stance heel unloads (identity); SS1 -> DS2 swing heel lands (impact, sides swap).

use crate::gait::{Axis, FootPoint, Side};

/// Contact situation.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DomainKind {
    /// Stance heel and trailing toe on the ground.
    Ds2,
    /// Flat stance foot and trailing toe on the ground.
    Ds3,
    /// Flat stance foot on the ground.
    Ss2,
    /// Stance toe on the ground: one degree of underactuation.
    Ss1,
}

/// A domain: its contact situation and the leg that is (becoming) the stance leg.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Domain {
    /// Contact situation.
    pub kind: DomainKind,
    /// Stance side.
    pub stance: Side,
}

/// One component of one contact point.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ContactRow {
    /// Heel or toe.
    pub point: FootPoint,
    /// Which foot.
    pub side: Side,
    /// Forward or up.
    pub axis: Axis,
}

/// The directed cycle, from right heel strike.
pub const CYCLE: [Domain; 8] = {
    const fn domain(kind: DomainKind, stance: Side) -> Domain {
        Domain { kind, stance }
    }
    [
        domain(DomainKind::Ds2, Side::Right),
        domain(DomainKind::Ds3, Side::Right),
        domain(DomainKind::Ss2, Side::Right),
        domain(DomainKind::Ss1, Side::Right),
        domain(DomainKind::Ds2, Side::Left),
        domain(DomainKind::Ds3, Side::Left),
        domain(DomainKind::Ss2, Side::Left),
        domain(DomainKind::Ss1, Side::Left),
    ]
};

impl Side {
    /// The other leg.
    #[must_use]
    pub const fn other(self) -> Self {
        match self {
            Self::Left => Self::Right,
            Self::Right => Self::Left,
        }
    }

    /// Index in q of this leg's hip; knee and ankle follow.
    pub const fn hip(self) -> usize {
        match self {
            Self::Left => 3,
            Self::Right => 6,
        }
    }
}

impl Domain {
    /// `DS2_R`, ...
    pub fn name(self) -> &'static str {
        match (self.kind, self.stance) {
            (DomainKind::Ds2, Side::Right) => "DS2_R",
            (DomainKind::Ds3, Side::Right) => "DS3_R",
            (DomainKind::Ss2, Side::Right) => "SS2_R",
            (DomainKind::Ss1, Side::Right) => "SS1_R",
            (DomainKind::Ds2, Side::Left) => "DS2_L",
            (DomainKind::Ds3, Side::Left) => "DS3_L",
            (DomainKind::Ss2, Side::Left) => "SS2_L",
            (DomainKind::Ss1, Side::Left) => "SS1_L",
        }
    }

    /// Independent contact rows, in the order of the contact forces. A flat foot is three rows: its heel x would be
    /// redundant.
    pub fn contact_rows(self) -> Vec<ContactRow> {
        let row = |point, side, axis| ContactRow { point, side, axis };
        let (st, sw) = (self.stance, self.stance.other());
        let trailing = [row(FootPoint::Toe, sw, Axis::X), row(FootPoint::Toe, sw, Axis::Z)];
        let flat =
            [row(FootPoint::Toe, st, Axis::X), row(FootPoint::Heel, st, Axis::Z), row(FootPoint::Toe, st, Axis::Z)];
        match self.kind {
            DomainKind::Ds2 => {
                let mut rows = vec![row(FootPoint::Heel, st, Axis::X), row(FootPoint::Heel, st, Axis::Z)];
                rows.extend(trailing);
                rows
            }
            DomainKind::Ds3 => flat.into_iter().chain(trailing).collect(),
            DomainKind::Ss2 => flat.to_vec(),
            DomainKind::Ss1 => vec![row(FootPoint::Toe, st, Axis::X), row(FootPoint::Toe, st, Axis::Z)],
        }
    }

    /// Coordinates (indices into q) driven by the relative-degree-2 virtual constraints.
    pub fn outputs(self) -> Vec<usize> {
        let (st, sw) = (self.stance.hip(), self.stance.other().hip());
        match self.kind {
            DomainKind::Ds2 => vec![st, sw, sw + 1, sw + 2],
            DomainKind::Ds3 => vec![st, sw, sw + 1],
            DomainKind::Ss2 => vec![st, st + 1, sw, sw + 1, sw + 2],
            DomainKind::Ss1 => vec![st, st + 1, st + 2, sw, sw + 1, sw + 2],
        }
    }

    /// Whether the relative-degree-1 hip-velocity output is present (the fully actuated domains).
    pub fn has_hip_velocity(self) -> bool {
        self.kind != DomainKind::Ss1
    }

    /// Which of the four hip velocities (one per impact-free run of domains) applies.
    pub fn hip_velocity_index(self) -> Option<usize> {
        let step = match self.stance {
            Side::Right => 0,
            Side::Left => 2,
        };
        match self.kind {
            DomainKind::Ds2 => Some(step),
            DomainKind::Ds3 | DomainKind::Ss2 => Some(step + 1),
            DomainKind::Ss1 => None,
        }
    }

    /// Whether the domain is entered through an impact.
    pub fn opens_with_impact(self) -> bool {
        matches!(self.kind, DomainKind::Ds2 | DomainKind::Ds3)
    }

    /// Index among [`Self::contact_rows`] of the vertical row whose point lands at the opening impact.
    pub fn landing_row(self) -> Option<usize> {
        match self.kind {
            DomainKind::Ds2 => Some(1),
            DomainKind::Ds3 => Some(2),
            DomainKind::Ss2 | DomainKind::Ss1 => None,
        }
    }

    /// Index among [`Self::contact_rows`] of the vertical force that vanishes at the end of the domain.
    pub fn unloading_row(self) -> Option<usize> {
        match self.kind {
            DomainKind::Ds3 => Some(4),
            DomainKind::Ss2 => Some(1),
            DomainKind::Ds2 | DomainKind::Ss1 => None,
        }
    }

    /// Indices among [`Self::contact_rows`] of all forces that vanish at the end of the domain: that one, and with the last
    /// vertical force of a foot its friction.
    pub fn unloaded_rows(self) -> &'static [usize] {
        match self.kind {
            DomainKind::Ds3 => &[3, 4],
            DomainKind::Ss2 => &[1],
            DomainKind::Ds2 | DomainKind::Ss1 => &[],
        }
    }
}
