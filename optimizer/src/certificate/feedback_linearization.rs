//! A domain under feedback linearisation: accelerations, and their derivatives with respect to the state.
//!
//! The controller imposes `e'' = -2 eps e' - eps^2 e` on the outputs and, if the hip velocity is an output, `dp'' =
//! -eps (dp' - v_hip)`, or `dp'' = 0` for a free hip velocity. In the fully actuated domains, contacts and outputs
//! determine all nine accelerations. In single support, the three equations of motion without a torque (hip point and
//! torso) also determine the contact forces and, in SS1, the ninth acceleration. [`super::torques`] computes the
//! torques.

use super::contact_kinematics::{Contact, force_by_angle};
use super::dormand_prince::System;
use super::guard::Guard;
use super::virtual_constraints::VirtualConstraints;
use crate::body::{Axis, InverseDynamics, PointState, WalkerModel};
use crate::gait::Gait;
use crate::walking::{CYCLE, Domain, DomainKind};
use nalgebra::{SMatrix, SVector};

/// Coordinates, then velocities.
pub(super) type State = SVector<f64, 18>;
/// Derivative of a state with respect to a state.
pub(super) type StateMatrix = SMatrix<f64, 18, 18>;

/// Controller bandwidth, 1/s: output gains `eps^2` and `2 eps`, hip-velocity gain `eps` (FROST's form).
pub(super) const BANDWIDTH: f64 = 20.0;

/// Largest pull that is rounding error of an event at zero force, N.
const PULL_N: f64 = 1e-2;

/// Number of unknowns: nine accelerations and at most three contact forces.
const UNKNOWNS: usize = 12;
/// Number of equations of motion without a torque: hip point and torso.
const UNACTUATED: usize = 3;

/// The unknowns at a state: nine accelerations, then the contact forces in single support.
type Unknowns = SVector<f64, UNKNOWNS>;

/// A domain under control of the feedback linearisation.
#[derive(Debug, Clone)]
pub(super) struct Control<'a> {
    pub(super) model: &'a WalkerModel,
    pub(super) domain: Domain,
    pub(super) contacts: Vec<Contact>,
    pub(super) constraints: VirtualConstraints,
    guard: Guard,
    /// Gain of the hip velocity if it is an output, 1/s; 0 for a free hip velocity.
    pub(super) hip_gain: f64,
    /// Planned duration, s.
    pub(super) nominal_duration: f64,
}

/// Coordinates and velocities of a state.
pub(super) fn split(x: &State) -> ([f64; 9], [f64; 9]) {
    (std::array::from_fn(|i| x[i]), std::array::from_fn(|i| x[9 + i]))
}

/// A state of coordinates and velocities.
pub(super) fn join(q: &[f64; 9], qd: &[f64; 9]) -> State {
    State::from_fn(|i, _| if i < 9 { q[i] } else { qd[i - 9] })
}

/// The accelerations among the unknowns.
fn accelerations(unknowns: &Unknowns) -> [f64; 9] {
    std::array::from_fn(|i| unknowns[i])
}

impl<'a> Control<'a> {
    /// Domain `d` of a well-formed gait.
    pub(super) fn new(model: &'a WalkerModel, gait: &Gait, d: usize) -> Self {
        let domain = CYCLE[d];
        Self {
            model,
            domain,
            contacts: Contact::of_domain(model, domain),
            constraints: VirtualConstraints::new(model, gait, d),
            guard: Guard::new(model, domain),
            hip_gain: BANDWIDTH,
            nominal_duration: gait.domains[d].duration_s,
        }
    }

    /// Number of contact forces that the motion determines: all in single support, none in double support.
    fn decided_forces(&self) -> usize {
        match self.domain.kind {
            DomainKind::Ss2 | DomainKind::Ss1 => self.contacts.len(),
            DomainKind::Ds2 | DomainKind::Ds3 => 0,
        }
    }

    /// The linear equations `A y = b` of the unknowns at a state.
    fn equations(&self, x: &State) -> (SMatrix<f64, UNKNOWNS, UNKNOWNS>, Unknowns) {
        let (q, qd) = split(x);
        let still = PointState::new(&q, &qd, &[0.0; 9]);
        let mut a = SMatrix::<f64, UNKNOWNS, UNKNOWNS>::zeros();
        let mut b = Unknowns::zeros();
        let mut row = 0;
        for contact in &self.contacts {
            for (column, value) in contact.gradient(&still).into_iter().enumerate() {
                a[(row, column)] = value;
            }
            b[row] = -contact.acceleration(&still);
            row += 1;
        }
        let constraints = &self.constraints;
        let phase = constraints.phase(&q, &qd, &[0.0; 9]);
        let gradient = constraints.phase_gradient();
        for (&output, y) in constraints.outputs.iter().zip(constraints.desired(phase.s)) {
            for (angle, slope) in gradient.iter().enumerate() {
                a[(row, 2 + angle)] = -y[1] * slope;
            }
            a[(row, output)] += 1.0;
            let error = q[output] - y[0];
            let error_rate = qd[output] - y[1] * phase.rate;
            b[row] = y[2] * phase.rate * phase.rate - 2.0 * BANDWIDTH * error_rate - BANDWIDTH * BANDWIDTH * error;
            row += 1;
        }
        if let Some(wanted) = constraints.hip_velocity {
            for (angle, slope) in constraints.gradient.iter().enumerate() {
                a[(row, 2 + angle)] = *slope;
            }
            b[row] = -self.hip_gain * (constraints.hip(&q, &qd, &[0.0; 9])[1] - wanted);
            row += 1;
        }
        let forces = self.decided_forces();
        if forces > 0 {
            let dynamics = InverseDynamics::new(self.model);
            let bias = dynamics.rows(&still);
            let mass = dynamics.jacobian(&still).mass;
            for i in 0..UNACTUATED {
                for j in 0..9 {
                    a[(row + i, j)] = mass[i][j];
                }
                b[row + i] = -bias[i];
            }
            for (c, contact) in self.contacts.iter().enumerate() {
                let gradient = contact.gradient(&still);
                for i in 0..UNACTUATED {
                    a[(row + i, 9 + c)] = -gradient[i];
                }
            }
        }
        // Unknowns that the motion does not determine are zero.
        for unused in 9 + forces..UNKNOWNS {
            a[(unused, unused)] = 1.0;
        }
        (a, b)
    }

    fn unknowns(&self, x: &State) -> Option<Unknowns> {
        let (a, b) = self.equations(x);
        a.lu().solve(&b).filter(|y| y.iter().all(|v| v.is_finite()))
    }

    /// Accelerations at a state; `None` if contacts and outputs do not determine them.
    pub(super) fn acceleration(&self, x: &State) -> Option<[f64; 9]> {
        self.unknowns(x).map(|y| accelerations(&y))
    }

    /// The contact force of a row, N, if the motion determines it.
    pub(super) fn force(&self, x: &State, row: usize) -> Option<f64> {
        self.unknowns(x).map(|y| y[9 + row])
    }

    /// Whether no normal force that the motion determines pulls on the ground.
    pub(super) fn stays_on_the_ground(&self, x: &State) -> bool {
        let Some(y) = self.unknowns(x) else { return false };
        let forces = &y.as_slice()[9..9 + self.decided_forces()];
        self.contacts.iter().zip(forces).all(|(contact, &force)| contact.row.axis == Axis::X || force >= -PULL_N)
    }

    /// Derivatives of the unknowns with respect to the state, by implicit differentiation: `A dy = -(dA y - db)`.
    fn unknowns_by_state(&self, x: &State) -> Option<SMatrix<f64, UNKNOWNS, 18>> {
        let (a, b) = self.equations(x);
        let factors = a.lu();
        let y = factors.solve(&b)?;
        let (q, qd) = split(x);
        let qdd = accelerations(&y);
        let state = PointState::new(&q, &qd, &qdd);
        // Derivative of each residual for constant y.
        let mut by_state = SMatrix::<f64, UNKNOWNS, 18>::zeros();
        let mut row = 0;
        for contact in &self.contacts {
            let by_angle = contact.acceleration_by_angle(&state);
            let by_rate = contact.acceleration_by_rate(&state);
            for k in 0..7 {
                by_state[(row, 2 + k)] = by_angle[k];
                by_state[(row, 11 + k)] = by_rate[k];
            }
            row += 1;
        }
        let constraints = &self.constraints;
        let phase = constraints.phase(&q, &qd, &qdd);
        let gradient = constraints.phase_gradient();
        for (&output, y) in constraints.outputs.iter().zip(constraints.desired(phase.s)) {
            let by_phase = -y[3] * phase.rate * phase.rate
                - y[2] * phase.acceleration
                - 2.0 * BANDWIDTH * y[2] * phase.rate
                - BANDWIDTH * BANDWIDTH * y[1];
            let by_phase_rate = -2.0 * y[2] * phase.rate - 2.0 * BANDWIDTH * y[1];
            for (angle, slope) in gradient.iter().enumerate() {
                by_state[(row, 2 + angle)] = by_phase * slope;
                by_state[(row, 11 + angle)] = by_phase_rate * slope;
            }
            by_state[(row, output)] += BANDWIDTH * BANDWIDTH;
            by_state[(row, 9 + output)] += 2.0 * BANDWIDTH;
            row += 1;
        }
        if constraints.hip_velocity.is_some() {
            for (angle, slope) in constraints.gradient.iter().enumerate() {
                by_state[(row, 11 + angle)] = self.hip_gain * slope;
            }
            row += 1;
        }
        let forces = self.decided_forces();
        if forces > 0 {
            let dynamics = InverseDynamics::new(self.model).jacobian(&state);
            let by_force = force_by_angle(&self.contacts, &y.as_slice()[9..9 + forces], &state);
            for i in 0..UNACTUATED {
                for k in 0..7 {
                    let moved_force = if i < 2 { 0.0 } else { by_force[i - 2][k] };
                    by_state[(row + i, 2 + k)] = dynamics.angle[i][k] - moved_force;
                    by_state[(row + i, 11 + k)] = dynamics.rate[i][k];
                }
            }
        }
        factors.solve(&-by_state)
    }

    /// d(state derivative)/d(state).
    pub(super) fn derivative_by_state(&self, x: &State) -> Option<StateMatrix> {
        let unknowns = self.unknowns_by_state(x)?;
        let mut result = StateMatrix::zeros();
        for i in 0..9 {
            result[(i, 9 + i)] = 1.0;
            for j in 0..18 {
                result[(9 + i, j)] = unknowns[(i, j)];
            }
        }
        Some(result)
    }

    /// d(contact force of a row)/d(state), if the motion determines it.
    fn force_by_state(&self, x: &State, row: usize) -> Option<State> {
        self.unknowns_by_state(x).map(|unknowns| unknowns.row(9 + row).transpose())
    }

    /// Value at a state; `None` if the motion is not determined.
    pub(super) fn guard_value(&self, x: &State) -> Option<f64> {
        let (q, qd) = split(x);
        match &self.guard {
            Guard::Landing(contact) => Some(contact.position(&PointState::new(&q, &qd, &[0.0; 9]))),
            Guard::Unloading(row) => self.force(x, *row),
            Guard::Plan => Some(1.0 - self.constraints.phase(&q, &qd, &[0.0; 9]).s),
        }
    }

    /// Derivative with respect to the state.
    pub(super) fn guard_gradient(&self, x: &State) -> Option<State> {
        let (q, qd) = split(x);
        match &self.guard {
            Guard::Landing(contact) => {
                let gradient = contact.gradient(&PointState::new(&q, &qd, &[0.0; 9]));
                Some(State::from_fn(|i, _| if i < 9 { gradient[i] } else { 0.0 }))
            }
            Guard::Unloading(row) => self.force_by_state(x, *row),
            Guard::Plan => {
                let gradient = self.constraints.phase_gradient();
                Some(State::from_fn(|i, _| if (2..9).contains(&i) { -gradient[i - 2] } else { 0.0 }))
            }
        }
    }
}

impl System<18> for Control<'_> {
    fn derivative(&self, x: &State) -> Option<State> {
        self.acceleration(x).map(|qdd| State::from_fn(|i, _| if i < 9 { x[9 + i] } else { qdd[i - 9] }))
    }
}

/// A state, followed by the columns of the derivative of the flow with respect to the initial state.
pub(super) const VARIATIONAL: usize = 18 + 18 * 18;

/// The walker with its variational equation `Phi' = df/dx Phi`.
pub(super) struct Variational<'a, 'b>(pub(super) &'b Control<'a>);

/// Splits a variational state into state and flow derivative.
pub(super) fn split_variational(z: &SVector<f64, VARIATIONAL>) -> (State, StateMatrix) {
    (State::from_column_slice(&z.as_slice()[..18]), StateMatrix::from_column_slice(&z.as_slice()[18..]))
}

/// Joins a state and a flow derivative.
pub(super) fn join_variational(x: &State, flow: &StateMatrix) -> SVector<f64, VARIATIONAL> {
    SVector::from_fn(|i, _| if i < 18 { x[i] } else { flow.as_slice()[i - 18] })
}

impl System<VARIATIONAL> for Variational<'_, '_> {
    fn derivative(&self, z: &SVector<f64, VARIATIONAL>) -> Option<SVector<f64, VARIATIONAL>> {
        let (x, flow) = split_variational(z);
        Some(join_variational(&self.0.derivative(&x)?, &(self.0.derivative_by_state(&x)? * flow)))
    }
}
