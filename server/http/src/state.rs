//! What every handler can reach.

use super::access_log::AccessLog;
use super::forwarded::Proxies;
use super::host::Hosts;
use super::metrics::Requests;
use gaitwright_compute::{ComputeError, OnPool};
use gaitwright_service::access::Clock;
use gaitwright_service::access::secret::Turns;
use gaitwright_service::access::sign_in::Limits;
use gaitwright_service::error::Error;
use gaitwright_service::studies::belief::Beliefs;
use gaitwright_service::studies::scheduler::Scheduler;
use gaitwright_store::{Instant, LentWriter, Reader, Store, StoreResult, clock};
use std::sync::Arc;
use std::time::Duration;

/// A session ends after a day's work.
const DEFAULT_LIFETIME_SECONDS: f64 = 12.0 * 3600.0;

/// What every handler can reach.
#[derive(Debug, Clone)]
pub struct AppState {
    /// Runs the studies.
    pub scheduler: Scheduler,
    /// How people and programs say who they are.
    pub access: Arc<Access>,
    /// What was asked of the service so far.
    pub requests: Arc<Requests>,
    /// What the learner believes of the studies that were looked at.
    pub beliefs: Arc<Beliefs>,
    /// The names that the service answers to.
    pub hosts: Hosts,
    /// The reverse proxies that are believed.
    pub proxies: Proxies,
    /// An answer that takes longer is given up; streams have begun by then.
    pub slowest_answer: Duration,
    /// The record, with the pool for what requests compute.
    store: Store,
}

/// An answer that takes longer is given up.
const SLOWEST_ANSWER: Duration = Duration::from_mins(1);

/// How people and programs say who they are.
#[derive(Debug)]
pub struct Access {
    /// Nobody needs to sign in, and whoever is there may do everything.
    pub open: bool,
    /// When sessions end by themselves.
    pub limits: Limits,
    /// Who saw what, before it is written.
    pub log: AccessLog,
    /// Browsers reach the service through TLS.
    pub secure: bool,
    /// Says when something has ended.
    pub clock: Clock,
    /// Passwords that are compared.
    pub turns: Turns,
}

impl Access {
    /// Everybody signs in; a session without a sign of life for so long has ended.
    pub fn by_sign_in(idle_seconds: f64) -> Self {
        let limits = Limits { idle_seconds, lifetime_seconds: DEFAULT_LIFETIME_SECONDS };
        Self {
            open: false,
            limits,
            log: AccessLog::default(),
            secure: false,
            clock: Clock::default(),
            turns: Turns::default(),
        }
    }

    /// Nobody signs in: for one person on one machine.
    pub fn without_sign_in() -> Self {
        Self { open: true, ..Self::by_sign_in(3600.0) }
    }
}

impl AppState {
    /// A service over a scheduler.
    pub fn new(scheduler: Scheduler, access: Arc<Access>, hosts: Hosts) -> Self {
        let beliefs = Arc::clone(scheduler.beliefs());
        let store = scheduler.store().with_own_pool();
        let (requests, proxies) = (Arc::default(), Proxies::default());
        Self { scheduler, access, requests, beliefs, hosts, proxies, slowest_answer: SLOWEST_ANSWER, store }
    }

    /// The record.
    pub fn store(&self) -> &Store {
        &self.store
    }

    /// The record, to be computed with as well: no connection of it is held meanwhile.
    pub fn store_mut(&mut self) -> &mut Store {
        &mut self.store
    }

    /// A connection to read with.
    ///
    /// # Errors
    /// When none can be had.
    pub async fn read(&self) -> StoreResult<Reader<'_>> {
        self.store.read().await
    }

    /// A write transaction.
    ///
    /// # Errors
    /// When none can be begun.
    pub async fn write(&self) -> StoreResult<LentWriter<'_>> {
        self.store.write().await
    }

    /// Computes off the threads that answer, while no connection is held.
    ///
    /// # Errors
    /// When the work panics.
    pub async fn compute<T: Send + 'static>(
        &mut self,
        work: impl FnOnce(&OnPool) -> T + Send + 'static,
    ) -> Result<T, ComputeError> {
        self.store.compute(work).await
    }

    /// A write transaction that decides about access, and the instant that it decides at, which the record keeps.
    ///
    /// # Errors
    /// When none can be begun.
    pub async fn write_access(&self) -> Result<(LentWriter<'_>, Instant), Error> {
        let mut writer = self.write().await?;
        let now = self.access.clock.now(&mut writer).await?;
        clock::reach(&mut writer, now).await?;
        Ok((writer, now))
    }
}
