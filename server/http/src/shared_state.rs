//! The state that all handlers share.

use super::access_log_buffer::AccessLog;
use super::host_header::Hosts;
use super::request_counts::Requests;
use super::trusted_proxies::Proxies;
use gaitwright_compute::{ComputeError, OnPool};
use gaitwright_service::access::Clock;
use gaitwright_service::access::secret::PasswordCheckQueues;
use gaitwright_service::access::session::SessionLimits;
use gaitwright_service::backups::Backups;
use gaitwright_service::error::Error;
use gaitwright_service::studies::analysis::Analyses;
use gaitwright_service::studies::job_status::Runners;
use gaitwright_service::studies::scheduler::Scheduler;
use gaitwright_store::{BorrowedWriter, Instant, Reader, Store, StoreResult, access_clock};
use std::sync::Arc;
use std::time::Duration;

/// Default lifetime of a session: a working day.
const DEFAULT_LIFETIME_SECONDS: f64 = 12.0 * 3600.0;

/// The state that all handlers share.
#[derive(Debug, Clone)]
pub struct AppState {
    /// Runs the studies.
    pub scheduler: Scheduler,
    /// Sign-in and sessions.
    pub access: Arc<AccessState>,
    /// Counts of requests.
    pub requests: Arc<Requests>,
    /// Cached posteriors of studies.
    pub analyses: Arc<Analyses>,
    /// The host names of the service.
    pub hosts: Hosts,
    /// The trusted reverse proxies.
    pub proxies: Proxies,
    /// Time limit of a response. Streams have started by then.
    pub slowest_answer: Duration,
    /// Backups on request.
    pub backups: Arc<Backups>,
    /// The record, with the thread pool for requests.
    store: Store,
}

/// Default time limit of a response.
const MAX_ANSWER_TIME: Duration = Duration::from_mins(1);

/// Sign-in and sessions.
#[derive(Debug)]
pub struct AccessState {
    /// Whether sign-in is off, which gives every caller all rights.
    pub open: bool,
    /// When sessions expire.
    pub limits: SessionLimits,
    /// Rows of the access log that are not written yet.
    pub log: AccessLog,
    /// Whether browsers use TLS.
    pub secure: bool,
    /// The clock of expiry.
    pub clock: Clock,
    /// Queues of password checks.
    pub password_checks: PasswordCheckQueues,
}

impl AccessState {
    /// Requires sign-in. Sessions expire after this idle time.
    pub fn by_sign_in(idle_seconds: f64) -> Self {
        let limits = SessionLimits { idle_seconds, lifetime_seconds: DEFAULT_LIFETIME_SECONDS };
        Self {
            open: false,
            limits,
            log: AccessLog::default(),
            secure: false,
            clock: Clock::default(),
            password_checks: PasswordCheckQueues::default(),
        }
    }

    /// Requires no sign-in, for one person on one machine.
    pub fn without_sign_in() -> Self {
        Self { open: true, ..Self::by_sign_in(3600.0) }
    }
}

impl AppState {
    /// Creates the state of a service.
    pub fn new(scheduler: Scheduler, access: Arc<AccessState>, backups: Arc<Backups>, hosts: Hosts) -> Self {
        let analyses = Arc::clone(scheduler.analyses());
        let store = scheduler.store().with_own_pool();
        let (requests, proxies) = (Arc::default(), Proxies::default());
        Self { scheduler, access, requests, analyses, hosts, proxies, slowest_answer: MAX_ANSWER_TIME, backups, store }
    }

    /// The runners of jobs.
    pub fn runners(&self) -> Runners<'_> {
        Runners { scheduler: &self.scheduler, backups: &self.backups }
    }

    /// The record.
    pub fn store(&self) -> &Store {
        &self.store
    }

    /// The record for computing, during which no connection can be held.
    pub fn store_mut(&mut self) -> &mut Store {
        &mut self.store
    }

    /// A connection to read with.
    ///
    /// # Errors
    /// If no connection is available.
    pub async fn read(&self) -> StoreResult<Reader<'_>> {
        self.store.read().await
    }

    /// A write transaction.
    ///
    /// # Errors
    /// If no transaction can be started.
    pub async fn write(&self) -> StoreResult<BorrowedWriter<'_>> {
        self.store.write().await
    }

    /// Computes on the thread pool, while no connection is held.
    ///
    /// # Errors
    /// If the work panics.
    pub async fn compute<T: Send + 'static>(
        &mut self,
        work: impl FnOnce(&OnPool) -> T + Send + 'static,
    ) -> Result<T, ComputeError> {
        self.store.compute(work).await
    }

    /// A write transaction for decisions about access, and the time of the decision, which is recorded.
    ///
    /// # Errors
    /// If no transaction can be started.
    pub async fn write_access(&self) -> Result<(BorrowedWriter<'_>, Instant), Error> {
        let mut writer = self.write().await?;
        let now = self.access.clock.now(&mut writer).await?;
        access_clock::reach(&mut writer, now).await?;
        Ok((writer, now))
    }
}
