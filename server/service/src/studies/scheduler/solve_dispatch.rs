//! Dispatch of solve jobs: leases a queued job and submits its solve to the engine.

use super::super::problem_file::{PackedInput, SolveInput};
use super::super::requeued_trial;
use super::Scheduler;
use super::earlier_solves::EARLIER;
use super::prefetched_solves::{PREPARED, Prepared};
use crate::dispatch_error::DispatchError;
use crate::error::Error;
use crate::workers::{Assignment, Attempt, Receipt};
use gaitwright_store::solve_jobs::{self, Lease};
use gaitwright_store::{Store, TrialId, commit, now, trials};

impl Scheduler {
    /// Dispatches jobs while the engine has free workers.
    pub(super) async fn dispatch(&self) -> Result<(), Error> {
        while let Some(lease) = self.lease().await? {
            self.submit(&lease).await?;
        }
        Ok(())
    }

    pub(super) async fn lease(&self) -> Result<Option<Lease>, Error> {
        let engine = &self.0.engine;
        // This runs on every change, so it must not occupy the only writer.
        let (queued, leased) = solve_jobs::depth(&mut *self.0.store.read().await?).await?;
        if queued == 0 || leased as usize >= engine.size() || engine.problem().is_some() {
            return Ok(None);
        }
        let mut writer = self.0.store.write().await?;
        let until = now().after(engine.lease());
        let Some(lease) = solve_jobs::lease(&mut writer, engine.name(), until, self.0.only, engine.size()).await?
        else {
            return Ok(None);
        };
        commit(writer).await?;
        Ok(Some(lease))
    }

    pub(super) async fn submit(&self, lease: &Lease) -> Result<(), Error> {
        let assignment = match assignment(&mut self.0.unpacking.clone(), lease).await {
            Ok(assignment) => assignment,
            Err(error) => {
                requeued_trial::broke(&self.0.store, lease, &error.to_string()).await?;
                return Ok(());
            }
        };
        let attempt = assignment.attempt;
        if let Some(earlier) = self.earlier_solve(&assignment).await?
            && let Some(result) = self.result_of(earlier).await?
        {
            self.started(attempt, EARLIER).await?;
            self.record_in_background(attempt, EARLIER.to_owned(), result, Receipt::not_needed());
            return Ok(());
        }
        let hand_over = self.0.hand_over.lock().await;
        match self.0.prefetches.claim(&assignment) {
            Prepared::Nothing => {}
            Prepared::Running => return self.started(attempt, PREPARED).await,
            Prepared::Done(result) => {
                drop(hand_over);
                self.started(attempt, PREPARED).await?;
                self.record_in_background(attempt, PREPARED.to_owned(), result, Receipt::not_needed());
                return Ok(());
            }
        }
        if self.busy().await? > self.0.engine.size() {
            self.cancel_solves(self.0.prefetches.forget_running()).await;
        }
        if let Err(error) = self.0.engine.submit(assignment).await {
            // An expired lease is dispatched again.
            tracing::error!(trial = %lease.trial, %error, "the engine refused a job");
            if matches!(error, DispatchError::Unreachable(_)) {
                self.lease_until(lease, now()).await?;
            }
        }
        Ok(())
    }

    /// Number of dispatched solves, prefetches included.
    pub(super) async fn busy(&self) -> Result<usize, Error> {
        let (_, leased) = solve_jobs::depth(&mut *self.0.store.read().await?).await?;
        Ok(leased as usize + self.0.prefetches.running())
    }

    pub(super) async fn cancel_solves(&self, names: Vec<TrialId>) {
        for name in names {
            self.0.engine.cancel(name).await;
        }
    }
}

/// The solve of a leased job.
async fn assignment(store: &mut Store, lease: &Lease) -> Result<Assignment, Error> {
    let mut reader = store.read().await?;
    let number = trials::get(&mut reader, lease.trial).await?.number;
    let input = PackedInput::of_trial(&mut reader, lease.trial).await?;
    drop(reader);
    let input = store.compute(move |pool| input.unpack(pool)).await??;
    Ok(assigned(Attempt { trial: lease.trial, number: lease.attempt }, number, input))
}

pub(super) fn assigned(attempt: Attempt, number: u32, input: SolveInput) -> Assignment {
    let SolveInput { problem, options, warm_start } = input;
    Assignment { attempt, number, problem, warm_start, options }
}
