//! Tuned bounds as they are loosened: which way, how far, and in which steps.

use super::conflict::BoundSet;
use crate::bounds::TunedBounds;
use crate::subject::ModelError;

/// Digits of the values tried.
const DIGITS: i32 = 3;

/// Whether the bound is a lower one: a3 and a5.
fn is_lower(bound: usize) -> bool {
    matches!(bound, 2 | 4)
}

/// The loosest value of a bound.
pub(super) fn loosest(bound: usize) -> f64 {
    let (lowest, highest) = TunedBounds::RANGES[bound];
    if is_lower(bound) { lowest } else { highest }
}

/// How far bounds are loosened.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Level {
    /// To their usual values, where those are looser. Gaits are found more easily than with the loosest.
    Usual,
    /// As far as they go.
    Loosest,
}

/// With the bounds of a set loosened.
pub(super) fn loosened(bounds: &TunedBounds, set: BoundSet, level: Level) -> Result<TunedBounds, ModelError> {
    let (mut values, usual) = (bounds.to_array(), TunedBounds::default().to_array());
    for bound in set.bounds() {
        let value = &mut values[bound];
        *value = match level {
            Level::Loosest => loosest(bound),
            Level::Usual if is_lower(bound) => value.min(usual[bound]),
            Level::Usual => value.max(usual[bound]),
        };
    }
    TunedBounds::from_array(values)
}

/// A share of the way from some bounds to looser ones, by ratio where that is possible, with few digits.
fn moved(from: &TunedBounds, to: &TunedBounds, share: f64) -> Result<TunedBounds, ModelError> {
    let (mut values, ends) = (from.to_array(), to.to_array());
    for (value, end) in values.iter_mut().zip(ends).filter(|(value, end)| **value != *end) {
        *value = between(*value, end, share);
    }
    TunedBounds::from_array(values)
}

/// Halfway between two sets of bounds.
pub(super) fn halfway(a: &TunedBounds, b: &TunedBounds) -> Result<TunedBounds, ModelError> {
    moved(a, b, 0.5)
}

fn between(from: f64, to: f64, share: f64) -> f64 {
    let value = if from > 0.0 && to > 0.0 { from * (to / from).powf(share) } else { from + share * (to - from) };
    let rounded = if value == 0.0 { value } else { round(value) };
    rounded.max(from.min(to)).min(from.max(to))
}

fn round(value: f64) -> f64 {
    #[allow(clippy::cast_possible_truncation)] // the exponent of a double
    let place = DIGITS - 1 - value.abs().log10().floor() as i32;
    let unit = 10f64.powi(place);
    (value * unit).round() / unit
}

/// Whether every bound of `a` is as loose as that of `b`, or looser.
pub(super) fn is_as_loose(a: &TunedBounds, b: &TunedBounds) -> bool {
    let (a, b) = (a.to_array(), b.to_array());
    (0..a.len()).all(|bound| if is_lower(bound) { a[bound] <= b[bound] } else { a[bound] >= b[bound] })
}

/// How far a bound moves: by ratio, or as a share of its range.
pub(super) fn step(bound: usize, from: f64, to: f64) -> f64 {
    if from > 0.0 && to > 0.0 {
        return (to / from).ln().abs();
    }
    let (lowest, highest) = TunedBounds::RANGES[bound];
    (to - from).abs() / (highest - lowest)
}

/// How far all bounds move together.
pub(super) fn way(from: &TunedBounds, to: &TunedBounds) -> f64 {
    let (from, to) = (from.to_array(), to.to_array());
    (0..from.len()).map(|bound| step(bound, from[bound], to[bound])).sum()
}

/// How near the bounds are brought to where no gait is found any more: part of the way that is searched, or logarithm of
/// the ratio.
const RESOLUTION: f64 = 1.0 / 128.0;
const SMALL_STEP: f64 = 0.025;
/// Which part of what is left to search is stepped over at a time. Steps back towards gaits are short because a search that
/// ends without a gait takes ten times as long as one that finds it.
const STEP: f64 = 0.25;

/// How far bounds have to move towards looser ones, with which there is a gait, so that there is one: the least of what was
/// tried, and the furthest tried with which there was none.
pub(super) fn least_move<E: From<ModelError>>(
    from: &TunedBounds,
    to: &TunedBounds,
    mut is_met: impl FnMut(&TunedBounds) -> Result<bool, E>,
) -> Result<(TunedBounds, TunedBounds), E> {
    let (mut none, mut gait) = ((0.0, *from), (1.0, *to));
    while gait.0 - none.0 > RESOLUTION && !are_close(&none.1, &gait.1) {
        let share = gait.0 - STEP * (gait.0 - none.0);
        let tried = moved(from, to, share)?;
        if tried == none.1 || tried == gait.1 {
            break;
        }
        let end = if is_met(&tried)? { &mut gait } else { &mut none };
        *end = (share, tried);
    }
    Ok((gait.1, none.1))
}

/// Whether no bound differs by a ratio of any size.
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
    fn values_in_between_have_few_digits_and_lie_between() {
        assert_eq!(between(40.0, 1000.0, 0.5), 200.0);
        assert_eq!(between(0.1, 0.0, 0.5), 0.05);
        assert_eq!(between(15.0, 16.123, 0.5), 15.6);
        assert_eq!(between(0.0, 0.0, 0.5), 0.0);
        assert_eq!((between(15.001, 68.0, 0.0), between(15.0, 68.0, 1.0)), (15.001, 68.0));
    }

    #[test]
    fn lower_bounds_are_loosest_where_they_are_lowest() {
        let bounds = TunedBounds { a3: 0.5, a5: 0.1, a6: 0.0, a7: 60.0, ..TunedBounds::default() };
        let with = |level| loosened(&bounds, BoundSet::ALL, level).unwrap().to_array();
        assert_eq!(with(Level::Loosest), [100.0, 1000.0, 0.05, 3.0, 0.0, 1.0, 68.0, 60.0]);
        assert_eq!(with(Level::Usual), [20.0, 90.0, 0.3, 1.4, 0.0, 0.5, 60.0, 40.0]);
        assert_eq!(loosened(&bounds, set(&[2]), Level::Usual).unwrap(), TunedBounds { a3: 0.3, ..bounds });
    }

    #[test]
    fn bounds_are_compared_by_the_way_they_loosen() {
        let usual = TunedBounds::default();
        assert!(is_as_loose(&usual, &usual));
        assert!(is_as_loose(&usual, &TunedBounds { a3: 0.4, a5: 0.1, a8: 20.0, ..usual }));
        for tighter in [TunedBounds { a3: 0.4, ..usual }, TunedBounds { a5: 0.1, a8: 60.0, ..usual }] {
            assert!(!is_as_loose(&tighter, &usual), "{tighter:?}");
        }
    }

    #[test]
    fn ways_are_measured_by_ratio_or_by_share_of_the_range() {
        assert!((step(1, 40.0, 80.0) - 2f64.ln()).abs() < 1e-15);
        assert!((step(4, 0.0, 0.03) - 0.1).abs() < 1e-15);
        let usual = TunedBounds::default();
        assert!((way(&usual, &TunedBounds { a2: 45.0, a5: 0.03, ..usual }) - 2f64.ln() - 0.1).abs() < 1e-15);
    }

    #[test]
    fn halfway_is_by_ratio_and_leaves_what_agrees() {
        let a = TunedBounds { a2: 12.345, a7: 5.0, ..TunedBounds::default() };
        assert_eq!(halfway(&a, &TunedBounds { a7: 20.0, ..a }).unwrap(), TunedBounds { a7: 10.0, ..a });
    }

    proptest! {
        /// Wherever gaits begin on the way: they begin between what is named and what is said to have none, which are near
        /// one another.
        #[test]
        fn the_least_move_ends_where_gaits_begin(begin in 1e-3f64..1.0, both in any::<bool>()) {
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
