//! Search for irreducible conflicts and minimal relaxations over sets of tuned bounds.
//!
//! A set is feasible if there is a gait with its bounds at their given values and all others at their loosest values. The
//! predicate must be monotonic: subsets of a feasible set are feasible.

use crate::tuned_bounds::TunedBounds;

/// A set of tuned bounds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default)]
pub(super) struct BoundSet(u32);

impl BoundSet {
    pub(super) const EMPTY: Self = Self(0);
    pub(super) const ALL: Self = Self((1 << TunedBounds::COUNT) - 1);

    pub(super) fn with(self, bound: usize) -> Self {
        Self(self.0 | 1 << bound)
    }

    pub(super) fn without(self, others: Self) -> Self {
        Self(self.0 & !others.0)
    }

    pub(super) fn contains(self, bound: usize) -> bool {
        self.0 & 1 << bound != 0
    }

    pub(super) fn is_disjoint(self, other: Self) -> bool {
        self.0 & other.0 == 0
    }

    /// The bounds in the order of an action.
    pub(super) fn bounds(self) -> impl Iterator<Item = usize> {
        (0..TunedBounds::COUNT).filter(move |bound| self.contains(*bound))
    }
}

/// An irreducible conflict: an infeasible set of bounds whose proper subsets are feasible. `None` if all bounds together are
/// feasible.
///
/// Bounds are added in the given order until the set is infeasible; the last one belongs to the conflict. The search restarts
/// with the bounds found so far. Infeasible sets take far longer to test, so the search tests at most one for each bound of the
/// conflict besides the conflict itself.
pub(super) fn conflict<E>(
    order: &[usize],
    mut is_met: impl FnMut(BoundSet) -> Result<bool, E>,
) -> Result<Option<BoundSet>, E> {
    let (mut members, mut candidates) = (BoundSet::EMPTY, order);
    while is_met(members)? {
        let mut together = members;
        let mut last = None;
        for (place, bound) in candidates.iter().enumerate() {
            together = together.with(*bound);
            if !is_met(together)? {
                last = Some((place, *bound));
                break;
            }
        }
        let Some((place, bound)) = last else { return Ok(None) };
        members = members.with(bound);
        candidates = &candidates[..place];
    }
    Ok(Some(members))
}

/// Result of the search for relaxations.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(super) struct Remedies {
    /// The smallest sets of bounds whose relaxation gives a gait.
    pub(super) help: Vec<BoundSet>,
    /// Sets whose relaxation gives no gait, smaller ones first.
    pub(super) do_not_help: Vec<BoundSet>,
    /// Further conflicts, each with the set that was relaxed when it remained.
    pub(super) conflicts: Vec<(BoundSet, BoundSet)>,
}

/// Minimal sets of at most `largest` bounds whose relaxation gives a gait; `first` is a conflict. A relaxation must contain a bound
/// of each conflict, so the search is breadth-first over hitting sets (Reiter 1987).
pub(super) fn remedies<E>(
    first: BoundSet,
    largest: usize,
    mut gives_a_gait: impl FnMut(BoundSet) -> Result<bool, E>,
    mut conflict_without: impl FnMut(BoundSet) -> Result<Option<BoundSet>, E>,
) -> Result<Remedies, E> {
    let mut found = Remedies::default();
    let mut tried: Vec<BoundSet> = first.bounds().map(|bound| BoundSet::EMPTY.with(bound)).collect();
    for size in 1..=largest {
        let mut left = Vec::new();
        for loosened in tried {
            if gives_a_gait(loosened)? {
                found.help.push(loosened);
            } else {
                left.push(loosened);
            }
        }
        found.do_not_help.extend(&left);
        if !found.help.is_empty() || size == largest {
            break;
        }
        tried = Vec::new();
        for loosened in left {
            let known = found.conflicts.iter().map(|(conflict, _)| *conflict).find(|c| c.is_disjoint(loosened));
            let conflict = if let Some(conflict) = known {
                conflict
            } else {
                let Some(conflict) = conflict_without(loosened)? else { continue };
                found.conflicts.push((conflict, loosened));
                conflict
            };
            tried.extend(conflict.bounds().map(|bound| loosened.with(bound)));
        }
        tried.sort();
        tried.dedup();
    }
    Ok(found)
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::convert::Infallible;

    /// Feasible if it contains no conflict.
    fn met(conflicts: &[u32], set: BoundSet) -> bool {
        conflicts.iter().all(|conflict| conflict & !set.0 != 0)
    }

    fn answer<T>(result: Result<T, Infallible>) -> T {
        result.unwrap_or_else(|never| match never {})
    }

    fn found(conflicts: &[u32], order: &[usize]) -> (Option<BoundSet>, Vec<BoundSet>) {
        let mut not_met = Vec::new();
        let result = answer(conflict(order, |set| {
            let met = met(conflicts, set);
            if !met && !not_met.contains(&set) {
                not_met.push(set);
            }
            Ok(met)
        }));
        (result, not_met)
    }

    fn in_order() -> Vec<usize> {
        (0..TunedBounds::COUNT).collect()
    }

    fn some_conflicts(most: usize) -> impl Strategy<Value = Vec<u32>> {
        prop::collection::vec(1..=BoundSet::ALL.0, 1..most)
    }

    #[test]
    fn one_infeasible_set_is_tested_for_each_bound_besides_the_conflict() {
        let (pair, not_met) = found(&[0b0100_1000], &in_order());
        assert_eq!(pair, Some(BoundSet(0b0100_1000)));
        assert_eq!(not_met, [0b0111_1111, 0b0100_1111, 0b0100_1000].map(BoundSet));
        let (pair, not_met) = found(&[0b0100_1000], &[6, 3, 0, 1, 2, 4, 5, 7]);
        assert_eq!(
            (pair, not_met.len()),
            (Some(BoundSet(0b0100_1000)), 1),
            "with suspects first, only the conflict itself"
        );
    }

    #[test]
    fn no_conflict_differs_from_an_empty_conflict() {
        assert_eq!(found(&[], &in_order()).0, None);
        assert_eq!(found(&[0], &in_order()).0, Some(BoundSet::EMPTY));
    }

    proptest! {
        #[test]
        fn conflicts_are_irreducible_and_relaxations_are_minimal_hitting_sets(
            conflicts in some_conflicts(5),
            order in Just(in_order()).prop_shuffle(),
        ) {
            let first = found(&conflicts, &order).0.unwrap();
            prop_assert!(!met(&conflicts, first));
            for bound in first.bounds() {
                prop_assert!(met(&conflicts, first.without(BoundSet::EMPTY.with(bound))));
            }
            let gives_a_gait = |loosened| met(&conflicts, BoundSet::ALL.without(loosened));
            let remedies = answer(remedies(first, TunedBounds::COUNT, |loosened| Ok(gives_a_gait(loosened)), |loosened| {
                let kept: Vec<usize> = order.iter().copied().filter(|bound| !loosened.contains(*bound)).collect();
                Ok(found(&conflicts, &kept).0)
            }));
            let size = |set: &BoundSet| set.0.count_ones();
            let hits: Vec<BoundSet> = (0..=BoundSet::ALL.0).map(BoundSet).filter(|set| gives_a_gait(*set)).collect();
            let smallest = hits.iter().map(size).min().unwrap();
            let expected: Vec<BoundSet> = hits.into_iter().filter(|set| size(set) == smallest).collect();
            prop_assert_eq!(&remedies.help, &expected);
            prop_assert!(remedies.do_not_help.iter().all(|set| !gives_a_gait(*set)));
            for (conflict, loosened) in remedies.conflicts {
                prop_assert!(conflict.is_disjoint(loosened) && !met(&conflicts, conflict));
            }
        }

        #[test]
        fn relaxations_have_at_most_the_requested_size(conflicts in some_conflicts(8)) {
            let first = found(&conflicts, &in_order()).0.unwrap();
            let mut largest = 0;
            let remedies = answer(remedies(first, 2, |loosened| {
                largest = largest.max(loosened.0.count_ones());
                Ok(met(&conflicts, BoundSet::ALL.without(loosened)))
            }, |loosened| {
                let kept: Vec<usize> = in_order().into_iter().filter(|bound| !loosened.contains(*bound)).collect();
                Ok(found(&conflicts, &kept).0)
            }));
            prop_assert!(largest <= 2);
            prop_assert!(remedies.help.iter().all(|set| met(&conflicts, BoundSet::ALL.without(*set))));
        }
    }
}
