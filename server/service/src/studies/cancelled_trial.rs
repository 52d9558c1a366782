//! Cancels trials: an open trial ends without a result.

use super::trial_transitions::{self, TrialEvent};
use crate::error::Error;
use gaitwright_store::audit::{self, Actor};
use gaitwright_store::trials::{Trial, TrialEnd};
use gaitwright_store::{TrialId, Writer, events, solve_jobs, trials};
use serde_json::json;

/// Cancels an open trial at a person's request.
///
/// # Errors
/// [`Error::NotFound`], or [`Error::Conflict`] if the trial has ended.
pub async fn cancel(writer: &mut Writer, actor: &Actor, id: TrialId, reason: &str) -> Result<Trial, Error> {
    end(writer, id, reason).await?;
    audit::append(writer, actor, "trial.cancel", &format!("trial {id}"), &json!({ "reason": reason })).await?;
    Ok(trials::get(writer, id).await?)
}

/// Ends an open trial as cancelled. The caller writes the audit trail.
///
/// # Errors
/// [`Error::Conflict`] if the trial has ended; errors of the database.
pub(super) async fn end(writer: &mut Writer, trial: TrialId, reason: &str) -> Result<(), Error> {
    let row = trials::get(writer, trial).await?;
    let state =
        trial_transitions::after(row.state, TrialEvent::Cancelled).map_err(|e| Error::conflict(e.to_string()))?;
    solve_jobs::cancel(writer, trial).await?;
    let end = TrialEnd { state, report: None, mean_strides: None, violations: Vec::new(), message: reason.to_owned() };
    trials::finish(writer, trial, &end).await?;
    let payload = json!({ "trial_id": trial, "number": row.number, "state": state });
    Ok(events::append(writer, row.study_id, "trial_ended", &payload).await?)
}
