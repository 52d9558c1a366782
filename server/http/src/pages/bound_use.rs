//! Which bounds a gait reaches.

use crate::format;
use gait_optimizer::walking::kept_clearance_m;
use gait_optimizer::{Gait, TunedBounds};
use gaitwright_service::error::Error;

/// A bound is active if the gait reaches this share of it.
const ACTIVE: f64 = 0.99;

/// A bound, and the extreme value that the gait reaches.
pub(super) struct BoundUse {
    pub(super) bound: format::Bound,
    /// The extreme value of the gait; `None` if it is not computed.
    pub(super) reached: Option<String>,
    pub(super) active: bool,
}

/// The bounds of an action, with the values that a gait reaches.
///
/// # Errors
/// If the gait's subject or device is invalid.
pub(super) fn of(action: &TunedBounds, gait: Option<&Gait>) -> Result<Vec<BoundUse>, Error> {
    let extremes = gait.map(extremes).transpose()?.unwrap_or_default();
    let values = action.to_array();
    let with_use = |(place, bound): (usize, format::Bound)| {
        let reached = extremes[place];
        // A violated bound counts as active: the solve did not converge, and this bound is a reason.
        let value = values[place];
        let is_lower = TunedBounds::IS_LOWER[place];
        let is_active = |reached: f64| if is_lower { ACTIVE * reached <= value } else { reached >= ACTIVE * value };
        BoundUse { bound, reached: reached.map(format::number), active: reached.is_some_and(is_active) }
    };
    Ok(format::bounds(action).into_iter().enumerate().map(with_use).collect())
}

/// The largest value of each limited quantity, or the smallest for a bound from below.
fn extremes(gait: &Gait) -> Result<[Option<f64>; TunedBounds::COUNT], Error> {
    let largest = |values: &mut dyn Iterator<Item = f64>| values.map(f64::abs).reduce(f64::max);
    let angle = |places: &'static [usize]| {
        let rows = gait.domains.iter().flat_map(|domain| &domain.q);
        largest(&mut rows.flat_map(|q| places.iter().map(|place| q[*place])))
    };
    let velocity = largest(&mut gait.domains.iter().flat_map(|domain| domain.qd.iter().flatten().copied()));
    let acceleration = largest(&mut gait.domains.iter().flat_map(|domain| domain.qdd.iter().flatten().copied()));
    let hip = gait.hip_velocity_m_s.iter().copied();
    Ok([
        velocity,
        acceleration,
        hip.clone().reduce(f64::min),
        hip.reduce(f64::max),
        kept_clearance_m(gait)?,
        angle(&[2]),
        angle(&[3, 6]).map(f64::to_degrees),
        angle(&[5, 8]).map(f64::to_degrees),
    ])
}
