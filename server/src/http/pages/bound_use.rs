//! How near a gait comes to its bounds: which of them shape it.

use super::format;
use gait_optimizer::{Gait, TunedBounds};

/// A bound that is met to this share is said to be active.
const ACTIVE: f64 = 0.99;

/// One bound and what the gait makes of it.
pub(super) struct BoundUse {
    pub(super) bound: format::Bound,
    /// The extreme value of the gait; none where it is not measured here.
    pub(super) reached: Option<String>,
    pub(super) active: bool,
}

/// The bounds of an action, and how near a gait comes to them.
pub(super) fn of(action: &TunedBounds, gait: Option<&Gait>) -> Vec<BoundUse> {
    let extremes = gait.map_or([None; 8], extremes);
    let values = action.to_array();
    let with_use = |(place, bound): (usize, format::Bound)| {
        let reached = extremes[place];
        // a3 is a bound from below.
        let share = reached.map(|reached| if place == 2 { values[place] / reached } else { reached / values[place] });
        BoundUse {
            bound,
            reached: reached.map(|r| format!("{r:.3}")),
            active: share.is_some_and(|share| share >= ACTIVE),
        }
    };
    format::bounds(action).into_iter().enumerate().map(with_use).collect()
}

/// The largest value of what each bound limits, the smallest for a3. The clearance (a5) holds at one instant of each
/// swing, which is the optimiser's to know.
fn extremes(gait: &Gait) -> [Option<f64>; 8] {
    let largest = |values: &mut dyn Iterator<Item = f64>| values.map(f64::abs).reduce(f64::max);
    let angle = |places: &'static [usize]| {
        let rows = gait.domains.iter().flat_map(|domain| &domain.q);
        largest(&mut rows.flat_map(|q| places.iter().map(|place| q[*place])))
    };
    let velocity = largest(&mut gait.domains.iter().flat_map(|domain| domain.qd.iter().flatten().copied()));
    let acceleration = largest(&mut gait.domains.iter().flat_map(|domain| domain.qdd.iter().flatten().copied()));
    let hip = gait.hip_velocity_m_s.iter().copied();
    [
        velocity,
        acceleration,
        hip.clone().reduce(f64::min),
        hip.reduce(f64::max),
        None,
        angle(&[2]),
        angle(&[3, 6]).map(f64::to_degrees),
        angle(&[5, 8]).map(f64::to_degrees),
    ]
}
