//! Records the result of a trial exactly once: state, label, gait and the preferences that Gait RMSE implies, in one
//! transaction.

use super::execution;
use super::feedback_log::{self, PROGRAM};
use super::gait_rmse_answers::{ComputedAnswer, gait_rmse_answers};
use super::local_optimum_jump;
use super::requeued_trial::{broke, interrupted, tell};
use super::simulated_walks::{label_of_gait, report_of_each_gait, why_not_executable};
use super::snapshot::StudySnapshot;
use super::trial_transitions;
use crate::error::Error;
use gait_optimizer::execution::ExecutionReport;
use gait_optimizer::{SolveOutcome, SolveStatus};
use gaitwright_store::audit::Actor;
use gaitwright_store::gaits::PackedGait;
use gaitwright_store::other_local_optima::{self, PackedLocalOptimum};
use gaitwright_store::solve_jobs::Lease;
use gaitwright_store::studies::SimulatedWalksEffect;
use gaitwright_store::trials::{Label, TrialEnd, TrialState};
use gaitwright_store::{Store, TrialId, attempts, commit, gaits, solve_inputs, solve_jobs, studies, trials};
use std::time::Duration;

/// How often a result is compared again because the study received an answer in the meantime.
const MAX_ATTEMPTS: u32 = 20;
/// The pause after the first attempt; it grows by this much after each.
const FIRST_PAUSE: Duration = Duration::from_millis(10);

const EARLIER: &str = "The result is that of an earlier solve of the same problem.";

/// Values that a worker and the service computed for a trial.
#[derive(Debug)]
pub struct Computed<'a> {
    /// The outcome of the solve.
    pub outcome: &'a SolveOutcome,
    /// Its gait, or the last iterate.
    pub gait: Option<&'a PackedGait>,
    /// The other local optima of a converged cold start.
    pub other_local_optima: &'a [PackedLocalOptimum],
    /// The hash of the input of the solve; `None` if the record no longer has the input.
    pub input_sha256: Option<&'a str>,
    /// Whether the outcome is that of an earlier solve with the same input.
    pub is_earlier: bool,
    /// The execution report, if the result of the trial depends on it.
    pub report: Option<&'a ExecutionReport>,
}

/// Records a completed solve. Returns `false` if the lease had passed to another attempt: the result is then kept as
/// evidence, and not used.
///
/// # Errors
/// Errors of the database and the learner. Nothing is recorded then.
pub async fn ended(
    store: &mut Store,
    lease: &Lease,
    worker: &str,
    Computed { outcome, gait, other_local_optima, input_sha256, is_earlier, report }: Computed<'_>,
) -> Result<bool, Error> {
    let Some(solved) = trial_transitions::label_of(outcome.report.status) else {
        return match outcome.report.status {
            SolveStatus::Cancelled => interrupted(store, lease).await,
            _ => broke(store, lease, "The solve ran out of time.").await,
        };
    };
    let mean_strides = report.map(ExecutionReport::mean_strides);
    let mut end = TrialEnd {
        state: TrialState::from(solved),
        report: Some(outcome.report.clone()),
        mean_strides,
        violations: outcome.violations.clone(),
        message: String::new(),
    };
    for attempt in 0..MAX_ATTEMPTS {
        tokio::time::sleep(FIRST_PAUSE * attempt).await;
        let mut reader = store.read().await?;
        let study = studies::get(&mut reader, lease.study).await?;
        let snapshot = StudySnapshot::read(&mut reader, study).await?;
        drop(reader);
        let plan = &snapshot.study.plan;
        let effect = plan.simulated_walks.effect;
        let asked = report_of_each_gait(plan);
        if solved == Label::Converged && effect.is_part_of_result() && report.is_none() {
            return Err(Error::Internal("the result of a trial lacks its simulated walks".to_owned()));
        }
        let label =
            if solved == Label::Converged { label_of_gait(&plan.simulated_walks, mean_strides) } else { solved };
        end.state = TrialState::from(label);
        let fold = snapshot
            .trial(lease.trial)
            .and_then(|trial| local_optimum_jump::in_words(&snapshot, trial, &outcome.report));
        let message = match (label, mean_strides) {
            (Label::NotExecutable, Some(strides)) => why_not_executable(&plan.simulated_walks, strides),
            _ => fold.unwrap_or_else(|| message_of(outcome)),
        };
        end.message = if is_earlier { format!("{message} {EARLIER}").trim_start().to_owned() } else { message };
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
            for found in other_local_optima {
                other_local_optima::insert(&mut writer, lease.trial, found).await?;
            }
            if let Some(sha256) = input_sha256 {
                solve_inputs::put(&mut writer, sha256, lease.trial).await?;
            }
        }
        if let Some(report) = report {
            let trial = trials::get(&mut writer, lease.trial).await?;
            execution::write(&mut writer, &trial, asked, report.clone()).await?;
        } else if label == Label::Converged && effect == SimulatedWalksEffect::Report {
            execution::request(&mut writer, &Actor::program(), lease.trial, asked).await?;
        }
        feedback_log::compute(&mut writer, lease.study, (lease.trial, label), &answers, PROGRAM).await?;
        tell(&mut writer, lease, end.state).await?;
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
) -> Result<Vec<ComputedAnswer>, Error> {
    let rmse = end.report.as_ref().map(|report| report.gait_rmse_rad);
    let (TrialState::Converged, Some(rmse)) = (end.state, rmse) else { return Ok(Vec::new()) };
    let (snapshot, mean_strides) = (snapshot.clone(), end.mean_strides);
    store.compute(move |pool| gait_rmse_answers(pool, &snapshot, new, rmse, mean_strides)).await?
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
