//! Guards: functions of the state that are positive in a domain and vanish at its end.

use super::contact_kinematics::Contact;
use crate::body::{Axis, FootPoint, WalkerModel};
use crate::walking::{ContactRow, Domain, DomainKind};

/// The guard of a domain.
#[derive(Debug, Clone)]
pub(super) enum Guard {
    /// Height of a heel or toe that lands, m.
    Landing(Contact),
    /// Contact force of a row that the motion determines, N.
    Unloading(usize),
    /// Rest of the phase, `1 - s`. In DS3 the controller has two redundant torques and unloads the trailing toe itself,
    /// so the phase ends the domain.
    Plan,
}

impl Guard {
    pub(super) fn new(model: &WalkerModel, domain: Domain) -> Self {
        let landing = |point, side| Self::Landing(Contact::new(model, ContactRow { point, side, axis: Axis::Z }));
        match (domain.kind, domain.unloading_row()) {
            (DomainKind::Ds2, _) => landing(FootPoint::Toe, domain.stance),
            (DomainKind::Ss1, _) => landing(FootPoint::Heel, domain.stance.other()),
            (DomainKind::Ss2, Some(row)) => Self::Unloading(row),
            (DomainKind::Ds3 | DomainKind::Ss2, _) => Self::Plan,
        }
    }
}
