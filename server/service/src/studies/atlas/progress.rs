//! How far the study of an atlas is.

use super::action_map::BATCH;
use super::of_study::{Replay, replayed};
use gaitwright_compute::OnPool;
use gaitwright_store::studies::StudyPlan;
use gaitwright_store::trials::Trial;
use std::collections::BTreeSet;

/// How far the study of an atlas is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct AtlasProgress {
    /// Number of actions of the search space.
    pub actions: u64,
    /// Number of actions with a gait, or with a solve that found none.
    pub with_result: u64,
    /// Number of actions with a gait.
    pub with_gait: u64,
    /// Number of different gaits.
    pub gaits: u32,
    /// Number of solves that these results come from.
    pub solves: u64,
    /// About how many solves are missing, if each serves as many further actions as the latest ones did.
    pub solves_left: u64,
}

/// The progress of an atlas with these trials.
pub fn progress(_: &OnPool, plan: &StudyPlan, trials: &[Trial]) -> AtlasProgress {
    AtlasProgress::of(&replayed(&plan.search_space, trials))
}

impl AtlasProgress {
    pub(super) fn of(replay: &Replay<'_>) -> Self {
        let numbers = replay.map.gait_numbers();
        let has_gait = |place: usize| numbers.get(place).is_some_and(Option::is_some);
        let (actions, with_result) = (replay.map.len(), replay.map.solves().count() as u64);
        // Two solves of a batch can find the same gait, of which the first one counts.
        let gaits: BTreeSet<usize> =
            replay.map.solves().map(|(_, place)| place).filter(|place| has_gait(*place)).collect();
        let latest = &replay.served[replay.served.len().saturating_sub(BATCH)..];
        let each = latest.iter().sum::<u64>().max(1);
        let missing = actions - with_result;
        Self {
            actions,
            with_result,
            with_gait: replay.map.solves().filter(|(_, place)| has_gait(*place)).count() as u64,
            gaits: u32::try_from(gaits.len()).unwrap_or(u32::MAX),
            solves: replay.trials.len() as u64,
            solves_left: (missing * latest.len().max(1) as u64).div_ceil(each).min(missing),
        }
    }
}
