//! Guards: functions of the state that are positive in a domain and vanish at its end.

use super::contact::Contact;
use super::control::{Control, State, split};
use crate::body::{PointState, WalkerModel};
use crate::gait::{Axis, FootPoint};
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

    /// Value at a state; `None` if the motion is not determined.
    pub(super) fn value(&self, control: &Control<'_>, x: &State) -> Option<f64> {
        let (q, qd) = split(x);
        match self {
            Self::Landing(contact) => Some(contact.position(&PointState::new(&q, &qd, &[0.0; 9]))),
            Self::Unloading(row) => control.force(x, *row),
            Self::Plan => Some(1.0 - control.constraints.phase(&q, &qd, &[0.0; 9]).s),
        }
    }

    /// Derivative with respect to the state.
    pub(super) fn gradient(&self, control: &Control<'_>, x: &State) -> Option<State> {
        let (q, qd) = split(x);
        match self {
            Self::Landing(contact) => {
                let gradient = contact.gradient(&PointState::new(&q, &qd, &[0.0; 9]));
                Some(State::from_fn(|i, _| if i < 9 { gradient[i] } else { 0.0 }))
            }
            Self::Unloading(row) => control.force_by_state(x, *row),
            Self::Plan => {
                let gradient = control.constraints.phase_gradient();
                Some(State::from_fn(|i, _| if (2..9).contains(&i) { -gradient[i - 2] } else { 0.0 }))
            }
        }
    }
}
