//! The phase variable: the linearised forward position of the hip relative to the stance toe.

use crate::body::coordinates::to_generalised;
use crate::body::{Side, WalkerModel, point::first_link};

/// Gradient of the phase variable `dp(q) = gradient . q[2..]` in m, the linearisation of hip minus stance toe:
/// `-(L_shank psi_shank + L_thigh psi_thigh + h psi_foot)` of the stance leg.
///
/// The term of the foot makes the phase valid with a raised stance heel.
pub fn phase_gradient(model: &WalkerModel, stance: Side) -> [f64; 7] {
    let leg = model.leg(stance);
    let first = first_link(stance);
    let mut per_link = [0.0; 7];
    per_link[first] = -leg.thigh_length_m;
    per_link[first + 1] = -leg.shank_length_m;
    per_link[first + 2] = -leg.ankle_height_m;
    to_generalised(&per_link)
}
