//! Limits of a gait that are not tuned.

use crate::device::Device;
use crate::model_error::ModelError;
use serde::{Deserialize, Serialize};

/// A number for each kind of domain.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PerDomainKind {
    /// DS2.
    pub ds2: f64,
    /// DS3.
    pub ds3: f64,
    /// SS2.
    pub ss2: f64,
    /// SS1.
    pub ss1: f64,
}

/// Limits of a gait. Defaults are those of the reference problem. Some are assumptions, because no measurement exists.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct GaitLimits {
    /// Friction coefficient of the feet (FROST's planar examples: 0.6).
    pub friction: f64,
    /// Friction coefficient of the impulse at heel strike.
    pub impact_friction: f64,
    /// Smallest walking speed D / sum T, m/s. Without it, the cheapest gait is a slow shuffle.
    pub speed_min_m_s: f64,
    /// Largest walking speed, m/s.
    pub speed_max_m_s: f64,
    /// Smallest length of each step, m.
    pub step_min_m: f64,
    /// Largest length of each step, m.
    pub step_max_m: f64,
    /// Shortest duration of each kind of domain, s.
    pub duration_min_s: PerDomainKind,
    /// Longest duration of each kind of domain, s.
    pub duration_max_s: PerDomainKind,
    /// Smallest knee flexion, rad. It excludes the singular straight posture.
    pub knee_min_rad: f64,
    /// Largest knee flexion, rad.
    pub knee_max_rad: f64,
    /// Anatomical limit of both hip angles in addition to a7, rad.
    pub hip_max_rad: f64,
    /// Largest human hip torque, N m.
    pub hip_torque_n_m: f64,
    /// Largest human knee torque, N m.
    pub knee_torque_n_m: f64,
    /// Largest human plantarflexion torque, N m.
    pub ankle_plantarflexion_torque_n_m: f64,
    /// Largest human dorsiflexion torque, N m.
    pub ankle_dorsiflexion_torque_n_m: f64,
    /// Smallest forward hip velocity in SS1, m/s. It makes the phase monotonic.
    pub phase_rate_min_m_s: f64,
    /// Smallest half width of the range of torso lean, rad. It gives the range an interior if a6 = 0.
    pub torso_tolerance_rad: f64,
    /// Smallest downward toe velocity at toe strike, m/s. It makes the guard transversal.
    pub toe_touchdown_m_s: f64,
    /// Smallest downward heel velocity at heel strike, m/s.
    pub heel_touchdown_m_s: f64,
    /// Smallest swing clearance at mid-swing, m; it applies if a5 is smaller.
    pub clearance_min_m: f64,
    /// Smallest normal force at the start of a domain that ends by unloading, N. It decreases linearly to 0.
    pub liftoff_force_n: f64,
    /// Largest component of a contact force, N.
    pub contact_force_max_n: f64,
    /// Largest component of an impulse, N s.
    pub impulse_max_n_s: f64,
    /// Smallest fibre length, optimal fibre lengths.
    pub fibre_length_min: f64,
    /// Largest fibre length, optimal fibre lengths.
    pub fibre_length_max: f64,
}

impl Default for GaitLimits {
    fn default() -> Self {
        Self {
            friction: 0.6,
            impact_friction: 0.6,
            speed_min_m_s: 1.0,
            speed_max_m_s: 1.4,
            step_min_m: 0.5,
            step_max_m: 0.85,
            duration_min_s: PerDomainKind { ds2: 0.03, ds3: 0.02, ss2: 0.08, ss1: 0.08 },
            duration_max_s: PerDomainKind { ds2: 0.3, ds3: 0.3, ss2: 0.7, ss1: 0.7 },
            knee_min_rad: 0.02,
            knee_max_rad: 1.45,
            hip_max_rad: 1.2,
            hip_torque_n_m: 200.0,
            knee_torque_n_m: 200.0,
            ankle_plantarflexion_torque_n_m: 180.0,
            ankle_dorsiflexion_torque_n_m: 50.0,
            phase_rate_min_m_s: 0.1,
            torso_tolerance_rad: 0.005,
            toe_touchdown_m_s: 0.1,
            heel_touchdown_m_s: 0.1,
            clearance_min_m: 0.005,
            liftoff_force_n: 20.0,
            contact_force_max_n: 3000.0,
            impulse_max_n_s: 500.0,
            fibre_length_min: 0.3,
            fibre_length_max: 1.6,
        }
    }
}

impl GaitLimits {
    /// Lowest and highest torques of hip_L, knee_L, ankle_L, hip_R, and of the prosthetic knee and ankle, N m.
    pub fn joint_torques_n_m(&self, device: &Device) -> [(f64, f64); 6] {
        let both = |largest: f64| (-largest, largest);
        [
            both(self.hip_torque_n_m),
            both(self.knee_torque_n_m),
            (-self.ankle_plantarflexion_torque_n_m, self.ankle_dorsiflexion_torque_n_m),
            both(self.hip_torque_n_m),
            both(device.knee_torque_limit_n_m),
            both(device.ankle_torque_limit_n_m),
        ]
    }

    /// Checks the range of each limit, and that ranges of the gait have an interior.
    ///
    /// # Errors
    /// [`ModelError::OutOfRange`] with the field.
    pub fn validate(&self) -> Result<(), ModelError> {
        let checks = [
            ("friction", self.friction, 0.1, 2.0),
            ("impact_friction", self.impact_friction, 0.1, 2.0),
            ("speed_min_m_s", self.speed_min_m_s, 0.1, 2.5),
            ("step_min_m", self.step_min_m, 0.1, 1.2),
            ("knee_min_rad", self.knee_min_rad, 0.0, 0.3),
            ("knee_max_rad", self.knee_max_rad, 0.5, 2.4),
            ("hip_max_rad", self.hip_max_rad, 0.2, 2.0),
            ("hip_torque_n_m", self.hip_torque_n_m, 5.0, 1000.0),
            ("knee_torque_n_m", self.knee_torque_n_m, 5.0, 1000.0),
            ("ankle_plantarflexion_torque_n_m", self.ankle_plantarflexion_torque_n_m, 5.0, 1000.0),
            ("ankle_dorsiflexion_torque_n_m", self.ankle_dorsiflexion_torque_n_m, 5.0, 1000.0),
            ("phase_rate_min_m_s", self.phase_rate_min_m_s, 0.01, 1.0),
            ("torso_tolerance_rad", self.torso_tolerance_rad, 1e-4, 0.1),
            ("toe_touchdown_m_s", self.toe_touchdown_m_s, 0.0, 1.0),
            ("heel_touchdown_m_s", self.heel_touchdown_m_s, 0.0, 1.0),
            ("clearance_min_m", self.clearance_min_m, 0.0, 0.1),
            ("liftoff_force_n", self.liftoff_force_n, 0.0, 200.0),
            ("contact_force_max_n", self.contact_force_max_n, 500.0, 20000.0),
            ("impulse_max_n_s", self.impulse_max_n_s, 10.0, 5000.0),
            ("fibre_length_min", self.fibre_length_min, 0.1, 0.9),
            ("fibre_length_max", self.fibre_length_max, 1.1, 2.0),
        ];
        for (field, value, minimum, maximum) in checks {
            ModelError::check_range(&format!("limits.{field}"), value, minimum, maximum)?;
        }
        for (field, value, lower, range) in [
            ("speed_max_m_s", self.speed_max_m_s, "speed_min_m_s", (self.speed_min_m_s + 1e-3, 3.0)),
            ("step_max_m", self.step_max_m, "step_min_m", (self.step_min_m + 1e-3, 1.5)),
        ] {
            let relation = format!("above {lower}");
            ModelError::check_related_range(&format!("limits.{field}"), value, range, ("", &relation))?;
        }
        let (low, high) = (self.duration_min_s, self.duration_max_s);
        for (name, minimum, maximum) in [
            ("ds2", low.ds2, high.ds2),
            ("ds3", low.ds3, high.ds3),
            ("ss2", low.ss2, high.ss2),
            ("ss1", low.ss1, high.ss1),
        ] {
            ModelError::check_range(&format!("limits.duration_min_s.{name}"), minimum, 0.005, 1.0)?;
            let (field, relation) = (format!("limits.duration_max_s.{name}"), format!("above duration_min_s.{name}"));
            ModelError::check_related_range(&field, maximum, (minimum + 1e-3, 2.0), ("", &relation))?;
        }
        Ok(())
    }
}
