//! Records a report that one gait is unsafe. Takes effect at once: the gait, and every trial of the subject with the same
//! motion, is neither recommended nor compared nor walked until staff have cleared the gait.

use super::answer_giver::AnswerGiver;
use super::preference_answer::attribution;
use super::walkable::NotWalkable;
use crate::access::Caller;
use crate::error::Error;
use gaitwright_store::feedback::Attribution;
use gaitwright_store::trials::{Trial, TrialState};
use gaitwright_store::{SafetyReportId, StoreResult, TrialId, Writer, audit, consents, events, safety_reports, trials};
use serde::Deserialize;
use serde_json::json;
use utoipa::ToSchema;

/// A report that a gait is unsafe.
#[derive(Debug, Clone, Default, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
#[schema(as = NewSafetyReport)]
pub struct NewSafetyReport {
    /// Source of the report: `subject`, `clinician` or `script`. By default `script` for a token, `subject` for a rater, and
    /// `clinician` for any other user.
    #[serde(default)]
    pub source: Option<AnswerGiver>,
    /// Name or pseudonym of the author. Defaults to the caller's name.
    #[serde(default)]
    #[schema(min_length = 1, max_length = 80)]
    pub author: Option<String>,
    /// Description of the event, at most 2000 characters.
    #[serde(default)]
    #[schema(max_length = 2000)]
    pub note: String,
}

/// Records a report about the gait of a trial.
///
/// # Errors
/// [`Error::NotFound`], [`Error::Invalid`] naming the field, [`Error::Conflict`] if the trial has no converged gait or
/// the subject withdrew consent.
pub async fn give(
    writer: &mut Writer,
    caller: &Caller,
    id: TrialId,
    report: &NewSafetyReport,
) -> Result<SafetyReportId, Error> {
    let trial = trials::get(writer, id).await?;
    consents::may_be_shown(writer, trial.study_id).await?;
    if trial.state != TrialState::Converged {
        return Err(NotWalkable::NotConverged { number: trial.number, state: trial.state }.into());
    }
    let attribution = attribution(caller, report.source, report.author.as_deref(), &report.note)?;
    Ok(write(writer, caller, &trial, attribution).await?)
}

/// Records a report that cannot be the answer to the comparison in which it was given, because there is one already. No
/// state of a comparison refuses a safety report.
///
/// # Errors
/// Errors of the database.
pub(super) async fn after_an_answer(
    writer: &mut Writer,
    caller: &Caller,
    gaits: &[TrialId],
    attribution: Attribution<'_>,
) -> Result<(), Error> {
    for gait in gaits {
        let trial = trials::get(writer, *gait).await?;
        write(writer, caller, &trial, attribution).await?;
    }
    Ok(())
}

async fn write(
    writer: &mut Writer,
    caller: &Caller,
    trial: &Trial,
    attribution: Attribution<'_>,
) -> StoreResult<SafetyReportId> {
    let made = safety_reports::insert(writer, trial.id, attribution).await?;
    let payload = json!({ "trial_id": trial.id, "number": trial.number });
    events::append(writer, trial.study_id, "reported_unsafe", &payload).await?;
    let detail = json!({ "study": trial.study_id, "author": attribution.author });
    audit::append(writer, &caller.actor, "gait.report_unsafe", &format!("trial {}", trial.id), &detail).await?;
    Ok(made)
}
