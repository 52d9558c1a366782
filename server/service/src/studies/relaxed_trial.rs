//! Trials with relaxed bounds, which people request from the explanation of a trial without a gait.
//!
//! The action is the nearest one of the search space whose relaxed bounds are at least as loose as the explanation needs, so
//! the gait that the explanation found is a solution of it.

use super::analysis::Analyses;
use super::bound_grid;
use super::lifecycle::{self, StudyTransition};
use super::recommended_trial::best_trial;
use super::snapshot::StudySnapshot;
use super::study_extension;
use super::warm_start_choice::warm_start_of_next;
use crate::error::Error;
use gait_learner::{ActionIndex, LearnerError, SearchSpace};
use gait_optimizer::TunedBounds;
use gait_optimizer::explanation::Explanation;
use gaitwright_compute::OnPool;
use gaitwright_store::audit::{self, Actor};
use gaitwright_store::studies::{Evaluation, Study, StudyState};
use gaitwright_store::trials::{NewTrial, Trial, TrialState};
use gaitwright_store::{Connection, Store, TrialId, Writer, events, explanations, solve_jobs, studies, trials};
use serde_json::json;
use std::collections::BTreeMap;
use std::sync::Arc;
use thiserror::Error;

/// Relaxed bounds: names and values.
pub type RelaxedBounds = Vec<(String, f64)>;

/// The relaxations with which the explanation found a gait: single bounds first.
pub fn relaxations(explanation: &Explanation) -> Vec<RelaxedBounds> {
    let alone = explanation.relaxations.iter().filter_map(|one| Some(vec![(one.bound.clone(), one.to?)]));
    let together = explanation
        .together
        .iter()
        .filter_map(|joint| joint.bounds.iter().map(|one| Some((one.bound.clone(), one.to?))).collect());
    alone.chain(together).collect()
}

/// Why a study cannot try a relaxation.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum NoRelaxedTrial {
    /// The study does not tune the bound.
    #[error("This study does not tune {0}.")]
    NotTuned(String),
    /// The search space has no value that is loose enough.
    #[error(
        "The loosest value of {bound} in this study is {}, which is not loose enough.",
        TunedBounds::in_unit(bound, loosest)
    )]
    OutsideSearchSpace {
        /// The bound.
        bound: String,
        /// Its loosest value in the search space.
        loosest: f64,
    },
    /// A trial has these bounds already.
    #[error("Trial {number} of this study already has these bounds.")]
    Tried {
        /// The trial.
        trial: TrialId,
        /// Its number.
        number: u32,
    },
    /// The state of the study, and what to do first.
    #[error("{0}")]
    State(&'static str),
}

impl From<NoRelaxedTrial> for Error {
    fn from(error: NoRelaxedTrial) -> Self {
        Self::conflict(error.to_string())
    }
}

/// A trial that a study can try.
#[derive(Debug, Clone, PartialEq)]
pub struct RelaxedTrial {
    /// The relaxed bounds with their values in the search space.
    pub bounds: RelaxedBounds,
    /// Whether the study needs a larger number of trials for it.
    pub extends: bool,
    action: ActionIndex,
}

/// The trial that tries a relaxation of a trial's bounds, or why there is none.
///
/// # Errors
/// Errors of the database.
pub async fn of(
    db: &mut Connection,
    study: &Study,
    trial: &Trial,
    relaxation: &RelaxedBounds,
) -> Result<Result<RelaxedTrial, NoRelaxedTrial>, Error> {
    if let Err(refused) = may_take_a_trial(study) {
        return Ok(Err(refused));
    }
    let (action, bounds) =
        match relaxed(&study.plan.search_space, trial.action_index, relaxation).map_err(Error::Learner)? {
            Ok(found) => found,
            Err(refused) => return Ok(Err(refused)),
        };
    if let Some(known) = trials::of_action(db, study.id, action).await?.first() {
        return Ok(Err(NoRelaxedTrial::Tried { trial: known.id, number: known.number }));
    }
    let extends = trials::counts(db, study.id).await?.total >= study.plan.number_of_trials;
    Ok(Ok(RelaxedTrial { bounds, extends, action }))
}

fn may_take_a_trial(study: &Study) -> Result<(), NoRelaxedTrial> {
    let refused = match study.state {
        _ if study.plan.evaluation == Evaluation::Script => {
            "A lab script evaluates the trials of this study, so no trial can be requested here."
        }
        _ if study.archived_at.is_some() => {
            "The study is archived. Press \u{201c}Show in the list of studies again\u{201d} on its page \u{201c}Name, tags and notes\u{201d} first."
        }
        StudyState::Running | StudyState::Finished => return Ok(()),
        StudyState::NotStarted => "The study has not started. Start it first.",
        StudyState::Waiting => "The study is waiting for an answer. Answer the comparison first.",
        StudyState::Paused => "The study is paused. Resume it first.",
        StudyState::Stopped => "The study was stopped. Extend it first.",
    };
    Err(NoRelaxedTrial::State(refused))
}

/// The nearest action that is as loose as a relaxation, with the values of the relaxed bounds.
fn relaxed(
    space: &SearchSpace,
    from: ActionIndex,
    relaxation: &RelaxedBounds,
) -> Result<Result<(ActionIndex, RelaxedBounds), NoRelaxedTrial>, LearnerError> {
    let mut levels = space.levels(space.check(from)?);
    let mut bounds = RelaxedBounds::new();
    for (bound, needed) in relaxation {
        let tuned = space.dimensions().iter().zip(&mut levels).find(|(dimension, _)| dimension.name == *bound);
        let Some((dimension, level)) = tuned else { return Ok(Err(NoRelaxedTrial::NotTuned(bound.clone()))) };
        let values = &dimension.values;
        let is_lower = TunedBounds::NAMES.iter().zip(TunedBounds::IS_LOWER).any(|(name, lower)| name == bound && lower);
        let (found, loosest) = if is_lower {
            (values.iter().rposition(|value| value <= needed), values.first())
        } else {
            (values.iter().position(|value| value >= needed), values.last())
        };
        let Some(found) = found else {
            let loosest = loosest.copied().unwrap_or(*needed);
            return Ok(Err(NoRelaxedTrial::OutsideSearchSpace { bound: bound.clone(), loosest }));
        };
        *level = found;
        bounds.push((bound.clone(), values[found]));
    }
    Ok(Ok((space.index_of_levels(&levels)?, bounds)))
}

/// A trial that a person requests, valid while the study matches the snapshot.
#[derive(Debug)]
pub struct ChosenTrial {
    snapshot: StudySnapshot,
    new: NewTrial,
    /// The trial without a gait.
    from: TrialId,
    bounds: RelaxedBounds,
}

/// Chooses the trial that tries a relaxation of an explanation, outside any transaction.
///
/// # Errors
/// [`Error::Conflict`] if the study cannot try it, [`Error::Invalid`] for a relaxation that the explanation does not have;
/// errors of the database.
pub async fn choose(
    store: &mut Store,
    id: TrialId,
    place: usize,
    analyses: &Arc<Analyses>,
) -> Result<ChosenTrial, Error> {
    let mut db = store.read().await?;
    let trial = trials::get(&mut db, id).await?;
    let study = studies::get(&mut db, trial.study_id).await?;
    let explained = explanations::find(&mut db, id).await?;
    let known = explained.map(|made| relaxations(&made.explanation)).unwrap_or_default();
    let relaxation = known.get(place).ok_or_else(|| {
        Error::invalid("relaxation", place, "the index of a relaxation in the explanation of the trial, counted from 0")
    })?;
    let RelaxedTrial { bounds, action, .. } = of(&mut db, &study, &trial, relaxation).await??;
    let snapshot = StudySnapshot::read(&mut db, study).await?;
    drop(db);
    let analyses = Arc::clone(analyses);
    let rank = move |pool: &OnPool| {
        let posterior = analyses.posterior(pool, &snapshot);
        let ranked = posterior.and_then(|posterior| {
            Ok::<_, LearnerError>((best_trial(&snapshot, &posterior)?, warm_start_of_next(&snapshot, &posterior)?))
        });
        (snapshot, ranked)
    };
    let (snapshot, ranked) = store.compute(rank).await?;
    let (best_before, warm_started_from) = ranked.map_err(Error::Learner)?;
    let plan = &snapshot.study.plan;
    let new = NewTrial {
        number: snapshot.trials.last().map_or(1, |newest| newest.number + 1),
        action_index: action,
        action: bound_grid::bounds_of(&plan.search_space, plan.base_bounds, action)?,
        reason: format!("requested by a person: trial {} with {} relaxed", trial.number, names(&bounds)),
        best_before,
        warm_started_from,
    };
    Ok(ChosenTrial { snapshot, new, from: id, bounds })
}

/// `a5 and a7`.
fn names(bounds: &RelaxedBounds) -> String {
    bounds.iter().map(|(bound, _)| bound.as_str()).collect::<Vec<_>>().join(" and ")
}

/// Queues the trial. A finished study continues, with a larger number of trials if it has made all of them. Returns `None` if
/// the study has changed, and the caller must choose again.
///
/// # Errors
/// [`Error::Invalid`] if the number of trials cannot grow; errors of the database.
pub async fn queue(writer: &mut Writer, actor: &Actor, chosen: &ChosenTrial) -> Result<Option<TrialId>, Error> {
    let ChosenTrial { snapshot, new, from, bounds } = chosen;
    if !snapshot.is_unchanged(writer).await? {
        return Ok(None);
    }
    let study = &snapshot.study;
    let number_of_trials = study.plan.number_of_trials.max(new.number);
    let state =
        if study.state.has_ended() { lifecycle::after(study.state, StudyTransition::Extend)? } else { study.state };
    if (state, number_of_trials) != (study.state, study.plan.number_of_trials) {
        study_extension::raise_number_of_trials(writer, study, number_of_trials, state).await?;
        events::append(writer, study.id, "study_changed", &json!({ "state": state, "reason": "trial.relax" })).await?;
    }
    let Some(trial) = snapshot.write_trial(writer, new).await? else { return Ok(None) };
    solve_jobs::insert(writer, trial).await?;
    let payload = json!({ "trial_id": trial, "number": new.number, "state": TrialState::Queued });
    events::append(writer, study.id, "trial_queued", &payload).await?;
    let detail = json!({
        "study": study.id, "number": new.number, "without_gait": from,
        "bounds": bounds.iter().cloned().collect::<BTreeMap<_, _>>(),
        "number_of_trials": number_of_trials,
    });
    audit::append(writer, actor, "trial.relax", &format!("trial {trial}"), &detail).await?;
    Ok(Some(trial))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use gait_learner::Dimension;

    fn space() -> SearchSpace {
        let dimension = |name: &str, values: &[f64]| Dimension {
            name: name.to_owned(),
            values: values.to_vec(),
            lengthscale: values[1] - values[0],
        };
        SearchSpace::new(vec![dimension("a5", &[0.0, 0.02, 0.04]), dimension("a7", &[20.0, 35.0, 50.0])]).unwrap()
    }

    fn found(relaxation: &[(&str, f64)]) -> Result<(Vec<f64>, RelaxedBounds), NoRelaxedTrial> {
        let (space, relaxation) = (space(), relaxation.iter().map(|(name, to)| ((*name).to_owned(), *to)).collect());
        // The tightest action: a5 is a lower bound.
        let from = space.index_of_values(&[0.04, 20.0]).unwrap();
        relaxed(&space, from, &relaxation).unwrap().map(|(action, bounds)| (space.values(action), bounds))
    }

    #[test]
    fn action_is_the_nearest_that_is_as_loose() {
        let one = |name: &str, value| vec![(name.to_owned(), value)];
        assert_eq!(found(&[("a7", 21.3)]), Ok((vec![0.04, 35.0], one("a7", 35.0))));
        assert_eq!(found(&[("a7", 35.0)]), Ok((vec![0.04, 35.0], one("a7", 35.0))));
        assert_eq!(found(&[("a5", 0.031)]), Ok((vec![0.02, 20.0], one("a5", 0.02))));
        assert_eq!(found(&[("a5", 0.0), ("a7", 36.0)]).map(|(values, _)| values), Ok(vec![0.0, 50.0]));
    }

    #[test]
    fn bound_that_is_not_tuned_or_not_loose_enough_is_refused() {
        assert_eq!(found(&[("a6", 0.2)]), Err(NoRelaxedTrial::NotTuned("a6".to_owned())));
        let refused = found(&[("a7", 51.0)]).unwrap_err();
        assert_eq!(refused, NoRelaxedTrial::OutsideSearchSpace { bound: "a7".to_owned(), loosest: 50.0 });
        assert_eq!(refused.to_string(), "The loosest value of a7 in this study is 50°, which is not loose enough.");
    }
}
