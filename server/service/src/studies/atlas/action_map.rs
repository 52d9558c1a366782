//! Which solve has the gait of each action: its own, or that of an action with which it shares the gait.

use crate::studies::actions_with_known_gait::levels_with_gait;
use gait_learner::{ActionIndex, SearchSpace};
use gait_optimizer::UnchangedBound;
use std::ops::Range;

/// Number of solves in a batch. The known gaits are updated after each batch. A constant, so that an atlas does not depend on
/// the number of workers.
pub(in super::super) const BATCH: usize = 16;

/// The solve of each action. Solves have places, from 0, the root.
#[derive(Debug)]
pub(in super::super) struct ActionMap {
    space: SearchSpace,
    /// The action of each solve, and whether it found a gait.
    solved: Vec<(ActionIndex, bool)>,
    /// For each action, its place in `solved`.
    solve_of: Vec<Option<usize>>,
    /// Number of actions that were visited in the order of [`ActionMap::nth`].
    visited: usize,
    stride: usize,
}

impl ActionMap {
    pub(in super::super) fn new(space: SearchSpace) -> Self {
        let actions = usize::try_from(space.len()).unwrap_or(usize::MAX);
        let (solve_of, stride) = (vec![None; actions], stride(actions));
        Self { space, solved: Vec::new(), solve_of, visited: 0, stride }
    }

    pub(in super::super) fn space(&self) -> &SearchSpace {
        &self.space
    }

    /// Number of actions.
    pub(in super::super) fn len(&self) -> u64 {
        self.solve_of.len() as u64
    }

    /// Each action that has a solve, in the order of the search space, and the place of the solve.
    pub(in super::super) fn solves(&self) -> impl Iterator<Item = (ActionIndex, usize)> {
        let all = self.solve_of.iter().enumerate();
        all.filter_map(|(action, place)| Some((ActionIndex(action as u64), (*place)?)))
    }

    /// The place of the solve of an action.
    pub(in super::super) fn place_of(&self, action: ActionIndex) -> Option<usize> {
        usize::try_from(action.0).ok().and_then(|index| *self.solve_of.get(index)?)
    }

    /// The solved action that has the gait of an action.
    pub(in super::super) fn representative(&self, action: ActionIndex) -> Option<ActionIndex> {
        self.place_of(action).map(|place| self.solved[place].0)
    }

    /// The number of the gait of each solve, from 1, the root, in the order in which they were found; `None` without a gait.
    pub(in super::super) fn gait_numbers(&self) -> Vec<Option<u32>> {
        let mut gaits = 0_u32;
        let number = |(_, has_gait): &(ActionIndex, bool)| {
            gaits += u32::from(*has_gait);
            has_gait.then_some(gaits)
        };
        self.solved.iter().map(number).collect()
    }

    /// The next actions without a known gait, none at the end. Neighbours often share a gait, so the order jumps over the grid.
    pub(in super::super) fn next_batch(&mut self) -> Vec<ActionIndex> {
        let mut batch = Vec::new();
        while batch.len() < BATCH && self.visited < self.solve_of.len() {
            let action = self.nth(self.visited);
            self.visited += 1;
            if self.solve_of[action].is_none() {
                batch.push(ActionIndex(action as u64));
            }
        }
        batch
    }

    fn nth(&self, place: usize) -> usize {
        let all = self.solve_of.len();
        ((place as u128 * self.stride as u128) % all as u128) as usize
    }

    /// Adds a solve, with the values of the bounds that leave its gait as it is, if it has one. The gait is that of all actions
    /// in its box that have none, or whose own solve found none. Returns how many actions had no solve before.
    pub(in super::super) fn add(&mut self, action: ActionIndex, gait: Option<&[UnchangedBound]>) -> u64 {
        let place = self.solved.len();
        let actions = match gait {
            None => vec![action],
            Some(unchanged) => actions_in(&self.space, &levels_with_gait(&self.space, action, unchanged)),
        };
        self.solved.push((action, gait.is_some()));
        let mut served = 0;
        for action in actions {
            let Some(slot) = usize::try_from(action.0).ok().and_then(|index| self.solve_of.get_mut(index)) else {
                continue;
            };
            let earlier = slot.map(|earlier| self.solved[earlier].1);
            served += u64::from(earlier.is_none());
            if earlier.is_none() || (earlier == Some(false) && gait.is_some()) {
                *slot = Some(place);
            }
        }
        served
    }
}

/// The actions of a box of levels.
fn actions_in(space: &SearchSpace, levels: &[Range<usize>]) -> Vec<ActionIndex> {
    let mut chosen: Vec<Vec<usize>> = vec![Vec::new()];
    for range in levels {
        chosen = chosen
            .into_iter()
            .flat_map(|start| range.clone().map(move |level| [&start[..], &[level]].concat()))
            .collect();
    }
    // The levels are those of the dimensions, so each is an action.
    chosen.iter().filter_map(|levels| space.index_of_levels(levels).ok()).collect()
}

/// The smallest step above the golden section of `all` that visits every place once.
fn stride(all: usize) -> usize {
    let start = all * 618 / 1000;
    (start.max(1)..=all).find(|step| greatest_common_divisor(*step, all.max(1)) == 1).unwrap_or(1)
}

fn greatest_common_divisor(a: usize, b: usize) -> usize {
    if b == 0 { a } else { greatest_common_divisor(b, a % b) }
}
