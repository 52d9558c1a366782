//! Ranges of the coordinates: hip position, torso lean and joint angles.

use crate::device::Device;
use crate::settings::GaitLimits;
use crate::tuned_bounds::TunedBounds;

/// Lower and upper bounds of the nine coordinates, m and rad.
pub(super) fn joint_ranges(bounds: &TunedBounds, limits: &GaitLimits, device: &Device) -> [(f64, f64); 9] {
    let torso = bounds.a6.max(limits.torso_tolerance_rad);
    let hip = bounds.a7.to_radians().min(limits.hip_max_rad);
    let ankle = bounds.a8.to_radians();
    let knee = (limits.knee_min_rad, limits.knee_max_rad);
    [
        (-10.0, 10.0),
        (-10.0, 10.0),
        (-torso, torso),
        (-hip, hip),
        knee,
        (-ankle, ankle),
        (-hip, hip),
        knee,
        (device.ankle_min_rad.max(-ankle), device.ankle_max_rad.min(ankle)),
    ]
}
