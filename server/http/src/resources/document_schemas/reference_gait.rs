//! Reference gaits.

#![allow(dead_code)] // Schemas are never constructed.

use utoipa::ToSchema;

/// A reference gait: joint angles over the gait cycle, and the measured person. Forward lean, hip flexion, knee flexion
/// and ankle dorsiflexion are positive.
#[derive(Debug, ToSchema)]
pub(crate) struct ReferenceGaitDocument {
    /// Name.
    name: String,
    /// Citation, licence and processing of the data.
    provenance: String,
    /// 101 rows, at 0, 1, ..., 100 % of the gait cycle from right heel strike. Each row has the angles of torso, hip_L,
    /// knee_L, ankle_L and hip_R in this order, rad.
    #[schema(min_items = 101, max_items = 101)]
    angles_rad: Vec<Vec<f64>>,
    /// Standard deviations of the angles over strides, in the rows and columns of `angles_rad`, rad. Absent if they are
    /// not known.
    #[schema(min_items = 101, max_items = 101, required = false)]
    standard_deviation_rad: Vec<Vec<f64>>,
    /// Height of the measured person, m. Absent if it is not known.
    #[schema(required = false)]
    height_m: f64,
    /// Body mass of the measured person, kg. Absent if it is not known.
    #[schema(required = false)]
    body_mass_kg: f64,
}
