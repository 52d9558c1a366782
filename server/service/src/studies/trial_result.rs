//! Records the result of a trial exactly once: state, label, gait and the preferences that Gait RMSE implies, in one
//! transaction.

use super::feedback_log::{self, PROGRAM};
use super::gait_rmse_answers::gait_rmse_answers;
use super::local_optimum_jump;
use super::requeued_trial::{broke, interrupted, tell};
use super::snapshot::StudySnapshot;
use super::trial_transitions;
use crate::error::Error;
use gait_optimizer::{SolveOutcome, SolveStatus};
use gaitwright_store::feedback::FeedbackContent;
use gaitwright_store::gaits::PackedGait;
use gaitwright_store::solve_jobs::Lease;
use gaitwright_store::trials::{TrialEnd, TrialState};
use gaitwright_store::{Store, TrialId, attempts, commit, gaits, solve_jobs, studies, trials};
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
