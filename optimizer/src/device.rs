//! The device: a prosthesis on the right leg, read from a JSON file.

use crate::model_error::ModelError;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// A transfemoral prosthesis with powered knee and ankle, worn on the right leg through an adapter.
///
/// In upright standing both feet are flat: the prosthetic knee is `shank_length_m + ankle_height_m` above the ground,
/// and the right thigh link spans the rest of the hip height.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Device {
    /// Name of the model.
    pub name: String,
    /// Mass at the prosthetic knee that moves with the thigh, kg.
    pub knee_housing_mass_kg: f64,
    /// Moment of inertia of that mass about its own centre, kg m².
    pub knee_housing_inertia_kg_m2: f64,
    /// Mass of the adapter, which is midway between the human knee and the prosthetic knee, kg.
    pub adapter_mass_kg: f64,
    /// Radius of gyration of the adapter, m.
    pub adapter_gyration_radius_m: f64,
    /// Whether the model includes the subject's own shank and foot, carried behind with the knee bent: a subject without an
    /// amputation, with a bypass adapter.
    pub carried_limb: bool,
    /// Mass of the prosthetic shank, kg.
    pub shank_mass_kg: f64,
    /// Distance from knee to ankle, m.
    pub shank_length_m: f64,
    /// Distance of the centre of mass below the knee, in shank lengths.
    pub shank_com_fraction: f64,
    /// Radius of gyration about the centre of mass, in shank lengths.
    pub shank_gyration_fraction: f64,
    /// Mass of the prosthetic foot with shoe, kg.
    pub foot_mass_kg: f64,
    /// Distance of the centre of mass ahead of the ankle, m.
    pub foot_com_forward_m: f64,
    /// Distance of the centre of mass below the ankle, m.
    pub foot_com_down_m: f64,
    /// Moment of inertia about the centre of mass, kg m².
    pub foot_inertia_kg_m2: f64,
    /// Height of the ankle above the sole, m.
    pub ankle_height_m: f64,
    /// Distance of the heel contact behind the ankle, m.
    pub heel_behind_m: f64,
    /// Distance of the toe contact ahead of the ankle, m.
    pub toe_ahead_m: f64,
    /// Largest magnitude of the knee torque, N m.
    pub knee_torque_limit_n_m: f64,
    /// Largest magnitude of the ankle torque, N m.
    pub ankle_torque_limit_n_m: f64,
    /// Largest magnitude of the knee and ankle velocities, rad/s.
    pub joint_speed_limit_rad_s: f64,
    /// Plantarflexion stop, rad (dorsiflexion positive).
    pub ankle_min_rad: f64,
    /// Dorsiflexion stop, rad.
    pub ankle_max_rad: f64,
    /// Source of each value, by field name. Assumed values are marked as such.
    #[serde(default)]
    pub sources: BTreeMap<String, String>,
}

/// A numeric field of a device.
#[derive(Debug, Clone, Copy)]
pub struct DeviceField {
    /// Name with unit, as in the file: `shank_mass_kg`.
    pub name: &'static str,
    /// Description with unit.
    pub meaning: &'static str,
    /// Smallest allowed value.
    pub minimum: f64,
    /// Largest allowed value.
    pub maximum: f64,
    /// The value of a device.
    pub value: fn(&Device) -> f64,
}

const fn field(
    name: &'static str,
    meaning: &'static str,
    (minimum, maximum): (f64, f64),
    value: fn(&Device) -> f64,
) -> DeviceField {
    DeviceField { name, meaning, minimum, maximum, value }
}

/// The built-in device file.
const AMPRO3_JSON: &str = include_str!("../data/ampro3.json");

impl Device {
    /// The numeric fields of a device, in the order of the file.
    pub const FIELDS: [DeviceField; 20] = [
        field("knee_housing_mass_kg", "mass at the prosthetic knee that moves with the thigh, kg", (0.0, 10.0), |d| {
            d.knee_housing_mass_kg
        }),
        field(
            "knee_housing_inertia_kg_m2",
            "moment of inertia, about its own centre of mass, of the part at the prosthetic knee that moves with the thigh, kg m²",
            (0.0, 0.5),
            |d| d.knee_housing_inertia_kg_m2,
        ),
        field(
            "adapter_mass_kg",
            "mass of the adapter, which is midway between the human knee and the prosthetic knee, kg",
            (0.0, 10.0),
            |d| d.adapter_mass_kg,
        ),
        field("adapter_gyration_radius_m", "radius of gyration of the adapter, m", (0.0, 0.5), |d| {
            d.adapter_gyration_radius_m
        }),
        field("shank_mass_kg", "mass of the prosthetic shank, kg", (0.2, 15.0), |d| d.shank_mass_kg),
        field("shank_length_m", "distance from knee to ankle, m", (0.2, 0.6), |d| d.shank_length_m),
        field(
            "shank_com_fraction",
            "distance of the shank's centre of mass below the knee, in shank lengths",
            (0.05, 0.95),
            |d| d.shank_com_fraction,
        ),
        field(
            "shank_gyration_fraction",
            "radius of gyration of the shank about its centre of mass, in shank lengths",
            (0.05, 0.6),
            |d| d.shank_gyration_fraction,
        ),
        field("foot_mass_kg", "mass of the prosthetic foot with shoe, kg", (0.1, 5.0), |d| d.foot_mass_kg),
        field("foot_com_forward_m", "distance of the foot's centre of mass ahead of the ankle, m", (-0.1, 0.2), |d| {
            d.foot_com_forward_m
        }),
        field("foot_com_down_m", "distance of the foot's centre of mass below the ankle, m", (0.0, 0.15), |d| {
            d.foot_com_down_m
        }),
        field(
            "foot_inertia_kg_m2",
            "moment of inertia of the foot about its centre of mass, kg m²",
            (1e-4, 0.2),
            |d| d.foot_inertia_kg_m2,
        ),
        field("ankle_height_m", "height of the ankle above the sole, m", (0.01, 0.2), |d| d.ankle_height_m),
        field("heel_behind_m", "distance of the heel contact behind the ankle, m", (0.01, 0.15), |d| d.heel_behind_m),
        field("toe_ahead_m", "distance of the toe contact ahead of the ankle, m", (0.05, 0.3), |d| d.toe_ahead_m),
        field("knee_torque_limit_n_m", "largest knee torque, N m", (1.0, 500.0), |d| d.knee_torque_limit_n_m),
        field("ankle_torque_limit_n_m", "largest ankle torque, N m", (1.0, 500.0), |d| d.ankle_torque_limit_n_m),
        field("joint_speed_limit_rad_s", "largest knee and ankle speed, rad/s", (0.5, 50.0), |d| {
            d.joint_speed_limit_rad_s
        }),
        field("ankle_min_rad", "plantarflexion stop, rad (dorsiflexion positive)", (-1.2, -0.02), |d| d.ankle_min_rad),
        field("ankle_max_rad", "dorsiflexion stop, rad", (0.02, 1.2), |d| d.ankle_max_rad),
    ];

    /// The AMPRO3 powered knee-ankle prosthesis. `data/ampro3.json` has the values and their sources.
    ///
    /// # Errors
    /// If the built-in file is invalid; a test excludes it.
    pub fn ampro3() -> Result<Self, ModelError> {
        Self::from_json(AMPRO3_JSON)
    }

    /// Parses and validates a device in JSON.
    ///
    /// # Errors
    /// [`ModelError::Malformed`] with line and column, or [`ModelError::OutOfRange`] with the field.
    pub fn from_json(text: &str) -> Result<Self, ModelError> {
        let device: Self = serde_json::from_str(text)
            .map_err(|e| ModelError::Malformed { what: "device file".to_owned(), reason: e.to_string() })?;
        device.validate()?;
        Ok(device)
    }

    /// Checks each number against its allowed range.
    ///
    /// # Errors
    /// [`ModelError::OutOfRange`] with the field.
    pub fn validate(&self) -> Result<(), ModelError> {
        for DeviceField { name, minimum, maximum, value, .. } in &Self::FIELDS {
            ModelError::check_range(&format!("device.{name}"), value(self), *minimum, *maximum)?;
        }
        Ok(())
    }
}
