//! The eight domains of the stride and their cycle.
//!
//! Transitions with guard and reset:
//!
//! - DS2 to DS3: the stance toe lands (impact)
//! - DS3 to SS2: the force of the trailing toe vanishes (identity)
//! - SS2 to SS1: the force of the stance heel vanishes (identity)
//! - SS1 to DS2: the swing heel lands (impact, the legs exchange roles)

use crate::body::{Axis, FootPoint, Side};

/// The contact configuration of a domain.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DomainKind {
    /// Double support on stance heel and trailing toe.
    Ds2,
    /// Double support on the flat stance foot and the trailing toe.
    Ds3,
    /// Single support on the flat stance foot.
    Ss2,
    /// Single support on the stance toe, with one degree of underactuation.
    Ss1,
}

/// A domain: its contact configuration and its stance leg. In double support this is the leg that becomes the stance
/// leg.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Domain {
    /// Contact configuration.
    pub kind: DomainKind,
    /// Side of the stance leg.
    pub stance: Side,
}

/// A component of the force on a contact point.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ContactRow {
    /// Heel or toe.
    pub point: FootPoint,
    /// Foot.
    pub side: Side,
    /// Component.
    pub axis: Axis,
}

/// The cycle of domains, from right heel strike.
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

impl Domain {
    /// Name: `DS2_R`, ...
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

    /// Independent contact rows, in the order of the contact forces. A flat foot has three rows, because the x
    /// component of its heel would be redundant.
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

    /// Coordinates that the virtual constraints of relative degree 2 drive, as indices into q.
    pub fn outputs(self) -> Vec<usize> {
        let (st, sw) = (self.stance.hip(), self.stance.other().hip());
        match self.kind {
            DomainKind::Ds2 => vec![st, sw, sw + 1, sw + 2],
            DomainKind::Ds3 => vec![st, sw, sw + 1],
            DomainKind::Ss2 => vec![st, st + 1, sw, sw + 1, sw + 2],
            DomainKind::Ss1 => vec![st, st + 1, st + 2, sw, sw + 1, sw + 2],
        }
    }

    /// Whether the domain begins with an impact.
    pub fn opens_with_impact(self) -> bool {
        matches!(self.kind, DomainKind::Ds2 | DomainKind::Ds3)
    }

    /// Index in [`Self::contact_rows`] of the vertical row of the point that lands in the impact.
    pub fn landing_row(self) -> Option<usize> {
        match self.kind {
            DomainKind::Ds2 => Some(1),
            DomainKind::Ds3 => Some(2),
            DomainKind::Ss2 | DomainKind::Ss1 => None,
        }
    }

    /// Index in [`Self::contact_rows`] of the vertical force that vanishes at the end of the domain.
    pub fn unloading_row(self) -> Option<usize> {
        match self.kind {
            DomainKind::Ds3 => Some(4),
            DomainKind::Ss2 => Some(1),
            DomainKind::Ds2 | DomainKind::Ss1 => None,
        }
    }

    /// Indices in [`Self::contact_rows`] of all forces that vanish at the end of the domain: that of
    /// [`Self::unloading_row`], and the friction if the foot leaves the ground.
    pub fn unloaded_rows(self) -> &'static [usize] {
        match self.kind {
            DomainKind::Ds3 => &[3, 4],
            DomainKind::Ss2 => &[1],
            DomainKind::Ds2 | DomainKind::Ss1 => &[],
        }
    }
}
