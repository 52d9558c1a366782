//! Actions that must not be proposed because their outcome is known, and the choice among the others.

use std::collections::HashSet;
use std::ops::Range;

use crate::action::ActionIndex;
use crate::error::{LearnerError, Result};
use crate::random::Random;
use crate::search_space::SearchSpace;

/// Largest number of draws until a random action is outside the boxes of a space that is too large to list them. If every
/// draw is inside, the boxes count as the whole space.
const DRAWS: usize = 10_000;

/// A union of boxes of actions. A box has a range of level indices for every dimension of its space.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct ExcludedActions {
    boxes: Vec<Vec<Range<usize>>>,
}

impl ExcludedActions {
    /// The union of boxes of a space.
    ///
    /// # Errors
    /// If a box has another number of dimensions than the space, or a level that does not exist.
    pub fn new(space: &SearchSpace, boxes: Vec<Vec<Range<usize>>>) -> Result<Self> {
        for ranges in &boxes {
            let (given, expected) = (ranges.len(), space.dimensions().len());
            if given != expected {
                return Err(LearnerError::WrongDimensionCount { given, expected });
            }
            for (range, dimension) in ranges.iter().zip(space.dimensions()) {
                let levels = dimension.values.len();
                if range.end > levels {
                    let (dimension, level) = (dimension.name.clone(), range.end - 1);
                    return Err(LearnerError::UnknownLevel { dimension, level, levels });
                }
            }
        }
        Ok(Self { boxes })
    }

    /// Whether the action with these level indices is excluded.
    pub fn contains(&self, levels: &[usize]) -> bool {
        self.boxes.iter().any(|ranges| ranges.iter().zip(levels).all(|(range, level)| range.contains(level)))
    }

    /// The actions of all boxes, in ascending order. `len` is the number of actions of the space.
    fn list(&self, space: &SearchSpace, len: usize) -> impl Iterator<Item = ActionIndex> + use<> {
        let mut inside = vec![false; len];
        for ranges in &self.boxes {
            let mut partial = vec![0];
            for (range, dimension) in ranges.iter().zip(space.dimensions()) {
                let count = dimension.values.len();
                partial = partial.into_iter().flat_map(|at| range.clone().map(move |l| at * count + l)).collect();
            }
            for at in partial {
                inside[at] = true;
            }
        }
        (0..).zip(inside).filter(|(_, inside)| *inside).map(|(at, _)| ActionIndex(at))
    }
}

/// The actions that a proposal must avoid: listed ones, and the boxes of excluded ones if the space is too large to list
/// them.
pub(crate) struct ForbiddenActions<'a> {
    space: &'a SearchSpace,
    listed: HashSet<ActionIndex>,
    ascending: Vec<u64>,
    boxes: Option<&'a ExcludedActions>,
}

impl<'a> ForbiddenActions<'a> {
    pub(crate) fn new(
        space: &'a SearchSpace,
        actions: impl IntoIterator<Item = ActionIndex>,
        excluded: &'a ExcludedActions,
    ) -> Self {
        let mut listed: HashSet<ActionIndex> = actions.into_iter().collect();
        let len = space.enumerable().ok();
        listed.extend(same_outcome_or_none(space, &listed));
        listed.extend(len.into_iter().flat_map(|len| excluded.list(space, len)));
        let mut ascending: Vec<u64> = listed.iter().map(|action| action.0).collect();
        ascending.sort_unstable();
        let boxes = Some(excluded).filter(|excluded| len.is_none() && !excluded.boxes.is_empty());
        Self { space, listed, ascending, boxes }
    }

    pub(crate) fn contains(&self, action: ActionIndex) -> bool {
        self.listed.contains(&action) || self.is_in_box(action)
    }

    fn is_in_box(&self, action: ActionIndex) -> bool {
        self.boxes.is_some_and(|boxes| boxes.contains(&self.space.levels(action)))
    }

    /// With descriptors, the first action outside of each.
    pub(crate) fn one_of_each_descriptor(&self) -> Option<Vec<ActionIndex>> {
        let descriptors = self.space.descriptors()?.of_actions();
        let outside = (0..).map(ActionIndex).zip(descriptors).filter(|(action, _)| !self.contains(*action));
        let mut seen = HashSet::new();
        Some(outside.filter(|(_, of)| of.is_some() && seen.insert(**of)).map(|(action, _)| action).collect())
    }

    /// The listed actions.
    pub(crate) fn listed(&self) -> impl Iterator<Item = ActionIndex> {
        self.listed.iter().copied()
    }

    /// A uniformly random action outside; `None` if there is none.
    pub(crate) fn random_other(&self, random: &mut Random) -> Option<ActionIndex> {
        let free = self.space.len().checked_sub(self.ascending.len() as u64).filter(|free| *free > 0)?;
        let draws = if self.boxes.is_some() { DRAWS } else { 1 };
        (0..draws).map(|_| self.unlisted(random.below(free))).find(|action| !self.is_in_box(*action))
    }

    /// The unlisted action with this position among the unlisted ones.
    fn unlisted(&self, position: u64) -> ActionIndex {
        let mut index = position;
        for &listed in &self.ascending {
            if listed > index {
                break;
            }
            index += 1;
        }
        ActionIndex(index)
    }
}

/// With descriptors, the actions that have that of one of these actions, and those that have none.
fn same_outcome_or_none(space: &SearchSpace, actions: &HashSet<ActionIndex>) -> Vec<ActionIndex> {
    let Some(descriptors) = space.descriptors().map(|descriptors| descriptors.of_actions()) else { return Vec::new() };
    let place = |action: &ActionIndex| usize::try_from(action.0).ok();
    let known: HashSet<usize> = actions.iter().filter_map(|action| *descriptors.get(place(action)?)?).collect();
    let all = (0..).map(ActionIndex).zip(descriptors);
    all.filter(|(_, of)| of.is_none_or(|of| known.contains(&of))).map(|(action, _)| action).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::search_space::Dimension;

    fn space(levels: &[i32]) -> SearchSpace {
        let dimension = |(d, &n): (usize, &i32)| {
            let values = (0..n).map(f64::from).collect();
            Dimension { name: d.to_string(), values, lengthscale: 1.0 }
        };
        SearchSpace::new(levels.iter().enumerate().map(dimension).collect()).unwrap()
    }

    #[test]
    fn listed_actions_are_those_that_the_boxes_contain() {
        let space = space(&[3, 4, 2]);
        let excluded = ExcludedActions::new(&space, vec![vec![0..2, 1..4, 1..2], vec![1..3, 0..2, 0..2]]).unwrap();
        let listed: HashSet<ActionIndex> = excluded.list(&space, 24).collect();
        let contained: HashSet<ActionIndex> =
            (0..space.len()).map(ActionIndex).filter(|action| excluded.contains(&space.levels(*action))).collect();
        assert_eq!(listed, contained);
        // 6 and 8 actions, of which one is in both boxes.
        assert_eq!(listed.len(), 13);
        assert!(ExcludedActions::new(&space, vec![vec![0..2, 1..4]]).is_err());
        assert!(ExcludedActions::new(&space, vec![vec![0..2, 1..5, 0..1]]).is_err());
    }

    #[test]
    fn random_actions_are_outside_and_cover_what_is_outside() {
        for levels in [vec![3, 4, 2], vec![3, 4, 2, 100, 100, 100]] {
            let space = space(&levels);
            let rest: Vec<Range<usize>> = levels[3..].iter().map(|_| 0..100).collect();
            let full = |ranges: [Range<usize>; 3]| ranges.into_iter().chain(rest.clone()).collect::<Vec<_>>();
            let excluded =
                ExcludedActions::new(&space, vec![full([0..3, 1..4, 0..2]), full([0..2, 0..1, 0..2])]).unwrap();
            let forbidden = ForbiddenActions::new(&space, [ActionIndex(0)], &excluded);
            let mut random = Random::new(1, 0);
            let mut seen = HashSet::new();
            for _ in 0..50 {
                let action = forbidden.random_other(&mut random).unwrap();
                assert!(!forbidden.contains(action));
                seen.insert(space.levels(action)[..3].to_vec());
            }
            assert_eq!(seen, HashSet::from([vec![2, 0, 0], vec![2, 0, 1]]));
            let all = ExcludedActions::new(&space, vec![full([0..3, 0..4, 0..2])]).unwrap();
            assert_eq!(ForbiddenActions::new(&space, [], &all).random_other(&mut random), None);
        }
    }
}
