//! Trials that a lab script evaluates: the script asks for a trial and reports its outcome.
//!
//! Asking again before the report returns the same trial. Proposals are computed before the transaction, and written
//! only if the study has not changed.

use super::analysis::Analyses;
use super::feedback_log;
use super::gait_rmse_answers::{ComputedAnswer, gait_rmse_answers};
use super::lifecycle;
use super::safety_reports::SafetyReports;
use super::snapshot::StudySnapshot;
use super::trial_choice::{self, ChoiceError};
use crate::access::Caller;
use crate::error::Error;
use crate::printable;
use gaitwright_compute::OnPool;
use gaitwright_store::audit;
use gaitwright_store::studies::{AnswerSource, Evaluation, Study, StudyState};
use gaitwright_store::trials::{Label, NewTrial, ReportedResult, Trial, TrialState};
use gaitwright_store::{Connection, Store, StudyId, TrialId, Writer, events, studies, trials};
use serde::Deserialize;
use serde_json::json;
use std::sync::Arc;
use utoipa::ToSchema;

/// A request for a trial.
#[derive(Debug, Clone, Default, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct AskRequest {
    /// Name of the script that evaluates the trial. A script has at most one open trial. Defaults to the caller's name.
    #[serde(default)]
    #[schema(min_length = 1, max_length = 80)]
    pub script: Option<String>,
}

/// The trial for a script that asks.
#[derive(Debug)]
pub enum SuggestedTrial {
    /// The open trial of this script.
    Same(TrialId),
    /// A new trial, valid while the study matches the snapshot.
    New(Box<StudySnapshot>, Box<NewTrial>),
}

/// Chooses the trial for a script, outside any transaction.
///
/// # Errors
/// [`Error::Conflict`] if the study has no trial to give, [`Error::Invalid`] for the name of the script.
pub async fn suggest(
    store: &mut Store,
    study: StudyId,
    script: &str,
    analyses: &Arc<Analyses>,
) -> Result<SuggestedTrial, Error> {
    let analyses = Arc::clone(analyses);
    let script = printable::name("script", script, 80)?;
    let mut db = store.read().await?;
    let study = studies::get(&mut db, study).await?;
    if study.plan.evaluation != Evaluation::Script {
        return Err(Error::conflict(
            "The service evaluates the trials of this study itself. A script can evaluate trials only in a study whose \
             `evaluation` is `script`.",
        ));
    }
    if let Some(open) = trials::open_of(&mut db, study.id, script).await? {
        return Ok(SuggestedTrial::Same(open));
    }
    if study.state != StudyState::Running {
        let reason = format!("The study is {}. {}", lifecycle::in_words(study.state), study.state_reason);
        return Err(Error::conflict(reason.trim_end()));
    }
    let snapshot = StudySnapshot::read(&mut db, study).await?;
    drop(db);
    let plan = &snapshot.study.plan;
    if snapshot.trials.len() >= plan.number_of_trials as usize {
        return Err(Error::conflict(match plan.number_of_trials {
            1 => "The only trial of the study has been handed out.".to_owned(),
            all => format!("All {all} trials of the study have been handed out."),
        }));
    }
    if snapshot.open() >= plan.parallel_trials as usize {
        return Err(Error::conflict(match snapshot.open() {
            1 => "A trial is open, and its script has not reported the result yet.".to_owned(),
            open => format!("{open} trials are open, and their scripts have not reported the results yet."),
        }));
    }
    let choose = move |pool: &OnPool| {
        let posterior = analyses.posterior(pool, &snapshot).map_err(ChoiceError::Learner);
        let chosen = posterior.and_then(|posterior| trial_choice::next_trial(pool, &snapshot, &posterior));
        (snapshot, chosen)
    };
    let (snapshot, chosen) = store.compute(choose).await?;
    match chosen {
        Ok(new) => Ok(SuggestedTrial::New(Box::new(snapshot), Box::new(new))),
        Err(e) if e.is_exhausted() => Err(Error::conflict("Every action of the search space has been tried.")),
        Err(error) => Err(error.into()),
    }
}

/// Refuses a trial whose bounds were reported as unsafe since it was handed out.
///
/// # Errors
/// [`Error::Conflict`]; errors of the database.
pub async fn not_reported(db: &mut Connection, trial: TrialId) -> Result<(), Error> {
    let trial = trials::get(db, trial).await?;
    let reports = SafetyReports::read(db, trial.study_id).await?;
    if reports.unsafe_motions.bounds().any(|bounds| bounds == trial.action) {
        let number = trial.number;
        return Err(Error::conflict(format!(
            "A gait with the bounds of trial {number} was reported as unsafe. Cancel the trial, then ask again."
        )));
    }
    Ok(())
}

/// Writes the chosen trial. Returns `None` if the study has changed, and the caller must choose again.
///
/// # Errors
/// Errors of the database.
pub async fn assign(
    writer: &mut Writer,
    caller: &Caller,
    script: &str,
    suggestion: &SuggestedTrial,
) -> Result<Option<Trial>, Error> {
    let (snapshot, new) = match suggestion {
        SuggestedTrial::Same(id) => {
            let open = trials::get(writer, *id).await?;
            not_reported(writer, open.id).await?;
            audit::append(writer, &caller.actor, "trial.ask", &format!("trial {id}"), &json!({ "again": true }))
                .await?;
            return Ok(Some(open));
        }
        SuggestedTrial::New(snapshot, new) => (snapshot, new),
    };
    let study = snapshot.study.id;
    if !snapshot.is_unchanged(writer).await? {
        return Ok(None);
    }
    let Some(id) = snapshot.write_trial(writer, new).await? else { return Ok(None) };
    trials::assign(writer, id, script).await?;
    let payload = json!({ "trial_id": id, "number": new.number, "state": TrialState::Running });
    events::append(writer, study, "trial_started", &payload).await?;
    let detail = json!({ "study": study, "script": script, "number": new.number });
    audit::append(writer, &caller.actor, "trial.ask", &format!("trial {id}"), &detail).await?;
    Ok(Some(trials::get(writer, id).await?))
}

/// Label that a script reports: `converged`, the evaluation found a gait; `not_converged`, it found none.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum ReportedLabel {
    /// The evaluation found a gait.
    Converged,
    /// The evaluation found no gait.
    NotConverged,
}

impl From<ReportedLabel> for Label {
    fn from(label: ReportedLabel) -> Self {
        match label {
            ReportedLabel::Converged => Self::Converged,
            ReportedLabel::NotConverged => Self::NotConverged,
        }
    }
}

/// The result of a trial, as a script reports it.
#[derive(Debug, Clone, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct TellRequest {
    /// Whether the evaluation found a gait.
    pub label: ReportedLabel,
    /// Reason why no gait was found, 1 to 2000 characters. Required for `not_converged`.
    #[serde(default)]
    #[schema(max_length = 2000)]
    pub reason: String,
    /// Gait RMSE, rad. Required for `converged` if Gait RMSE answers the comparisons of the study.
    #[serde(default)]
    #[schema(minimum = 0)]
    pub gait_rmse_rad: Option<f64>,
    /// Cost of transport.
    #[serde(default)]
    pub cost_of_transport: Option<f64>,
}

/// A checked result, ready to be written.
#[derive(Debug)]
pub struct CheckedResult {
    snapshot: StudySnapshot,
    result: ReportedResult,
    answers: Vec<ComputedAnswer>,
}

/// Checks a result and derives its preferences, outside any transaction.
///
/// # Errors
/// [`Error::Invalid`] naming the field, [`Error::Conflict`] if the trial is not open or not evaluated by a script.
pub async fn check_result(store: &mut Store, id: TrialId, tell: &TellRequest) -> Result<CheckedResult, Error> {
    let mut db = store.read().await?;
    let trial = trials::get(&mut db, id).await?;
    if trial.script.is_none() {
        return Err(Error::conflict("The service evaluates this trial itself, so a script cannot report its result."));
    }
    if trial.state != TrialState::Running {
        return Err(Error::conflict(format!(
            "The trial has already ended ({}).",
            trial.state.as_str().replace('_', " ")
        )));
    }
    let study = studies::get(&mut db, trial.study_id).await?;
    let result = checked(&study, tell)?;
    let snapshot = StudySnapshot::read(&mut db, study).await?;
    drop(db);
    let (Label::Converged, Some(rmse)) = (result.label, result.gait_rmse_rad) else {
        return Ok(CheckedResult { snapshot, result, answers: Vec::new() });
    };
    let find = move |pool: &OnPool| {
        let answers = gait_rmse_answers(pool, &snapshot, id, rmse, None);
        (snapshot, answers)
    };
    let (snapshot, answers) = store.compute(find).await?;
    let answers = answers?;
    Ok(CheckedResult { snapshot, result, answers })
}

fn checked(study: &Study, tell: &TellRequest) -> Result<ReportedResult, Error> {
    let reason = tell.reason.trim();
    printable::note("reason", reason, 2000)?;
    for (field, value) in [("gait_rmse_rad", tell.gait_rmse_rad), ("cost_of_transport", tell.cost_of_transport)] {
        if value.is_some_and(|value| !(0.0..1e6).contains(&value)) {
            return Err(Error::invalid(field, json!(value), "0 to 1e6"));
        }
    }
    if tell.label == ReportedLabel::NotConverged && reason.is_empty() {
        return Err(Error::invalid("reason", "", "1 to 2000 characters long and say why no gait was found"));
    }
    let converged = tell.label == ReportedLabel::Converged;
    let answered_by_rmse = study.plan.answer_source != AnswerSource::People;
    if converged && answered_by_rmse && tell.gait_rmse_rad.is_none() {
        let allowed = "a number, because Gait RMSE answers the comparisons of this study";
        return Err(Error::invalid("gait_rmse_rad", json!(null), allowed));
    }
    Ok(ReportedResult {
        label: tell.label.into(),
        gait_rmse_rad: tell.gait_rmse_rad.filter(|_| converged),
        cost_of_transport: tell.cost_of_transport.filter(|_| converged),
        message: reason.to_owned(),
    })
}

/// Writes a result. Returns `None` if the study has changed, and the caller must check again.
///
/// # Errors
/// Errors of the database.
pub async fn record(
    writer: &mut Writer,
    caller: &Caller,
    id: TrialId,
    checked: &CheckedResult,
) -> Result<Option<Trial>, Error> {
    let study = checked.snapshot.study.id;
    let present = trials::get(writer, id).await?;
    if present.state != TrialState::Running || !checked.snapshot.is_unchanged(writer).await? {
        return Ok(None);
    }
    trials::tell(writer, id, &checked.result).await?;
    feedback_log::compute(writer, study, (id, checked.result.label), &checked.answers, &caller.name).await?;
    let payload = json!({ "trial_id": id, "number": present.number, "state": TrialState::from(checked.result.label) });
    events::append(writer, study, "trial_ended", &payload).await?;
    let detail =
        json!({ "study": study, "label": checked.result.label, "gait_rmse_rad": checked.result.gait_rmse_rad });
    audit::append(writer, &caller.actor, "trial.tell", &format!("trial {id}"), &detail).await?;
    Ok(Some(trials::get(writer, id).await?))
}
