//! Trials that scripts of the lab evaluate: ask for one, tell what it gave.
//!
//! A suggestion is sticky: who asks again before telling gets the same trial. What is computed is computed before the
//! transaction, and written only if the study is still where it was.

use super::belief::Beliefs;
use super::choice::{self, ChoiceError};
use super::comparison::{by_gait_rmse, partners};
use super::preference;
use super::snapshot::StudySnapshot;
use crate::access::Caller;
use crate::error::Error;
use crate::printable;
use gaitwright_compute::OnPool;
use gaitwright_store::audit;
use gaitwright_store::feedback::FeedbackContent;
use gaitwright_store::studies::{Evaluation, FeedbackMode, Study, StudyState};
use gaitwright_store::trials::{NewTrial, Told, Trial, TrialState};
use gaitwright_store::{Store, StudyId, TrialId, Writer, events, studies, trials};
use serde::{Deserialize, Serialize};
use serde_json::json;
use std::sync::Arc;
use utoipa::ToSchema;

/// Asking for a trial.
#[derive(Debug, Clone, Default, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct Ask {
    /// Which evaluator asks: each has one open trial at most. By default the name of the caller.
    #[serde(default)]
    #[schema(min_length = 1, max_length = 80)]
    pub worker: Option<String>,
}

/// What to write when a script asks.
#[derive(Debug)]
pub enum Suggestion {
    /// It has an open trial already.
    Same(TrialId),
    /// This one is new, if the study still stands where it stood.
    New(Box<StudySnapshot>, Box<NewTrial>),
}

/// Looks what a worker should evaluate: no transaction is open yet.
///
/// # Errors
/// [`Error::Conflict`] when the study gives out no trial now, [`Error::Invalid`] for the worker's name.
pub async fn suggest(
    store: &mut Store,
    study: StudyId,
    worker: &str,
    beliefs: &Arc<Beliefs>,
) -> Result<Suggestion, Error> {
    let beliefs = Arc::clone(beliefs);
    let worker = printable::name("worker", worker, 80)?;
    let mut db = store.read().await?;
    let study = studies::get(&mut db, study).await?;
    if study.plan.evaluation != Evaluation::Script {
        return Err(Error::conflict(
            "the program evaluates the trials of this study; make one with evaluation \"script\"",
        ));
    }
    if let Some(open) = trials::open_of(&mut db, study.id, worker).await? {
        return Ok(Suggestion::Same(open));
    }
    if study.state != StudyState::Running {
        let reason = format!("the study is {}: {}", study.state.as_str(), study.state_reason);
        return Err(Error::conflict(reason.trim_end_matches(": ")));
    }
    let snapshot = StudySnapshot::read(&mut db, study).await?;
    drop(db);
    let plan = &snapshot.study.plan;
    if snapshot.trials.len() >= plan.trial_budget as usize {
        return Err(Error::conflict(format!("all {} trials were given out", plan.trial_budget)));
    }
    if snapshot.open() >= plan.parallel_trials as usize {
        return Err(Error::conflict(format!("{} trials are open already: tell what they gave first", snapshot.open())));
    }
    let choose = move |pool: &OnPool| {
        let believed = beliefs.posterior(pool, &snapshot).map_err(ChoiceError::Learner);
        let chosen = believed.and_then(|belief| choice::next_trial(pool, &snapshot, &belief));
        (snapshot, chosen)
    };
    let (snapshot, chosen) = store.compute(choose).await?;
    match chosen {
        Ok(new) => Ok(Suggestion::New(Box::new(snapshot), Box::new(new))),
        Err(e) if e.is_exhausted() => Err(Error::conflict("every action of the search space was tried")),
        Err(ChoiceError::Learner(e)) => Err(Error::Learner(e)),
        Err(ChoiceError::Bounds(e)) => Err(e.into()),
    }
}

/// Writes a suggestion. `None`: the study moved on meanwhile; look again.
///
/// # Errors
/// What the database reports.
pub async fn give_out(
    writer: &mut Writer,
    caller: &Caller,
    worker: &str,
    suggestion: &Suggestion,
) -> Result<Option<Trial>, Error> {
    let (snapshot, new) = match suggestion {
        Suggestion::Same(id) => {
            audit::append(writer, &caller.actor, "trial.ask", &format!("trial {id}"), &json!({ "again": true }))
                .await?;
            return Ok(Some(trials::get(writer, *id).await?));
        }
        Suggestion::New(snapshot, new) => (snapshot, new),
    };
    let study = snapshot.study.id;
    if !is_current(writer, snapshot).await? {
        return Ok(None);
    }
    let id = trials::insert(writer, study, new).await?;
    trials::give_to(writer, id, worker).await?;
    let payload = json!({ "trial_id": id, "number": new.number, "state": TrialState::Running });
    events::append(writer, study, "trial_started", &payload).await?;
    let detail = json!({ "study": study, "worker": worker, "number": new.number });
    audit::append(writer, &caller.actor, "trial.ask", &format!("trial {id}"), &detail).await?;
    Ok(Some(trials::get(writer, id).await?))
}

/// What a trial gave.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum Outcome {
    /// There is a gait.
    Converged,
    /// There is none: a result, too.
    NotConverged,
}

/// Telling what a trial gave.
#[derive(Debug, Clone, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct Tell {
    /// Whether there is a gait.
    pub outcome: Outcome,
    /// Why not: required when there is none, 1 to 2000 characters.
    #[serde(default)]
    #[schema(max_length = 2000)]
    pub reason: String,
    /// Gait RMSE, rad: required for a gait when Gait RMSE answers the comparisons.
    #[serde(default)]
    #[schema(minimum = 0)]
    pub gait_rmse_rad: Option<f64>,
    /// Cost of transport.
    #[serde(default)]
    pub cost_of_transport: Option<f64>,
}

/// What to write when a script tells.
#[derive(Debug)]
pub struct Heard {
    snapshot: StudySnapshot,
    told: Told,
    answers: Vec<FeedbackContent>,
}

/// Checks the outcome that a script tells, and what follows from it: no transaction is open yet.
///
/// # Errors
/// [`Error::Invalid`] naming the field, [`Error::Conflict`] when the trial is not open to be told.
pub async fn hear(store: &mut Store, id: TrialId, tell: &Tell) -> Result<Heard, Error> {
    let mut db = store.read().await?;
    let trial = trials::get(&mut db, id).await?;
    if trial.asked_by.is_none() {
        return Err(Error::conflict("the program evaluates this trial"));
    }
    if trial.state != TrialState::Running {
        return Err(Error::conflict(format!("the trial is {} already", trial.state.as_str())));
    }
    let study = studies::get(&mut db, trial.study_id).await?;
    let told = checked(&study, tell)?;
    let snapshot = StudySnapshot::read(&mut db, study).await?;
    drop(db);
    let (TrialState::Converged, Some(rmse)) = (told.state, told.gait_rmse_rad) else {
        return Ok(Heard { snapshot, told, answers: Vec::new() });
    };
    if snapshot.study.plan.feedback_mode == FeedbackMode::Human {
        return Ok(Heard { snapshot, told, answers: Vec::new() });
    }
    let find = move |pool: &OnPool| {
        let partners = partners(pool, &snapshot, id);
        (snapshot, partners)
    };
    let (snapshot, partners) = store.compute(find).await?;
    let partners = partners.map_err(Error::Learner)?;
    let answers = partners
        .into_iter()
        .filter_map(|old| snapshot.trial(old)?.gait_rmse_rad.map(|figure| by_gait_rmse((id, rmse), (old, figure))))
        .collect();
    Ok(Heard { snapshot, told, answers })
}

fn checked(study: &Study, tell: &Tell) -> Result<Told, Error> {
    let reason = tell.reason.trim();
    printable::note("reason", reason, 2000)?;
    for (field, value) in [("gait_rmse_rad", tell.gait_rmse_rad), ("cost_of_transport", tell.cost_of_transport)] {
        if value.is_some_and(|value| !(0.0..1e6).contains(&value)) {
            return Err(Error::invalid(field, json!(value), "0 to 1e6"));
        }
    }
    let state = match tell.outcome {
        Outcome::Converged => TrialState::Converged,
        Outcome::NotConverged if reason.is_empty() => {
            return Err(Error::invalid("reason", "", "1 to 2000 characters: why there is no gait"));
        }
        Outcome::NotConverged => TrialState::NotConverged,
    };
    let answered_by_rmse = study.plan.feedback_mode != FeedbackMode::Human;
    if state == TrialState::Converged && answered_by_rmse && tell.gait_rmse_rad.is_none() {
        let allowed = "a number: Gait RMSE answers the comparisons of this study";
        return Err(Error::invalid("gait_rmse_rad", json!(null), allowed));
    }
    Ok(Told {
        state,
        gait_rmse_rad: tell.gait_rmse_rad.filter(|_| state == TrialState::Converged),
        cost_of_transport: tell.cost_of_transport.filter(|_| state == TrialState::Converged),
        message: reason.to_owned(),
    })
}

/// Writes the outcome. `None`: the study has changed meanwhile; look again.
///
/// # Errors
/// What the database reports.
pub async fn record(writer: &mut Writer, caller: &Caller, id: TrialId, heard: &Heard) -> Result<Option<Trial>, Error> {
    let study = heard.snapshot.study.id;
    let present = trials::get(writer, id).await?;
    if present.state != TrialState::Running || !is_current(writer, &heard.snapshot).await? {
        return Ok(None);
    }
    trials::tell(writer, id, &heard.told).await?;
    preference::compute(writer, study, (id, heard.told.state), &heard.answers, &caller.name).await?;
    let payload = json!({ "trial_id": id, "number": present.number, "state": heard.told.state });
    events::append(writer, study, "trial_ended", &payload).await?;
    let detail = json!({ "study": study, "state": heard.told.state, "gait_rmse_rad": heard.told.gait_rmse_rad });
    audit::append(writer, &caller.actor, "trial.tell", &format!("trial {id}"), &detail).await?;
    Ok(Some(trials::get(writer, id).await?))
}

/// Whether the study has heard nothing and given out nothing since it was read.
async fn is_current(writer: &mut Writer, snapshot: &StudySnapshot) -> Result<bool, Error> {
    let study = snapshot.study.id;
    let total = trials::counts(writer, study).await?.total;
    Ok(snapshot.is_current(writer).await?
        && total as usize == snapshot.trials.len()
        && studies::get(writer, study).await?.revision == snapshot.study.revision)
}
