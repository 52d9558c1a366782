//! The message loop: receives what workers report, and records starts, heartbeats and results.

use super::super::execution::NewExecutionReport;
use super::super::requeued_trial;
use super::super::simulated_walks::report_of_each_gait;
use super::super::trial_jobs::run_cancellable;
use super::super::trial_result::{self, Computed};
use super::earlier_solves::EARLIER;
use super::{HEARTBEATS_PER_LEASE, Scheduler};
use crate::error::Error;
use crate::supervise::Task;
use crate::workers::{AssignmentResult, Attempt, EngineMessage, Receipt};
use gait_optimizer::execution::{ExecutionReport, simulate};
use gait_optimizer::{CancelToken, Gait, SolveStatus};
use gaitwright_compute::OnPool;
use gaitwright_compute::priority::SOLVER;
use gaitwright_store::other_local_optima::PackedLocalOptimum;
use gaitwright_store::solve_jobs::{self, Lease};
use gaitwright_store::studies::SimulatedWalksEffect;
use gaitwright_store::{TrialId, commit, events, gaits, now, studies, trials};
use serde_json::json;
use std::collections::HashMap;
use std::sync::atomic::AtomicU32;
use std::time::Instant;

/// Outcome of recording the result of an attempt.
enum Recorded {
    /// It is on record, or does not count.
    Done,
    /// The service stops, so the attempt has to be repeated.
    Stopped,
}

/// The end of the simulated walks on which the result of a trial depends.
enum Simulated {
    Report(Box<ExecutionReport>),
    Failed(String),
    /// The trial was cancelled, or has another attempt.
    LeaseLost,
    Stopped,
}

impl Scheduler {
    /// Receives the messages of workers.
    pub(super) async fn keep_listening(&self, task: &Task) -> Result<(), Error> {
        task.works();
        let mut written: HashMap<TrialId, Instant> = HashMap::new();
        loop {
            let message = match self.0.prefetches.receive(self.0.engine.next().await) {
                Ok(message) => message,
                Err(receipt) => {
                    receipt.sign().await;
                    self.0.wake.notify_one();
                    continue;
                }
            };
            let handled = match message {
                EngineMessage::Started { attempt, worker } => {
                    written.insert(attempt.trial, Instant::now());
                    self.started(attempt, &worker).await
                }
                EngineMessage::Iterated { attempt, record } => {
                    self.0.running_solves.add(attempt.trial, record);
                    let last = written.entry(attempt.trial).or_insert_with(Instant::now);
                    if last.elapsed() < self.0.engine.lease() / HEARTBEATS_PER_LEASE {
                        continue;
                    }
                    *last = Instant::now();
                    self.heartbeat(attempt).await
                }
                EngineMessage::Ended { attempt, worker, result, receipt } => {
                    written.remove(&attempt.trial);
                    self.record_in_background(attempt, worker, result, receipt);
                    Ok(())
                }
            };
            handled?;
        }
    }

    /// Records that a worker started a job.
    pub(super) async fn started(&self, attempt: Attempt, worker: &str) -> Result<(), Error> {
        let Some(lease) = self.lease_of(attempt).await? else { return Ok(()) };
        let mut writer = self.0.store.write().await?;
        if !solve_jobs::heartbeat(&mut writer, &lease, now().after(self.0.engine.lease())).await? {
            drop(writer);
            self.cancel_solve(attempt.trial).await;
            return Ok(());
        }
        trials::start(&mut writer, lease.trial).await?;
        let trial = trials::get(&mut writer, lease.trial).await?;
        let payload = json!({ "trial_id": trial.id, "number": trial.number, "state": trial.state, "worker": worker });
        events::append(&mut writer, lease.study, "trial_started", &payload).await?;
        commit(writer).await?;
        self.0.running_solves.open(trial.id, lease.study, trial.number);
        self.0.pulse.send_modify(|count| *count = count.wrapping_add(1));
        Ok(())
    }

    pub(super) async fn heartbeat(&self, attempt: Attempt) -> Result<(), Error> {
        let Some(lease) = self.lease_of(attempt).await? else { return Ok(()) };
        if !self.renew(&lease).await? {
            self.cancel_solve(attempt.trial).await;
        }
        Ok(())
    }

    /// Records the result of an attempt without delaying other messages.
    pub(super) fn record_in_background(
        &self,
        attempt: Attempt,
        worker: String,
        result: AssignmentResult,
        receipt: Receipt,
    ) {
        let scheduler = self.clone();
        self.0.tasks.spawn(async move {
            match scheduler.ended(attempt, &worker, result).await {
                Ok(Recorded::Done) => receipt.sign().await,
                // Without a receipt the message comes again, or the lease expires.
                Ok(Recorded::Stopped) => {}
                Err(error) => tracing::error!(trial = %attempt.trial, %error, "cannot record a trial"),
            }
            // Until then, the record does not have the iterations.
            scheduler.0.running_solves.close(attempt.trial);
            scheduler.changed();
        });
    }

    /// Records the result of an attempt. If the result depends on simulated walks, it waits for them.
    async fn ended(&self, attempt: Attempt, worker: &str, result: AssignmentResult) -> Result<Recorded, Error> {
        let mut store = self.0.store.clone();
        let Some(lease) = self.lease_of(attempt).await? else { return Ok(Recorded::Done) };
        let (outcome, iterations) = match result {
            AssignmentResult::Ended { outcome, iterations } => (outcome, iterations),
            AssignmentResult::Broke(reason) => return self.broke(&lease, &reason).await,
        };
        let pack = move |pool: &OnPool| {
            let gait = gaits::PackedGait::new(pool, &outcome, &iterations);
            let others = outcome.other_local_optima.iter().map(|found| PackedLocalOptimum::new(pool, found));
            let others: Result<Vec<_>, _> = others.collect();
            (outcome, gait, others)
        };
        let (outcome, packed, others) = store.compute(pack).await?;
        let (packed, others) = (packed?, others?);
        if packed.is_none() && outcome.report.status == SolveStatus::Converged {
            let reason = "The solver returned a converged gait with numbers that are not finite.";
            return self.broke(&lease, reason).await;
        }
        let plan = studies::get(&mut *self.0.store.read().await?, lease.study).await?.plan;
        let is_gait = outcome.report.status == SolveStatus::Converged;
        let effect = plan.simulated_walks.effect;
        let report = if is_gait && effect.is_part_of_result() {
            match self.simulate_for_result(&lease, outcome.gait.clone(), report_of_each_gait(&plan)).await? {
                Simulated::Report(report) => Some(report),
                Simulated::Failed(reason) => return self.broke(&lease, &reason).await,
                Simulated::LeaseLost => return Ok(Recorded::Done),
                Simulated::Stopped => return Ok(Recorded::Stopped),
            }
        } else {
            None
        };
        let input_sha256 = self.input_sha256(lease.trial).await?;
        let (gait, input_sha256) = (packed.as_ref(), input_sha256.as_deref());
        let (is_earlier, report) = (worker == EARLIER, report.as_deref());
        let computed =
            Computed { outcome: &outcome, gait, other_local_optima: &others, input_sha256, is_earlier, report };
        let used = trial_result::ended(&mut store, &lease, worker, computed).await?;
        if used && is_gait && effect == SimulatedWalksEffect::Report {
            self.simulate(lease.trial, Some(report_of_each_gait(&plan)));
        }
        Ok(Recorded::Done)
    }

    /// Records that the program failed.
    async fn broke(&self, lease: &Lease, reason: &str) -> Result<Recorded, Error> {
        requeued_trial::broke(&self.0.store, lease, reason).await.map(|_| Recorded::Done)
    }

    /// Simulates walks with a new gait, and renews the lease of its trial meanwhile.
    async fn simulate_for_result(
        &self,
        lease: &Lease,
        gait: Gait,
        asked: NewExecutionReport,
    ) -> Result<Simulated, Error> {
        let options = asked.options()?;
        let stopping = self.0.shutdown.clone();
        let work = move |cancel: &CancelToken| simulate(&gait, &options, &AtomicU32::new(0), cancel);
        let mut simulation = std::pin::pin!(run_cancellable(("walk simulator", SOLVER), &stopping, work));
        loop {
            tokio::select! {
                result = &mut simulation => return Ok(match result? {
                    Ok(Some(report)) => Simulated::Report(Box::new(report)),
                    Ok(None) => Simulated::Stopped,
                    Err(error) => Simulated::Failed(format!("Walks with the gait cannot be simulated: {error}")),
                }),
                () = tokio::time::sleep(self.0.engine.lease() / HEARTBEATS_PER_LEASE) => {
                    if !self.renew(lease).await? {
                        return Ok(Simulated::LeaseLost);
                    }
                }
            }
        }
    }
}
