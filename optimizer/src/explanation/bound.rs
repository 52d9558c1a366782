//! Relaxation of tuned bounds: direction, range and steps.

use super::conflict::BoundSet;
use crate::model_error::ModelError;
use crate::tuned_bounds::TunedBounds;

/// Number of significant digits of relaxed values.
const DIGITS: i32 = 3;

/// Loosest value of a bound.
pub(super) fn loosest(bound: usize) -> f64 {
    let (lowest, highest) = TunedBounds::RANGES[bound];
    if TunedBounds::IS_LOWER[bound] { lowest } else { highest }
}

/// The extent of a relaxation.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Level {
    /// To the default values, if they are looser. Solves converge more easily than with the loosest values.
    Usual,
    /// To the loosest values.
    Loosest,
}

/// Relaxes the bounds of a set.
pub(super) fn loosened(bounds: &TunedBounds, set: BoundSet, level: Level) -> Result<TunedBounds, ModelError> {
    let (mut values, usual) = (bounds.to_array(), TunedBounds::default().to_array());
    for bound in set.bounds() {
        let value = &mut values[bound];
        *value = match level {
            Level::Loosest => loosest(bound),
            Level::Usual if TunedBounds::IS_LOWER[bound] => value.min(usual[bound]),
            Level::Usual => value.max(usual[bound]),
        };
    }
    TunedBounds::from_array(values)
}

/// Bounds at a fraction of the way to looser ones, geometrically if possible, rounded to few digits.
fn interpolated(from: &TunedBounds, to: &TunedBounds, share: f64) -> Result<TunedBounds, ModelError> {
    let (mut values, ends) = (from.to_array(), to.to_array());
    for (value, end) in values.iter_mut().zip(ends).filter(|(value, end)| **value != *end) {
        *value = between(*value, end, share);
    }
    TunedBounds::from_array(values)
}

/// Bounds halfway between two sets of bounds.
pub(super) fn halfway(a: &TunedBounds, b: &TunedBounds) -> Result<TunedBounds, ModelError> {
    interpolated(a, b, 0.5)
}

fn between(from: f64, to: f64, share: f64) -> f64 {
    let value = if from > 0.0 && to > 0.0 { from * (to / from).powf(share) } else { from + share * (to - from) };
    let rounded = if value == 0.0 { value } else { round(value) };
    rounded.max(from.min(to)).min(from.max(to))
}

fn round(value: f64) -> f64 {
    #[allow(clippy::cast_possible_truncation)] // The exponent of a double.
    let place = DIGITS - 1 - value.abs().log10().floor() as i32;
    let unit = 10f64.powi(place);
    (value * unit).round() / unit
}

/// Whether every bound of `a` is at least as loose as that of `b`.
pub(super) fn is_as_loose(a: &TunedBounds, b: &TunedBounds) -> bool {
    let (a, b) = (a.to_array(), b.to_array());
    (0..a.len()).all(|bound| if TunedBounds::IS_LOWER[bound] { a[bound] <= b[bound] } else { a[bound] >= b[bound] })
}

/// Distance between two values of a bound: logarithm of the ratio, or share of the range.
pub(super) fn step(bound: usize, from: f64, to: f64) -> f64 {
    if from > 0.0 && to > 0.0 {
        return (to / from).ln().abs();
    }
    let (lowest, highest) = TunedBounds::RANGES[bound];
    (to - from).abs() / (highest - lowest)
}

/// Distance between two sets of bounds.
pub(super) fn distance(from: &TunedBounds, to: &TunedBounds) -> f64 {
    let (from, to) = (from.to_array(), to.to_array());
    (0..from.len()).map(|bound| step(bound, from[bound], to[bound])).sum()
}

/// Resolution of the search for the smallest relaxation: as a fraction of the way, or as logarithm of the ratio.
const RESOLUTION: f64 = 1.0 / 128.0;
const SMALL_STEP: f64 = 0.025;
/// Fraction of the remaining interval for each step of the search. Steps towards tighter bounds are short, because a solve
/// without a gait takes ten times as long as one with a gait.
const STEP: f64 = 0.25;

/// The smallest fraction of the way to looser bounds with which a gait was found, and the largest one without a gait.
pub(super) fn least_move<E: From<ModelError>>(
    from: &TunedBounds,
    to: &TunedBounds,
    mut is_met: impl FnMut(&TunedBounds) -> Result<bool, E>,
) -> Result<(TunedBounds, TunedBounds), E> {
    let (mut none, mut gait) = ((0.0, *from), (1.0, *to));
    while gait.0 - none.0 > RESOLUTION && !are_close(&none.1, &gait.1) {
        let share = gait.0 - STEP * (gait.0 - none.0);
        let tried = interpolated(from, to, share)?;
        if tried == none.1 || tried == gait.1 {
            break;
        }
        let end = if is_met(&tried)? { &mut gait } else { &mut none };
        *end = (share, tried);
    }
    Ok((gait.1, none.1))
}

/// Whether all bounds agree up to the resolution.
fn are_close(a: &TunedBounds, b: &TunedBounds) -> bool {
    let mut pairs = a.to_array().into_iter().zip(b.to_array());
    pairs.all(|(a, b)| a == b || a > 0.0 && b > 0.0 && (a / b).ln().abs() <= SMALL_STEP)
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn set(bounds: &[usize]) -> BoundSet {
        bounds.iter().fold(BoundSet::EMPTY, |set, bound| set.with(*bound))
    }

    #[test]
    fn intermediate_values_have_few_digits() {
        assert_eq!(between(40.0, 1000.0, 0.5), 200.0);
        assert_eq!(between(0.1, 0.0, 0.5), 0.05);
        assert_eq!(between(15.0, 16.123, 0.5), 15.6);
        assert_eq!(between(0.0, 0.0, 0.5), 0.0);
        assert_eq!((between(15.001, 68.0, 0.0), between(15.0, 68.0, 1.0)), (15.001, 68.0));
    }

    #[test]
    fn lower_bounds_are_loosest_at_their_minimum() {
        let bounds = TunedBounds { a3: 0.5, a5: 0.1, a6: 0.0, a7: 60.0, ..TunedBounds::default() };
        let with = |level| loosened(&bounds, BoundSet::ALL, level).unwrap();
        assert_eq!(with(Level::Loosest).to_array()[..8], [100.0, 1000.0, 0.05, 3.0, 0.0, 1.0, 68.0, 60.0]);
        assert_eq!(with(Level::Usual), TunedBounds { a7: 60.0, ..TunedBounds::default() });
        assert_eq!(loosened(&bounds, set(&[2]), Level::Usual).unwrap(), TunedBounds { a3: 0.3, ..bounds });
    }

    #[test]
    fn bounds_are_compared_in_the_direction_of_relaxation() {
        let usual = TunedBounds::default();
        assert!(is_as_loose(&usual, &usual));
        assert!(is_as_loose(&usual, &TunedBounds { a3: 0.4, a5: 0.1, a8: 20.0, ..usual }));
        for tighter in [TunedBounds { a3: 0.4, ..usual }, TunedBounds { a5: 0.1, a8: 60.0, ..usual }] {
            assert!(!is_as_loose(&tighter, &usual), "{tighter:?}");
        }
    }

    #[test]
    fn distances_are_ratios_or_shares_of_the_range() {
        assert!((step(1, 40.0, 80.0) - 2f64.ln()).abs() < 1e-15);
        assert!((step(4, 0.0, 0.03) - 0.1).abs() < 1e-15);
        let usual = TunedBounds::default();
        assert!((distance(&usual, &TunedBounds { a2: 45.0, a5: 0.03, ..usual }) - 2f64.ln() - 0.1).abs() < 1e-15);
    }

    #[test]
    fn halfway_is_geometric_and_keeps_equal_bounds() {
        let a = TunedBounds { a2: 12.345, a7: 5.0, ..TunedBounds::default() };
        assert_eq!(halfway(&a, &TunedBounds { a7: 20.0, ..a }).unwrap(), TunedBounds { a7: 10.0, ..a });
    }

    proptest! {
        #[test]
        fn smallest_relaxation_encloses_the_boundary_of_feasibility(begin in 1e-3f64..1.0, both in any::<bool>()) {
            let bounds = TunedBounds { a7: 5.0, a5: 0.3, ..TunedBounds::default() };
            let loose = loosened(&bounds, if both { set(&[4, 6]) } else { set(&[6]) }, Level::Loosest).unwrap();
            let share = |bounds: &TunedBounds| (bounds.a7 / 5.0).ln() / (68.0f64 / 5.0).ln();
            let mut tried = 0;
            let (to, not_with) = least_move(&bounds, &loose, |bounds| {
                tried += 1;
                Ok::<_, ModelError>(share(bounds) >= begin)
            })
            .unwrap();
            prop_assert!(share(&to) >= begin && share(&not_with) < begin);
            prop_assert!(share(&to) - share(&not_with) < 1.5 * RESOLUTION && tried <= 20, "{to:?} {not_with:?} {tried}");
            prop_assert_eq!(to.a5 == bounds.a5, !both);
        }
    }
}
