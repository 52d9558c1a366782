//! A study that makes an atlas: its trials find the gait of every action. Its solves are the same ones, in the same order, as
//! those of the command `atlas`, whatever the number of workers and however often the process was killed.

use super::action_map::{ActionMap, BATCH};
use crate::studies::snapshot::StudySnapshot;
use crate::studies::study_plan::NewStudy;
use gait_learner::LearnerSettings;
use gait_learner::{ActionIndex, SearchSpace};
use gaitwright_store::studies::{AnswerSource, AtlasRole, WarmStartFrom};
use gaitwright_store::trials::Trial;
use std::collections::HashMap;

/// As many trials as a study can have: an atlas ends earlier, when every action has a result.
const MAX_SOLVES: u32 = 10_000;
/// Below that of studies by default.
const PRIORITY: i32 = -5;

/// The study that makes the atlas of the problem of another one. Everything that does not affect a gait has the same value, so
/// that studies of one problem have one atlas. Other studies run first.
pub fn atlas_of(study: NewStudy) -> NewStudy {
    let defaults = NewStudy::of(study.subject_id);
    NewStudy {
        name: None,
        learner: LearnerSettings::default(),
        answer_source: AnswerSource::GaitRmse,
        number_of_trials: MAX_SOLVES,
        solve_seconds_budget: None,
        unchanged_limit: None,
        repeat_results: Some(false),
        warm_start_from: WarmStartFrom::Root,
        atlas: AtlasRole::Make,
        simulated_walks: defaults.simulated_walks,
        parallel_trials: u32::try_from(BATCH).unwrap_or(1),
        priority: PRIORITY,
        seed: defaults.seed,
        start: true,
        ..study
    }
}

/// Next step of an atlas.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in super::super) enum AtlasStep {
    /// A solve of this action.
    Solve(ActionIndex),
    /// The end of an open solve.
    Wait,
    /// Nothing: every action has a result.
    Complete,
    /// The first trial found no gait, so there is no root.
    NoRoot,
}

/// The next step of the study of an atlas that has its first trial.
pub(in super::super) fn next_of(snapshot: &StudySnapshot) -> AtlasStep {
    match snapshot.trials.first() {
        Some(root) if root.state.is_open() => AtlasStep::Wait,
        Some(root) if !root.state.has_gait() => AtlasStep::NoRoot,
        _ => replayed(&snapshot.study.plan.search_space, &snapshot.trials).next,
    }
}

/// The action with which the atlas of a study found the gait of an action; `None` without an atlas, or if it lacks the action.
pub(in super::super) fn representative(snapshot: &StudySnapshot, action: ActionIndex) -> Option<ActionIndex> {
    if snapshot.atlas.is_empty() {
        return None;
    }
    replayed(&snapshot.study.plan.search_space, &snapshot.atlas).map.representative(action)
}

/// The trials of an atlas in the order of its solves.
pub(super) struct Replay<'a> {
    /// The solve of each action.
    pub(super) map: ActionMap,
    /// The trial of each place of the map.
    pub(super) trials: Vec<&'a Trial>,
    /// For how many actions each of them is the first solve.
    pub(super) served: Vec<u64>,
    /// Next step.
    pub(super) next: AtlasStep,
}

/// Follows the order of the solves as far as their results are known. Trials that people added outside this order count for
/// their own action.
pub(super) fn replayed<'a>(space: &SearchSpace, trials: &'a [Trial]) -> Replay<'a> {
    let of_action: HashMap<ActionIndex, &Trial> = trials.iter().map(|trial| (trial.action_index, trial)).collect();
    let (map, next) = (ActionMap::new(space.clone()), AtlasStep::Complete);
    let mut replay = Replay { map, trials: Vec::new(), served: Vec::new(), next };
    let mut batch: Vec<ActionIndex> = trials.first().map(|root| root.action_index).into_iter().collect();
    loop {
        let found: Vec<Option<&Trial>> = batch.iter().map(|action| of_action.get(action).copied()).collect();
        let missing = batch.iter().zip(&found).find(|(_, trial)| trial.is_none());
        if let Some((action, _)) = missing {
            replay.next = AtlasStep::Solve(*action);
            return replay;
        }
        if found.iter().flatten().any(|trial| trial.state.is_open()) {
            replay.next = AtlasStep::Wait;
            return replay;
        }
        for trial in found.into_iter().flatten() {
            let report = trial.report.as_ref().filter(|_| trial.state.has_gait());
            let served = replay.map.add(trial.action_index, report.map(|report| &report.unchanged_bounds[..]));
            replay.served.push(served);
            replay.trials.push(trial);
        }
        batch = replay.map.next_batch();
        if batch.is_empty() {
            return replay;
        }
    }
}
