//! The solves of an atlas, and the row of each action.

use super::action_map::ActionMap;
use super::gait_values::GaitValues;
use super::solved_action::SolvedAction;
use crate::studies::bound_grid;
use gait_learner::{ActionIndex, SearchSpace};
use gait_optimizer::{ModelError, TunedBounds};
use std::collections::BTreeMap;

/// The solves so far, and the solve of each action.
#[derive(Debug)]
pub struct GaitMap {
    actions: ActionMap,
    solves: Vec<SolvedAction>,
}

impl GaitMap {
    /// With the root gait, which has a solve already.
    pub(super) fn new(space: SearchSpace, root: SolvedAction) -> Self {
        let mut map = Self { actions: ActionMap::new(space), solves: Vec::new() };
        map.add(root);
        map
    }

    /// The names of the bounds, in the order of the values of an action.
    pub fn bounds(&self) -> impl Iterator<Item = &str> {
        self.actions.space().dimensions().iter().map(|dimension| dimension.name.as_str())
    }

    /// The values and the solve of each action that has one, in the order of the search space. Gaits are numbered from 1, the
    /// root, in the order in which they were found.
    pub fn rows(&self) -> impl Iterator<Item = AtlasRow<'_>> {
        let numbers = self.actions.gait_numbers();
        self.actions.solves().map(move |(action, place)| {
            let values = self.actions.space().values(action);
            AtlasRow { values, number: numbers[place], solved: &self.solves[place] }
        })
    }

    /// Each different gait, by its number.
    pub fn gaits(&self) -> BTreeMap<u32, &GaitValues> {
        self.rows().filter_map(|row| Some((row.number?, row.solved.gait.as_ref()?))).collect()
    }

    /// Number of actions.
    pub fn actions(&self) -> u64 {
        self.actions.len()
    }

    /// Number of actions that have a gait or a solve without one.
    pub fn assigned(&self) -> u64 {
        self.actions.solves().count() as u64
    }

    pub(super) fn bounds_of(&self, base: TunedBounds, action: ActionIndex) -> Result<TunedBounds, ModelError> {
        bound_grid::bounds_of(self.actions.space(), base, action)
    }

    /// The next actions without a known gait.
    pub(super) fn next_batch(&mut self) -> Vec<ActionIndex> {
        self.actions.next_batch()
    }

    /// Adds a solve. Its gait is that of all actions in its box that have none, or whose own solve found none.
    pub(super) fn add(&mut self, solved: SolvedAction) {
        self.actions.add(solved.action, solved.gait.as_ref().map(|gait| &gait.unchanged_bounds[..]));
        self.solves.push(solved);
    }

    /// How many actions have a gait, as in `289 solves: 11660 of 11664 actions have a gait`.
    pub fn in_words(&self) -> String {
        let found = self.actions.solves().filter(|(_, place)| self.solves[*place].gait.is_some()).count();
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

#[cfg(test)]
pub(super) mod tests {
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
            joint_angles_rad: Vec::new(),
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
            let batch = atlas.next_batch();
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
        assert_eq!(atlas.actions.place_of(ActionIndex(0)), Some(1));
        atlas.add(solved(&space, 1, &["a8"], true));
        assert_eq!(
            [0, 1, 2, 5].map(|action| atlas.actions.place_of(ActionIndex(action))),
            [Some(2), Some(2), Some(2), Some(0)]
        );
        // The solve without a gait has no number.
        assert_eq!(atlas.gaits().into_keys().collect::<Vec<_>>(), [1, 2]);
        atlas.add(solved(&space, 2, &[], false));
        assert_eq!(atlas.actions.place_of(ActionIndex(2)), Some(2));
    }
}
