//! The virtual constraints of a domain of the gait, as its controller uses them.

use crate::body::WalkerModel;
use crate::gait::{DomainTrajectory, Gait};
use crate::walking::{BEZIER_COEFFICIENTS, CYCLE, basis, phase_gradient};

/// Outputs `q_o - y(s)` with `s = (dp - start) / width`, and the hip velocity if it is an output.
#[derive(Debug, Clone)]
pub(super) struct VirtualConstraints {
    /// Driven coordinates, as indices into q.
    pub(super) outputs: Vec<usize>,
    bezier: Vec<[f64; BEZIER_COEFFICIENTS]>,
    /// d(dp)/d(the seven angles), m/rad.
    pub(super) gradient: [f64; 7],
    start: f64,
    width: f64,
    /// Set point of the rate of dp, m/s.
    pub(super) hip_velocity: Option<f64>,
}

/// The phase s with its first two time derivatives.
#[derive(Debug, Clone, Copy)]
pub(super) struct PhaseVariable {
    pub(super) s: f64,
    pub(super) rate: f64,
    pub(super) acceleration: f64,
}

/// A desired output with its derivatives with respect to s.
pub(super) type Desired = [f64; 4];

impl VirtualConstraints {
    /// The virtual constraints of domain `d` of a well-formed gait.
    pub(super) fn new(model: &WalkerModel, gait: &Gait, d: usize) -> Self {
        let trajectory: &DomainTrajectory = &gait.domains[d];
        Self {
            outputs: trajectory.outputs.clone(),
            bezier: trajectory.bezier.iter().map(|row| std::array::from_fn(|i| row[i])).collect(),
            gradient: phase_gradient(model, CYCLE[d].stance),
            start: trajectory.phase_start_m,
            width: trajectory.phase_end_m - trajectory.phase_start_m,
            hip_velocity: CYCLE[d].hip_velocity_index().map(|i| gait.hip_velocity_m_s[i]),
        }
    }

    fn along(&self, coordinates: &[f64; 9]) -> f64 {
        self.gradient.iter().zip(&coordinates[2..]).map(|(g, c)| g * c).sum()
    }

    /// Hip position dp (m), velocity and acceleration from coordinates and their derivatives.
    pub(super) fn hip(&self, q: &[f64; 9], qd: &[f64; 9], qdd: &[f64; 9]) -> [f64; 3] {
        [self.along(q), self.along(qd), self.along(qdd)]
    }

    /// Phase with its time derivatives.
    pub(super) fn phase(&self, q: &[f64; 9], qd: &[f64; 9], qdd: &[f64; 9]) -> PhaseVariable {
        let [position, velocity, acceleration] = self.hip(q, qd, qdd);
        PhaseVariable {
            s: (position - self.start) / self.width,
            rate: velocity / self.width,
            acceleration: acceleration / self.width,
        }
    }

    /// ds/d(the seven angles), which equals d(rate)/d(angle rates).
    pub(super) fn phase_gradient(&self) -> [f64; 7] {
        self.gradient.map(|g| g / self.width)
    }

    /// The desired outputs at a phase.
    pub(super) fn desired(&self, s: f64) -> Vec<Desired> {
        let b = basis(s);
        self.bezier
            .iter()
            .map(|alpha| std::array::from_fn(|order| alpha.iter().zip(&b[order]).map(|(a, b)| a * b).sum()))
            .collect()
    }
}
