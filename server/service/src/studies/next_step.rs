//! Decides what a study needs next (a trial, a comparison, the end), as a pure function of its snapshot.

use super::analysis::Analyses;
use super::atlas::{self, AtlasStep};
use super::automatic_pause::reason_to_pause;
use super::lifecycle::StudyTransition;
use super::pending_comparison::{self, PendingComparison};
use super::snapshot::StudySnapshot;
use super::stopping_rule::reason_to_stop;
use super::trial_choice;
use super::warm_start_choice;
use crate::error::Error;
use gait_learner::ActionIndex;
use gaitwright_compute::OnPool;
use gaitwright_store::feedback::{FeedbackContent, FeedbackRow, Source};
use gaitwright_store::studies::{AnswerSource, AtlasRole, Evaluation, StudyState};
use gaitwright_store::trials::NewTrial;
use gaitwright_store::{FeedbackId, now};
use std::collections::HashSet;

/// Why an atlas cannot be made.
const NO_ROOT: &str = "The first trial found no gait, so the atlas has no root gait.";

/// Next step of a study.
pub(super) enum PlanningStep {
    Nothing,
    Transition(StudyTransition, String),
    Try(NewTrial),
}

/// Decides the next step from the snapshot alone; `analyses` is a cache.
pub(super) fn next_step(pool: &OnPool, snapshot: &StudySnapshot, analyses: &Analyses) -> Result<PlanningStep, Error> {
    let study = &snapshot.study;
    if study.plan.answer_source == AnswerSource::People {
        match (study.state, pending_comparison::pending_comparison(pool, snapshot).map_err(Error::Learner)?) {
            (StudyState::Running, PendingComparison::Pair(_)) => {
                return Ok(PlanningStep::Transition(StudyTransition::Ask, "A comparison needs an answer.".into()));
            }
            (StudyState::Waiting, PendingComparison::None) => {
                return Ok(PlanningStep::Transition(StudyTransition::Answered, String::new()));
            }
            // The comparison follows as soon as the gait is certified. No trial is proposed before.
            (_, PendingComparison::AfterCertificate(_)) => return Ok(PlanningStep::Nothing),
            _ => {}
        }
    }
    if study.state != StudyState::Running {
        return Ok(PlanningStep::Nothing);
    }
    if let Some(reason) = reason_to_pause(snapshot) {
        return Ok(PlanningStep::Transition(StudyTransition::Pause, reason));
    }
    let open = snapshot.open();
    let tried = u32::try_from(snapshot.trials.len()).unwrap_or(u32::MAX);
    if tried >= study.plan.number_of_trials {
        let reason = match study.plan.number_of_trials {
            1 => "The only trial is done.".to_owned(),
            all => format!("All {all} trials are done."),
        };
        let finished = PlanningStep::Transition(StudyTransition::Finish, reason);
        return Ok(if open == 0 { finished } else { PlanningStep::Nothing });
    }
    if let Some(reason) = reason_to_stop(snapshot) {
        return Ok(if open == 0 {
            PlanningStep::Transition(StudyTransition::Finish, reason)
        } else {
            PlanningStep::Nothing
        });
    }
    let is_full = open >= study.plan.parallel_trials as usize;
    if is_full || study.plan.evaluation == Evaluation::Script || warm_start_choice::awaits_root(snapshot) {
        return Ok(PlanningStep::Nothing);
    }
    if study.plan.atlas == AtlasRole::Make && !snapshot.trials.is_empty() {
        return next_of_atlas(snapshot);
    }
    let posterior = analyses.posterior(pool, snapshot).map_err(Error::Learner)?;
    match trial_choice::next_trial(pool, snapshot, &posterior) {
        Ok(new) => Ok(PlanningStep::Try(new)),
        Err(e) if e.is_exhausted() && open == 0 => {
            Ok(PlanningStep::Transition(StudyTransition::Finish, all_known(snapshot)))
        }
        Err(e) if e.is_exhausted() => Ok(PlanningStep::Nothing),
        Err(error) => Err(error.into()),
    }
}

/// The next step of a study that makes an atlas and has its first trial.
fn next_of_atlas(snapshot: &StudySnapshot) -> Result<PlanningStep, Error> {
    Ok(match atlas::next_of(snapshot) {
        AtlasStep::Solve(action) => PlanningStep::Try(trial_choice::trial_of_atlas(snapshot, action)?),
        AtlasStep::Wait => PlanningStep::Nothing,
        _ if snapshot.open() > 0 => PlanningStep::Nothing,
        AtlasStep::Complete => PlanningStep::Transition(StudyTransition::Finish, all_known(snapshot)),
        AtlasStep::NoRoot => PlanningStep::Transition(StudyTransition::Finish, NO_ROOT.to_owned()),
    })
}

/// Why no action is left.
fn all_known(snapshot: &StudySnapshot) -> String {
    let tried: HashSet<ActionIndex> = snapshot.trials.iter().map(|trial| trial.action_index).collect();
    if (tried.len() as u64) < snapshot.study.plan.search_space.len() {
        "Every action of the search space has been tried, or has the same gait as one that has.".to_owned()
    } else {
        "Every action of the search space has been tried.".to_owned()
    }
}

/// The trials that would be proposed next, one for each possible answer to the pending comparison.
pub(super) fn likely_next(pool: &OnPool, snapshot: &StudySnapshot) -> Result<Vec<NewTrial>, Error> {
    let pending = pending_comparison::pending_comparison(pool, snapshot).map_err(Error::Learner)?;
    let Some((a, b)) = pending.trials() else { return Ok(Vec::new()) };
    let mut likely: Vec<NewTrial> = Vec::new();
    for content in [
        FeedbackContent::Preference { winner: a, loser: b },
        FeedbackContent::Preference { winner: b, loser: a },
        FeedbackContent::NoDifference { a, b },
    ] {
        let mut then = snapshot.clone();
        then.study.state = StudyState::Running;
        then.feedback.push(FeedbackRow {
            seq: snapshot.feedback.last().map_or(1, |row| row.seq + 1),
            id: FeedbackId::fresh(),
            study_id: snapshot.study.id,
            content,
            source: Source::Subject,
            author: String::new(),
            note: String::new(),
            by_rater: false,
            could_have_known: false,
            replaces: None,
            restores: None,
            created_at: now(),
            retraction: None,
        });
        // Posteriors of hypothetical answers must not enter the cache.
        if let PlanningStep::Try(new) = next_step(pool, &then, &Analyses::default())?
            && !likely
                .iter()
                .any(|other| (other.action_index, other.warm_started_from) == (new.action_index, new.warm_started_from))
        {
            likely.push(new);
        }
    }
    Ok(likely)
}
