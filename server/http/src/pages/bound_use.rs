//! How near a gait comes to its bounds: which of them shape it.

use super::format;
use gait_optimizer::walking::kept_clearance_m;
use gait_optimizer::{Gait, TunedBounds};
use gaitwright_service::error::Error;

/// A bound that is met to this share is said to be active.
const ACTIVE: f64 = 0.99;
/// Places of the bounds that limit from below: hip velocity (a3) and clearance (a5).
const FROM_BELOW: [usize; 2] = [2, 4];

/// One bound and what the gait makes of it.
pub(super) struct BoundUse {
    pub(super) bound: format::Bound,
    /// The extreme value of the gait; none where it is not measured here.
    pub(super) reached: Option<String>,
    pub(super) active: bool,
}

/// The bounds of an action, and how near a gait comes to them.
///
/// # Errors
/// When the gait's subject or device is invalid.
pub(super) fn of(action: &TunedBounds, gait: Option<&Gait>) -> Result<Vec<BoundUse>, Error> {
    let extremes = gait.map(extremes).transpose()?.unwrap_or_default();
    let values = action.to_array();
    let with_use = |(place, bound): (usize, format::Bound)| {
        let reached = extremes[place];
        // Missed counts as met: the gait is of a solve that did not converge, and this bound is a reason.
        let value = values[place];
        let from_below = FROM_BELOW.contains(&place);
        let is_active = |reached: f64| if from_below { ACTIVE * reached <= value } else { reached >= ACTIVE * value };
        BoundUse { bound, reached: reached.map(format::number), active: reached.is_some_and(is_active) }
    };
    Ok(format::bounds(action).into_iter().enumerate().map(with_use).collect())
}

/// The largest value of what each bound limits, the smallest where it limits from below.
fn extremes(gait: &Gait) -> Result<[Option<f64>; 8], Error> {
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
