//! Limit cycles of lab sessions.

use gait_optimizer::limit_cycle;
use gaitwright_service::studies::lab;
use gaitwright_store::MeasurementFileId;
use serde::Serialize;
use utoipa::ToSchema;

/// Angle and velocity of a joint, sample by sample.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct LimitCycle {
    /// Name of the joint.
    joint: String,
    /// Angle, rad.
    angle_rad: Vec<f64>,
    /// Velocity, rad/s.
    velocity_rad_s: Vec<f64>,
}

impl From<limit_cycle::LimitCycle> for LimitCycle {
    fn from(limit_cycle: limit_cycle::LimitCycle) -> Self {
        let limit_cycle::LimitCycle { joint, angle_rad, velocity_rad_s } = limit_cycle;
        Self { joint, angle_rad, velocity_rad_s }
    }
}

/// Limit cycles of a walk.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct LimitCycles {
    /// Number of the walk, 1 to 3.
    walk: u8,
    /// Measurement file of the walk.
    measurement_file_id: MeasurementFileId,
    /// Cut-off frequency of the zero-phase low-pass filter before central differences, Hz.
    cutoff_hz: f64,
    /// Angle (rad) and velocity (rad/s) of each recorded joint, sample by sample.
    joints: Vec<LimitCycle>,
}

impl From<lab::LimitCycles> for LimitCycles {
    fn from(cycles: lab::LimitCycles) -> Self {
        let lab::LimitCycles { walk, measurement_file_id, cutoff_hz, joints, .. } = cycles;
        Self { walk, measurement_file_id, cutoff_hz, joints: joints.into_iter().map(Into::into).collect() }
    }
}
