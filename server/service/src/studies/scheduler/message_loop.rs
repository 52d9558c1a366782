//! The message loop: receives what workers report, and records starts, heartbeats and results.

use super::super::requeued_trial;
use super::super::trial_result;
use super::{HEARTBEATS_PER_LEASE, Scheduler};
use crate::error::Error;
use crate::supervise::Task;
use crate::workers::{AssignmentResult, Attempt, EngineMessage};
use gait_optimizer::SolveStatus;
use gaitwright_compute::OnPool;
use gaitwright_store::{TrialId, commit, events, gaits, now, solve_jobs, trials};
use serde_json::json;
use std::collections::HashMap;
use std::time::Instant;

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
                    let scheduler = self.clone();
                    self.0.tasks.spawn(async move {
                        match scheduler.ended(attempt, &worker, result).await {
                            Ok(()) => receipt.sign().await,
                            // Without a receipt the message comes again, or the lease expires.
                            Err(error) => tracing::error!(trial = %attempt.trial, %error, "cannot record a trial"),
                        }
                        scheduler.changed();
                    });
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

    /// Records the result of an attempt.
    pub(super) async fn ended(&self, attempt: Attempt, worker: &str, result: AssignmentResult) -> Result<(), Error> {
        self.0.running_solves.close(attempt.trial);
        let mut store = self.0.store.clone();
        let Some(lease) = self.lease_of(attempt).await? else { return Ok(()) };
        let (outcome, iterations) = match result {
            AssignmentResult::Ended { outcome, iterations } => (outcome, iterations),
            AssignmentResult::Broke(reason) => return requeued_trial::broke(&store, &lease, &reason).await.map(drop),
        };
        let pack = move |pool: &OnPool| {
            let packed = gaits::PackedGait::new(pool, &outcome, &iterations);
            (outcome, packed)
        };
        let (outcome, packed) = store.compute(pack).await?;
        let packed = packed?;
        if packed.is_none() && outcome.report.status == SolveStatus::Converged {
            let reason = "The solver returned a converged gait with numbers that are not finite.";
            return requeued_trial::broke(&store, &lease, reason).await.map(drop);
        }
        trial_result::ended(&mut store, &lease, worker, &outcome, packed.as_ref()).await.map(drop)
    }
}
