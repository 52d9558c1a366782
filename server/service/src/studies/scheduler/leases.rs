//! Leases of jobs: renewed while a worker reports, taken back when a worker is silent or a process was killed.

use super::super::requeued_trial;
use super::Scheduler;
use crate::error::Error;
use crate::workers::{Attempt, IN_PROCESS};
use gaitwright_store::solve_jobs::{self, Lease};
use gaitwright_store::trials::{self, TrialState};
use gaitwright_store::{StoreError, commit, now};

impl Scheduler {
    /// Queues the jobs of a killed process again, without counting them as failures.
    pub(super) async fn take_back_leases(&self) -> Result<(), Error> {
        let engine = self.0.engine.outlives_process().then_some(IN_PROCESS);
        let mut reader = self.0.store.read().await?;
        let left = solve_jobs::leased(&mut reader, engine).await?;
        drop(reader);
        for lease in left {
            self.give_back(&lease).await?;
        }
        Ok(())
    }

    pub(super) async fn handle_expired_leases(&self) -> Result<(), Error> {
        let mut reader = self.0.store.read().await?;
        let expired = solve_jobs::expired(&mut reader, now()).await?;
        let unstarted = solve_jobs::unstarted_of_inactive_studies(&mut reader).await?;
        drop(reader);
        for lease in expired {
            self.handle_expired(&lease).await?;
        }
        for lease in unstarted {
            self.give_back(&lease).await?;
        }
        Ok(())
    }

    /// Dispatches the jobs again that no worker has started, if the engine has another storage than the known one. A
    /// worker that has started a job does not need the storage.
    pub(super) async fn replace_lost_jobs(&self, known: &mut u64) -> Result<(), Error> {
        let storages = self.0.engine.storages();
        if storages == *known || self.0.engine.problem().is_some() {
            return Ok(());
        }
        *known = storages;
        self.cancel_solves(self.0.prefetches.forget_running()).await;
        let leased = solve_jobs::leased(&mut *self.0.store.read().await?, Some(self.0.engine.name())).await?;
        for lease in leased {
            self.replace_unstarted(&lease).await?;
        }
        Ok(())
    }

    /// Takes a job back from the engine, without counting a failure.
    pub(super) async fn give_back(&self, lease: &Lease) -> Result<(), Error> {
        self.cancel_solve(lease.trial).await;
        requeued_trial::interrupted(&self.0.store, lease).await.map(drop)
    }

    /// Handles an expired lease. A job that no worker has started is dispatched again, in case the engine lost it. A
    /// job of a silent worker is taken from it.
    pub(super) async fn handle_expired(&self, lease: &Lease) -> Result<(), Error> {
        if !self.replace_unstarted(lease).await? {
            self.cancel_solve(lease.trial).await;
            requeued_trial::record_expired_lease(&self.0.store, lease).await?;
        }
        Ok(())
    }

    /// Dispatches a job again if no worker has started it. Returns whether that is so.
    pub(super) async fn replace_unstarted(&self, lease: &Lease) -> Result<bool, Error> {
        let state = trials::get(&mut *self.0.store.read().await?, lease.trial).await?.state;
        if state != TrialState::Queued {
            return Ok(false);
        }
        if self.0.engine.problem().is_none() {
            self.renew(lease).await?;
            self.submit(lease).await?;
        }
        Ok(true)
    }

    /// The lease of an attempt. `None` if the record has no such trial, as after a dropped prefetch.
    pub(super) async fn lease_of(&self, attempt: Attempt) -> Result<Option<Lease>, Error> {
        match solve_jobs::lease_of(&mut *self.0.store.read().await?, attempt.trial, attempt.number).await {
            Err(StoreError::Missing { .. }) => {
                tracing::debug!(trial = %attempt.trial, "ignoring a message about a dropped prefetch");
                Ok(None)
            }
            found => Ok(Some(found?)),
        }
    }

    /// Renews a lease. Returns `false` if it has passed to another attempt.
    pub(super) async fn renew(&self, lease: &Lease) -> Result<bool, Error> {
        self.lease_until(lease, now().after(self.0.engine.lease())).await
    }

    /// Sets the end of a lease. Returns `false` if it has passed to another attempt.
    pub(super) async fn lease_until(&self, lease: &Lease, until: gaitwright_store::Instant) -> Result<bool, Error> {
        let mut writer = self.0.store.write().await?;
        let ours = solve_jobs::heartbeat(&mut writer, lease, until).await?;
        commit(writer).await?;
        Ok(ours)
    }
}
