//! The prosthesis on the right leg, read from a data file.

use crate::subject::ModelError;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// A transfemoral prosthesis with powered knee and ankle, worn on the right leg through an adapter.
///
/// The prosthetic knee sits `shank_length_m + ankle_height_m` above the ground; the right thigh link takes up the
/// rest of the hip height, so that both feet are flat in upright standing.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Device {
    /// Name shown to people.
    pub name: String,
    /// Mass at the prosthetic knee that moves with the thigh, kg.
    pub knee_housing_mass_kg: f64,
    /// Its moment of inertia about its own centre, kg m².
    pub knee_housing_inertia_kg_m2: f64,
    /// Mass of the adapter, midway between human and prosthetic knee, kg.
    pub adapter_mass_kg: f64,
    /// Radius of gyration of the adapter, m.
    pub adapter_gyration_radius_m: f64,
    /// Whether the user's own bent shank and foot are carried behind (a non-disabled user with a bypass).
    pub carried_limb: bool,
    /// Mass of the prosthetic shank, kg.
    pub shank_mass_kg: f64,
    /// Knee to ankle, m.
    pub shank_length_m: f64,
    /// Centre of mass below the knee, in shank lengths.
    pub shank_com_fraction: f64,
    /// Radius of gyration about the centre of mass, in shank lengths.
    pub shank_gyration_fraction: f64,
    /// Mass of the prosthetic foot with shoe, kg.
    pub foot_mass_kg: f64,
    /// Centre of mass ahead of the ankle, m.
    pub foot_com_forward_m: f64,
    /// Centre of mass below the ankle, m.
    pub foot_com_down_m: f64,
    /// Moment of inertia about the centre of mass, kg m².
    pub foot_inertia_kg_m2: f64,
    /// Ankle above the sole, m.
    pub ankle_height_m: f64,
    /// Heel contact behind the ankle, m.
    pub heel_behind_m: f64,
    /// Toe contact ahead of the ankle, m.
    pub toe_ahead_m: f64,
    /// Largest knee torque, N m.
    pub knee_torque_limit_n_m: f64,
    /// Largest ankle torque, N m.
    pub ankle_torque_limit_n_m: f64,
    /// Largest knee and ankle speed, rad/s.
    pub joint_speed_limit_rad_s: f64,
    /// Plantarflexion stop, rad (dorsiflexion positive).
    pub ankle_min_rad: f64,
    /// Dorsiflexion stop, rad.
    pub ankle_max_rad: f64,
    /// Where each value comes from, by field name; assumptions say so.
    #[serde(default)]
    pub sources: BTreeMap<String, String>,
}

/// The built-in device file.
const AMPRO3_JSON: &str = include_str!("../data/ampro3.json");

impl Device {
    /// The AMPRO3 powered knee-ankle prosthesis (values and sources in `data/ampro3.json`).
    ///
    /// # Errors
    /// Never in practice: a test reads the built-in file.
    pub fn ampro3() -> Result<Self, ModelError> {
        Self::from_json(AMPRO3_JSON)
    }

    /// Reads a device from JSON and validates it.
    ///
    /// # Errors
    /// [`ModelError::Malformed`] with line and column, or [`ModelError::OutOfRange`] naming the field.
    pub fn from_json(text: &str) -> Result<Self, ModelError> {
        let device: Self = serde_json::from_str(text)
            .map_err(|e| ModelError::Malformed { what: "device file".to_owned(), reason: e.to_string() })?;
        device.validate()?;
        Ok(device)
    }

    /// Checks every number against its allowed range.
    ///
    /// # Errors
    /// [`ModelError::OutOfRange`] naming the field.
    pub fn validate(&self) -> Result<(), ModelError> {
        let checks = [
            ("knee_housing_mass_kg", self.knee_housing_mass_kg, 0.0, 10.0),
            ("knee_housing_inertia_kg_m2", self.knee_housing_inertia_kg_m2, 0.0, 0.5),
            ("adapter_mass_kg", self.adapter_mass_kg, 0.0, 10.0),
            ("adapter_gyration_radius_m", self.adapter_gyration_radius_m, 0.0, 0.5),
            ("shank_mass_kg", self.shank_mass_kg, 0.2, 15.0),
            ("shank_length_m", self.shank_length_m, 0.2, 0.6),
            ("shank_com_fraction", self.shank_com_fraction, 0.05, 0.95),
            ("shank_gyration_fraction", self.shank_gyration_fraction, 0.05, 0.6),
            ("foot_mass_kg", self.foot_mass_kg, 0.1, 5.0),
            ("foot_com_forward_m", self.foot_com_forward_m, -0.1, 0.2),
            ("foot_com_down_m", self.foot_com_down_m, 0.0, 0.15),
            ("foot_inertia_kg_m2", self.foot_inertia_kg_m2, 1e-4, 0.2),
            ("ankle_height_m", self.ankle_height_m, 0.01, 0.2),
            ("heel_behind_m", self.heel_behind_m, 0.01, 0.15),
            ("toe_ahead_m", self.toe_ahead_m, 0.05, 0.3),
            ("knee_torque_limit_n_m", self.knee_torque_limit_n_m, 1.0, 500.0),
            ("ankle_torque_limit_n_m", self.ankle_torque_limit_n_m, 1.0, 500.0),
            ("joint_speed_limit_rad_s", self.joint_speed_limit_rad_s, 0.5, 50.0),
            ("ankle_min_rad", self.ankle_min_rad, -1.2, -0.02),
            ("ankle_max_rad", self.ankle_max_rad, 0.02, 1.2),
        ];
        for (field, value, minimum, maximum) in checks {
            ModelError::check_range(&format!("device.{field}"), value, minimum, maximum)?;
        }
        Ok(())
    }
}
