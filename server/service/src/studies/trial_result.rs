//! Records the result of a trial exactly once: state, label, gait and the preferences that Gait RMSE implies, in one
//! transaction.

use super::feedback_log::{self, PROGRAM};
use super::gait_rmse_answers::gait_rmse_answers;
use super::local_optimum_jump;
use super::snapshot::StudySnapshot;
use super::trial_transitions::{self, TrialEvent};
use crate::error::Error;
use gait_optimizer::{SolveOutcome, SolveStatus};
use gaitwright_store::feedback::FeedbackContent;
use gaitwright_store::gaits::PackedGait;
use gaitwright_store::solve_jobs::{FailureCounts, Lease};
use gaitwright_store::trials::{TrialEnd, TrialState};
use gaitwright_store::{Store, TrialId, Writer, attempts, commit, events, gaits, solve_jobs, studies, trials};
use serde_json::json;
use std::time::Duration;

/// How often a result is compared again because the study received an answer in the meantime.
const TRIES: u32 = 20;
/// The pause after the first attempt; it grows by this much after each.
const FIRST_PAUSE: Duration = Duration::from_millis(10);

/// Records a completed solve. Returns `false` if the lease had passed to another attempt: the result is then kept as
/// evidence, and not used.
///
/// # Errors
/// Errors of the database and the learner. Nothing is recorded then.
pub async fn ended(
    store: &mut Store,
    lease: &Lease,
    worker: &str,
    outcome: &SolveOutcome,
    gait: Option<&PackedGait>,
) -> Result<bool, Error> {
    let Some(label) = trial_transitions::label_of(outcome.report.status) else {
        return match outcome.report.status {
            SolveStatus::Cancelled => interrupted(store, lease).await,
            _ => broke(store, lease, "The solve ran out of time.").await,
        };
    };
    let state = TrialState::from(label);
    let mut end = TrialEnd {
        state,
        report: Some(outcome.report.clone()),
        violations: outcome.violations.clone(),
        message: message_of(outcome),
    };
    for attempt in 0..TRIES {
        tokio::time::sleep(FIRST_PAUSE * attempt).await;
        let mut reader = store.read().await?;
        let study = studies::get(&mut reader, lease.study).await?;
        let snapshot = StudySnapshot::read(&mut reader, study).await?;
        drop(reader);
        if let Some(fold) = snapshot
            .trial(lease.trial)
            .and_then(|trial| local_optimum_jump::in_words(&snapshot, trial, &outcome.report))
        {
            end.message = fold;
        }
        let answers = answers(store, &snapshot, lease.trial, &end).await?;

        let mut writer = store.write().await?;
        if !snapshot.is_current(&mut writer).await? {
            continue;
        }
        let used = solve_jobs::finish(&mut writer, lease).await?;
        attempts::insert(&mut writer, (lease.trial, lease.attempt), worker, &outcome.report, used).await?;
        if !used {
            commit(writer).await?;
            return Ok(false);
        }
        trials::start(&mut writer, lease.trial).await?;
        trials::finish(&mut writer, lease.trial, &end).await?;
        if let Some(gait) = gait {
            gaits::insert(&mut writer, lease.trial, gait).await?;
        }
        feedback_log::compute(&mut writer, lease.study, (lease.trial, label), &answers, PROGRAM).await?;
        tell(&mut writer, lease, state).await?;
        commit(writer).await?;
        return Ok(true);
    }
    // The worker is free already, so the trial is solved again, at most twice.
    broke(store, lease, "New answers kept arriving before the result could be recorded.").await
}

/// Records an engineering failure: the job is retried at most twice, then the trial is `failed`.
///
/// # Errors
/// Errors of the database.
pub async fn broke(store: &Store, lease: &Lease, reason: &str) -> Result<bool, Error> {
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
pub async fn record_expired_lease(store: &Store, lease: &Lease) -> Result<bool, Error> {
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
pub async fn interrupted(store: &Store, lease: &Lease) -> Result<bool, Error> {
    let mut writer = store.write().await?;
    let same = solve_jobs::failure_counts(&mut writer, lease.job).await?;
    let recorded = give_up_or_requeue(&mut writer, lease, TrialEvent::Interrupted, same, "").await?;
    commit(writer).await?;
    Ok(recorded)
}

/// Cancels an open trial at a person's request.
///
/// # Errors
/// [`Error::Conflict`] if the trial has ended; errors of the database.
pub async fn cancelled(writer: &mut Writer, trial: TrialId, reason: &str) -> Result<(), Error> {
    let row = trials::get(writer, trial).await?;
    let state =
        trial_transitions::after(row.state, TrialEvent::Cancelled).map_err(|e| Error::conflict(e.to_string()))?;
    solve_jobs::cancel(writer, trial).await?;
    let end = TrialEnd { state, report: None, violations: Vec::new(), message: reason.to_owned() };
    trials::finish(writer, trial, &end).await?;
    let payload = json!({ "trial_id": trial, "number": row.number, "state": state });
    Ok(events::append(writer, row.study_id, "trial_ended", &payload).await?)
}

/// Queues a trial without a result again.
///
/// # Errors
/// [`Error::Conflict`] if the trial is open or has a result; errors of the database.
pub async fn retried(writer: &mut Writer, trial: TrialId) -> Result<(), Error> {
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
        let end = TrialEnd { state, report: None, violations: Vec::new(), message: reason.to_owned() };
        trials::finish(writer, lease.trial, &end).await?;
    }
    tell(writer, lease, state).await?;
    Ok(true)
}

/// The preferences about the new trial that Gait RMSE implies; none if people answer.
async fn answers(
    store: &mut Store,
    snapshot: &StudySnapshot,
    new: TrialId,
    end: &TrialEnd,
) -> Result<Vec<FeedbackContent>, Error> {
    let rmse = end.report.as_ref().map(|report| report.gait_rmse_rad);
    let (TrialState::Converged, Some(rmse)) = (end.state, rmse) else { return Ok(Vec::new()) };
    let snapshot = snapshot.clone();
    store.compute(move |pool| gait_rmse_answers(pool, &snapshot, new, rmse)).await?
}

async fn tell(writer: &mut Writer, lease: &Lease, state: TrialState) -> Result<(), Error> {
    let trial = trials::get(writer, lease.trial).await?;
    let kind = if state == TrialState::Queued { "trial_queued" } else { "trial_ended" };
    let payload = json!({ "trial_id": lease.trial, "number": trial.number, "state": state });
    Ok(events::append(writer, lease.study, kind, &payload).await?)
}

fn message_of(outcome: &SolveOutcome) -> String {
    let worst = outcome.violations.first();
    let cause = match outcome.report.status {
        SolveStatus::Converged => return String::new(),
        SolveStatus::Infeasible => "No gait near the last motion tried satisfies all constraints.",
        SolveStatus::Stalled => "The optimiser stalled.",
        SolveStatus::IterationLimit => "The optimiser reached the iteration limit.",
        SolveStatus::TimeLimit => "The optimiser reached the time limit.",
        SolveStatus::Cancelled => "The solve was cancelled.",
    };
    match worst {
        Some(row) => format!("{cause} Largest violation: {}, by {}.", row.row, row.amount_in_words()),
        None => cause.to_owned(),
    }
}
