//! Which bounds a gait reaches, and for which values of each it stays the same.

use crate::bound_units::{self, ANGLES, Bound};
use crate::format;
use gait_optimizer::gait::kept_clearance_m;
use gait_optimizer::{Gait, TunedBounds, UnchangedBound};
use gaitwright_service::error::Error;

/// A bound, and the extreme value that the gait reaches.
pub(super) struct BoundUse {
    pub(super) bound: Bound,
    /// The extreme value of the gait; `None` if it is not computed.
    pub(super) reached: Option<String>,
    /// Whether any change of the bound changes the gait.
    pub(super) active: bool,
    /// Values of the bound with which the gait stays a solution; `None` if unknown.
    pub(super) unchanged_for: Option<String>,
}

/// The bounds of an action, with the values that a gait reaches.
///
/// # Errors
/// If the gait's subject or device is invalid.
pub(super) fn of(
    action: &TunedBounds,
    gait: Option<&Gait>,
    unchanged: &[UnchangedBound],
) -> Result<Vec<BoundUse>, Error> {
    let extremes = gait.map(extremes).transpose()?.unwrap_or_default();
    let values = action.to_array();
    let limits = gait.map(|gait| gait.settings.limits).unwrap_or_default();
    let with_use = |(place, bound): (usize, Bound)| {
        let value = values[place];
        let interval = unchanged.iter().find(|interval| interval.bound == bound.name);
        BoundUse {
            unchanged_for: interval.map(|interval| in_words(interval, value)),
            reached: extremes[place].map(|reached| format::number(bound_units::shown(bound.name, reached))),
            active: interval.is_some_and(|interval| interval.is_active(value, &limits)),
            bound: Bound { value: with_tolerance(&bound, value, gait), ..bound },
        }
    };
    Ok(bound_units::bounds(action).into_iter().enumerate().map(with_use).collect())
}

/// The value of a bound, and the tolerance that takes its place if it is smaller.
fn with_tolerance(bound: &Bound, value: f64, gait: Option<&Gait>) -> String {
    let tolerance = gait.map(|gait| gait.settings.limits.torso_tolerance_rad).filter(|tolerance| value < *tolerance);
    match tolerance {
        Some(tolerance) if bound.name == "a6" => {
            format!("{} (acts as {})", bound.value, bound_units::number(bound.name, tolerance))
        }
        _ => bound.value.clone(),
    }
}

/// An interval around the value of the bound. Its ends are rounded towards that value.
fn in_words(interval: &UnchangedBound, value: f64) -> String {
    let unit = TunedBounds::unit_of(&interval.bound);
    let in_page_unit = |value: f64| ANGLES.converted(value, unit);
    if (interval.least, interval.most) == (Some(value), Some(value)) {
        return "this value only".to_owned();
    }
    let value = in_page_unit(value);
    let least = interval.least.map(|least| rounded(in_page_unit(least), f64::ceil).min(value));
    let most = interval.most.map(|most| rounded(in_page_unit(most), f64::floor).max(value));
    match (least, most) {
        (None, None) => "any value".to_owned(),
        (Some(least), None) => format!("{} or more", format::number(least)),
        (None, Some(most)) => format!("{} or less", format::number(most)),
        (Some(least), Some(most)) if least == most => format!("about {}", format::number(least)),
        (Some(least), Some(most)) => format!("{} to {}", format::number(least), format::number(most)),
    }
}

/// Three digits.
fn rounded(value: f64, round: fn(f64) -> f64) -> f64 {
    let whole = if value == 0.0 { 0.0 } else { value.abs().log10().floor() };
    let last = 10_f64.powf(2.0 - whole.min(2.0));
    round(value * last) / last
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ends_of_an_interval_are_rounded_towards_the_bound() {
        let words = |least, most| in_words(&UnchangedBound { bound: "a5".to_owned(), least, most }, 0.2);
        assert_eq!(words(Some(0.142_97), None), "0.143 or more");
        assert_eq!(words(None, Some(0.885_54)), "0.885 or less");
        assert_eq!(words(Some(0.199_96), Some(1.2345)), "0.2 to 1.23");
        assert_eq!(words(Some(0.2), Some(0.2)), "this value only");
        assert_eq!(words(Some(0.199_96), Some(0.200_02)), "about 0.2");
        assert_eq!(words(None, None), "any value");
        let lean = UnchangedBound { bound: "a6".to_owned(), least: Some(0.142_97), most: Some(0.2) };
        assert_eq!(in_words(&lean, 0.2), "8.2 to 11.5", "angles are in degrees");
    }
}
