//! Reference gaits: what Gait RMSE is measured against.

use serde::{Deserialize, Serialize};

/// Mean joint angles over one gait cycle from right heel strike, radians, seven-link convention.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ReferenceGait {
    /// Name shown to people.
    pub name: String,
    /// Citation, licence and processing of the data.
    pub provenance: String,
    /// 101 rows (0..=100 % of the cycle) of torso, hip_L, knee_L, ankle_L, hip_R in rad.
    pub angles_rad: Vec<[f64; 5]>,
}
