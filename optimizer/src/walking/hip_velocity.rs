//! Which domains have a hip velocity, and which of the four: one for each sequence of domains without an impact.

use super::domain_cycle::{Domain, DomainKind};
use crate::body::Side;

impl Domain {
    /// Whether the hip velocity is an output, of relative degree 1: in the fully actuated domains.
    pub fn has_hip_velocity(self) -> bool {
        self.kind != DomainKind::Ss1
    }

    /// Index of the hip velocity of the domain. There are four, one for each sequence of domains without impact.
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
}
