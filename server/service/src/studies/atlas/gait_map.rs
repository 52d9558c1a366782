//! Which gait each action has: that of its own solve, or one that another action shares with it.

use super::solved_action::SolvedAction;
use crate::studies::actions_with_known_gait::levels_with_gait;
use crate::studies::bound_grid;
use gait_learner::{ActionIndex, SearchSpace};
use gait_optimizer::{ModelError, TunedBounds};

/// The solves so far, and the solve of each action.
#[derive(Debug)]
pub struct GaitMap {
    space: SearchSpace,
    solves: Vec<SolvedAction>,
    /// For each action, its place in `solves`.
    solve_of: Vec<Option<usize>>,
    /// Number of actions that were visited in the order of [`GaitMap::nth`].
    visited: usize,
    stride: usize,
}

impl GaitMap {
    /// With the root gait, which has a solve already.
    pub(super) fn new(space: SearchSpace, root: SolvedAction) -> Self {
        let actions = usize::try_from(space.len()).unwrap_or(usize::MAX);
        let mut map =
            Self { space, solves: Vec::new(), solve_of: vec![None; actions], visited: 0, stride: stride(actions) };
        map.add(root);
        map
    }

    /// The names of the bounds, in the order of the values of an action.
    pub fn bounds(&self) -> impl Iterator<Item = &str> {
        self.space.dimensions().iter().map(|dimension| dimension.name.as_str())
    }

    /// The values and the solve of each action that has one, in the order of the search space. Gaits are numbered from 1, the
    /// root, in the order in which they were found.
    pub fn rows(&self) -> impl Iterator<Item = AtlasRow<'_>> {
        let mut gaits = 0_u32;
        let number = |solved: &SolvedAction| {
            gaits += u32::from(solved.gait.is_some());
            solved.gait.is_some().then_some(gaits)
        };
        let numbers: Vec<Option<u32>> = self.solves.iter().map(number).collect();
        self.solve_of.iter().enumerate().filter_map(move |(action, place)| {
            let place = (*place)?;
            let values = self.space.values(ActionIndex(action as u64));
            Some(AtlasRow { values, number: numbers[place], solved: &self.solves[place] })
        })
    }

    /// Number of actions.
    pub fn actions(&self) -> u64 {
        self.solve_of.len() as u64
    }

    /// Number of actions that have a gait or a solve without one.
    pub fn assigned(&self) -> u64 {
        self.solve_of.iter().flatten().count() as u64
    }

    pub(super) fn bounds_of(&self, base: TunedBounds, action: ActionIndex) -> Result<TunedBounds, ModelError> {
        bound_grid::bounds_of(&self.space, base, action)
    }

    /// The next actions without a known gait, at most `most`. Neighbours often share a gait, so the order jumps over the
    /// grid.
    pub(super) fn next_batch(&mut self, most: usize) -> Vec<ActionIndex> {
        let mut batch = Vec::new();
        while batch.len() < most && self.visited < self.solve_of.len() {
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

    /// Adds a solve. Its gait is that of all actions in its box that have none, or whose own solve found none.
    pub(super) fn add(&mut self, solved: SolvedAction) {
        let place = self.solves.len();
        let actions = match &solved.gait {
            None => vec![solved.action],
            Some(gait) => {
                actions_in(&self.space, &levels_with_gait(&self.space, solved.action, &gait.unchanged_bounds))
            }
        };
        let has_gait = solved.gait.is_some();
        self.solves.push(solved);
        for action in actions {
            let Some(slot) = usize::try_from(action.0).ok().and_then(|index| self.solve_of.get_mut(index)) else {
                continue;
            };
            let earlier = slot.map(|earlier| self.solves[earlier].gait.is_some());
            if earlier.is_none() || (earlier == Some(false) && has_gait) {
                *slot = Some(place);
            }
        }
    }

    /// How many actions have a gait, as in `289 solves: 11660 of 11664 actions have a gait`.
    pub fn in_words(&self) -> String {
        let found = self.solve_of.iter().flatten().filter(|place| self.solves[**place].gait.is_some()).count();
        format!("{} solves: {found} of {} actions have a gait", self.solves.len(), self.actions())
    }
}

/// An action and its gait.
#[derive(Debug)]
pub struct AtlasRow<'a> {
    /// The value of each bound.
    pub values: Vec<f64>,
    /// The number of its gait; `None` without a gait.
    pub number: Option<u32>,
    /// The solve that found the gait, or the action's own solve without one.
    pub solved: &'a SolvedAction,
}

/// The actions of a box of levels.
fn actions_in(space: &SearchSpace, levels: &[std::ops::Range<usize>]) -> Vec<ActionIndex> {
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

#[cfg(test)]
pub(super) mod tests {
    use super::super::gait_values::GaitValues;
    use super::*;
    use gait_optimizer::{SolveStatus, UnchangedBound};

    pub(in super::super) fn solved(space: &SearchSpace, action: u64, free: &[&str], converged: bool) -> SolvedAction {
        let values = space.values(ActionIndex(action));
        let bounds = space.dimensions().iter().zip(values).map(|(dimension, value)| {
            let end = (!free.contains(&dimension.name.as_str())).then_some(value);
            UnchangedBound { bound: dimension.name.clone(), least: end, most: end }
        });
        let gait = GaitValues {
            objective: 0.0,
            cost_of_transport: 0.0,
            gait_rmse_rad: 0.0,
            gait_rmse_other_rad: None,
            speed_m_s: 0.0,
            stride_length_m: 0.0,
            double_support_percent: 0.0,
            step_time_asymmetry: 0.0,
            peak_hip_torque_nm_kg: 0.0,
            unchanged_bounds: bounds.collect(),
        };
        let status = if converged { SolveStatus::Converged } else { SolveStatus::Stalled };
        SolvedAction { action: ActionIndex(action), status, iterations: 1, gait: converged.then_some(gait) }
    }

    #[test]
    fn actions_in_the_box_of_a_gait_are_not_solved() {
        let space = bound_grid::table_i().unwrap();
        let mut atlas = GaitMap::new(space.clone(), solved(&space, 0, &["a1", "a3", "a8"], true));
        assert_eq!(atlas.assigned(), 2 * 3 * 3);
        let mut solves = 1;
        loop {
            let batch = atlas.next_batch(16);
            if batch.is_empty() {
                break;
            }
            for action in batch {
                atlas.add(solved(&space, action.0, &["a1", "a3", "a8"], true));
                solves += 1;
            }
        }
        assert_eq!(atlas.assigned(), atlas.actions());
        // Each gait serves 18 actions; a batch may solve some of them twice.
        assert!((648..800).contains(&solves), "{solves}");
    }

    #[test]
    fn gait_of_another_action_replaces_a_solve_without_a_gait() {
        let space = bound_grid::table_i().unwrap();
        let mut atlas = GaitMap::new(space.clone(), solved(&space, 5, &[], true));
        atlas.add(solved(&space, 0, &[], false));
        assert_eq!(atlas.solve_of[0], Some(1));
        atlas.add(solved(&space, 1, &["a8"], true));
        assert_eq!([0, 1, 2, 5].map(|action: usize| atlas.solve_of[action]), [Some(2), Some(2), Some(2), Some(0)]);
        atlas.add(solved(&space, 2, &[], false));
        assert_eq!(atlas.solve_of[2], Some(2));
    }
}
