//! Queues a trial again whose solve failed, was interrupted or lost its worker, or gives it up.

use super::trial_transitions::{self, TrialEvent};
use crate::error::Error;
use gaitwright_store::solve_jobs::{self, FailureCounts, Lease};
use gaitwright_store::trials::{self, TrialEnd, TrialState};
use gaitwright_store::{Store, TrialId, Writer, commit, events};
use serde_json::json;

/// Records an engineering failure: the job is retried at most twice, then the trial is `failed`.
///
/// # Errors
/// Errors of the database.
pub(super) async fn broke(store: &Store, lease: &Lease, reason: &str) -> Result<bool, Error> {
    tracing::warn!(trial = %lease.trial, attempt = lease.attempt, reason, "a solve failed");
    let mut writer = store.write().await?;
    let before = solve_jobs::failure_counts(&mut writer, lease.job).await?;
    let after = FailureCounts { failures: before.failures + 1, ..before };
    let recorded = give_up_or_requeue(&mut writer, lease, TrialEvent::Broke(before), after, reason).await?;
    commit(writer).await?;
    Ok(recorded)
}

/// Records an expired lease.
///
/// # Errors
/// Errors of the database.
pub(super) async fn record_expired_lease(store: &Store, lease: &Lease) -> Result<bool, Error> {
    let mut writer = store.write().await?;
    let before = solve_jobs::failure_counts(&mut writer, lease.job).await?;
    let after = FailureCounts { losses: before.losses + 1, ..before };
    let reason = "The worker's lease expired.";
    let recorded = give_up_or_requeue(&mut writer, lease, TrialEvent::Silent(before), after, reason).await?;
    commit(writer).await?;
    Ok(recorded)
}

/// Queues an interrupted trial again, without counting it as a failure.
///
/// # Errors
/// Errors of the database.
pub(super) async fn interrupted(store: &Store, lease: &Lease) -> Result<bool, Error> {
    let mut writer = store.write().await?;
    let same = solve_jobs::failure_counts(&mut writer, lease.job).await?;
    let recorded = give_up_or_requeue(&mut writer, lease, TrialEvent::Interrupted, same, "").await?;
    commit(writer).await?;
    Ok(recorded)
}

/// Queues a trial without a result again.
///
/// # Errors
/// [`Error::Conflict`] if the trial is open or has a result; errors of the database.
pub(super) async fn retried(writer: &mut Writer, trial: TrialId) -> Result<(), Error> {
    let row = trials::get(writer, trial).await?;
    trial_transitions::after(row.state, TrialEvent::Retried).map_err(|e| Error::conflict(e.to_string()))?;
    if row.script.is_some() {
        return Err(Error::conflict(
            "A script evaluates this trial, so it cannot be queued again. The script must ask for another trial.",
        ));
    }
    solve_jobs::reopen(writer, trial).await?;
    trials::requeue(writer, trial, "").await?;
    let payload = json!({ "trial_id": trial, "number": row.number, "state": TrialState::Queued });
    Ok(events::append(writer, row.study_id, "trial_queued", &payload).await?)
}

async fn give_up_or_requeue(
    writer: &mut Writer,
    lease: &Lease,
    event: TrialEvent,
    after: FailureCounts,
    reason: &str,
) -> Result<bool, Error> {
    if !solve_jobs::finish(writer, lease).await? {
        return Ok(false);
    }
    let state = trial_transitions::after(TrialState::Running, event).map_err(|e| Error::Internal(e.to_string()))?;
    if state == TrialState::Queued {
        solve_jobs::requeue(writer, lease.job, after).await?;
        trials::requeue(writer, lease.trial, reason).await?;
    } else {
        let end =
            TrialEnd { state, report: None, mean_strides: None, violations: Vec::new(), message: reason.to_owned() };
        trials::finish(writer, lease.trial, &end).await?;
    }
    tell(writer, lease, state).await?;
    Ok(true)
}

/// Writes the event of a trial that ended or was queued again.
pub(super) async fn tell(writer: &mut Writer, lease: &Lease, state: TrialState) -> Result<(), Error> {
    let trial = trials::get(writer, lease.trial).await?;
    let kind = if state == TrialState::Queued { "trial_queued" } else { "trial_ended" };
    let payload = json!({ "trial_id": lease.trial, "number": trial.number, "state": state });
    Ok(events::append(writer, lease.study, kind, &payload).await?)
}
