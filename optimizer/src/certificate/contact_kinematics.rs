//! Kinematics of a contact row with first derivatives, in generalised coordinates.
//!
//! The gait problem has its own implementation, which the certificate checks and therefore does not use. With the
//! vectors `a_k = R(psi_k) u_k` of the point on its three links, the gradient with respect to psi_k is `-a_z` (x) or
//! `a_x` (z).

use crate::body::coordinates::{LINKS, congruence, to_generalised};
use crate::body::{Axis, ContactPoint, PointState, WalkerModel};
use crate::walking::{ContactRow, Domain};

/// A component of a heel or toe.
#[derive(Debug, Clone)]
pub(super) struct Contact {
    pub(super) row: ContactRow,
    point: ContactPoint,
}

impl Contact {
    pub(super) fn new(model: &WalkerModel, row: ContactRow) -> Self {
        Self { row, point: model.contact_point(row.point, row.side) }
    }

    /// The contact rows of a domain, in the order of the forces.
    pub(super) fn of_domain(model: &WalkerModel, domain: Domain) -> Vec<Self> {
        domain.contact_rows().into_iter().map(|row| Self::new(model, row)).collect()
    }

    fn along(&self, vector: [f64; 2]) -> f64 {
        match self.row.axis {
            Axis::X => vector[0],
            Axis::Z => vector[1],
        }
    }

    /// Expands a quantity of the links of the leg to a vector of all links.
    fn per_link(&self, state: &PointState, quantity: impl Fn(usize, [f64; 2]) -> [f64; 2]) -> [f64; LINKS] {
        let mut result = [0.0; LINKS];
        for (k, u) in self.point.vectors.iter().enumerate() {
            let link = self.point.first_link + k;
            result[link] = self.along(quantity(link, state.rotated(link, u)));
        }
        result
    }

    /// Position of the component, m.
    pub(super) fn position(&self, state: &PointState) -> f64 {
        self.along(state.contact_position(&self.point))
    }

    /// Velocity of the component, m/s.
    pub(super) fn velocity(&self, state: &PointState) -> f64 {
        self.along(state.contact_velocity(&self.point))
    }

    /// Acceleration of the component, m/s². With zero accelerations in the state, its part due to velocities.
    pub(super) fn acceleration(&self, state: &PointState) -> f64 {
        self.along(state.contact_acceleration(&self.point))
    }

    /// Gradient of the position, which is also d(velocity)/d(qd) and d(acceleration)/d(qdd).
    pub(super) fn gradient(&self, state: &PointState) -> [f64; 9] {
        let angles = to_generalised(&self.per_link(state, |_, a| [-a[1], a[0]]));
        let mut gradient = [0.0; 9];
        match self.row.axis {
            Axis::X => gradient[0] = 1.0,
            Axis::Z => gradient[1] = 1.0,
        }
        gradient[2..].copy_from_slice(&angles);
        gradient
    }

    /// d(velocity)/d(the seven angles).
    pub(super) fn velocity_by_angle(&self, state: &PointState) -> [f64; LINKS] {
        to_generalised(&self.per_link(state, |link, a| {
            let rate = state.rate[link];
            [-rate * a[0], -rate * a[1]]
        }))
    }

    /// d(acceleration)/d(the seven angles).
    pub(super) fn acceleration_by_angle(&self, state: &PointState) -> [f64; LINKS] {
        to_generalised(&self.per_link(state, |link, a| {
            let (acceleration, squared) = (state.acceleration[link], state.rate[link].powi(2));
            [-acceleration * a[0] + squared * a[1], -acceleration * a[1] - squared * a[0]]
        }))
    }

    /// d(acceleration)/d(the seven angle rates).
    pub(super) fn acceleration_by_rate(&self, state: &PointState) -> [f64; LINKS] {
        to_generalised(&self.per_link(state, |link, a| {
            let twice = 2.0 * state.rate[link];
            [-twice * a[0], -twice * a[1]]
        }))
    }
}

/// d(J^T f)/d(the seven angles) for given forces. The rows of the hip point are zero.
pub(super) fn force_by_angle(contacts: &[Contact], forces: &[f64], state: &PointState) -> [[f64; LINKS]; LINKS] {
    let mut link = [[0.0; LINKS]; LINKS];
    for (contact, force) in contacts.iter().zip(forces) {
        let curvature = contact.per_link(state, |_, a| [-a[0], -a[1]]);
        for k in 0..LINKS {
            link[k][k] += force * curvature[k];
        }
    }
    congruence(&link)
}
