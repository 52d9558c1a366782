//! Regularisation of the objective: weights on torques, accelerations, contact forces and muscles.

use crate::model_error::ModelError;
use serde::{Deserialize, Serialize};

/// Regularisation of the objective. Each weight multiplies the time integral of a square.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Regularisation {
    /// Smoothing eps of |P| to `sqrt(P^2 + eps^2) - eps`, W.
    pub power_smoothing_w: f64,
    /// Weight of |u/100|², torques in N m. It determines the redundant torques of double support.
    pub torque: f64,
    /// Weight of |qdd/30|², accelerations in m/s² and rad/s².
    pub acceleration: f64,
    /// Weight of |lambda/500|², contact forces in N.
    pub contact_force: f64,
    /// Weight of |activation|². Without it, redundant muscles co-contract.
    pub activation: f64,
    /// Weight of |v_ce/V|². Without it, fibre velocities alternate between nodes and midpoints.
    pub fibre_velocity: f64,
    /// Weight of the squared bend |s_(k-1) - 2 s_k + s_(k+1)|² of activations at adjacent nodes of a domain. Without it,
    /// activations alternate from node to node (`examples/activation_smoothness.rs`). Zero in
    /// [`crate::settings::GaitSettings::reference_problem`].
    pub activation_bend: f64,
}

impl Default for Regularisation {
    fn default() -> Self {
        Self {
            power_smoothing_w: 1.0,
            torque: 3e-3,
            acceleration: 1e-4,
            contact_force: 1e-4,
            activation: 3e-3,
            fibre_velocity: 1e-2,
            activation_bend: 0.03,
        }
    }
}

impl Regularisation {
    /// Checks the range of each weight.
    ///
    /// # Errors
    /// [`ModelError::OutOfRange`] with the field.
    pub fn validate(&self) -> Result<(), ModelError> {
        ModelError::check_range("regularisation.power_smoothing_w", self.power_smoothing_w, 1e-3, 100.0)?;
        for (field, value) in [
            ("torque", self.torque),
            ("acceleration", self.acceleration),
            ("contact_force", self.contact_force),
            ("activation", self.activation),
            ("fibre_velocity", self.fibre_velocity),
            ("activation_bend", self.activation_bend),
        ] {
            ModelError::check_range(&format!("regularisation.{field}"), value, 0.0, 10.0)?;
        }
        Ok(())
    }
}
