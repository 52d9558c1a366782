//! Jobs of one kind for trials, of which one runs at a time, at lower priority than solves.
//!
//! Requested trials come first, then those of ended studies. Requests and cancellations are on record, so the jobs
//! continue after a crash.

use super::job_queue::{JobQueue, RequestOrder, RunningJob, TrialJobState};
use crate::error::Error;
use crate::job::JobState;
use gait_optimizer::CancelToken;
use gaitwright_compute::priority::run_with;
use gaitwright_store::{Store, StoreResult, StudyId, TrialId, consents, trials};
use std::collections::BTreeSet;
use std::fmt;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Instant;
use tokio::sync::{Notify, watch};
use tokio_util::sync::CancellationToken;

/// A kind of job: where its requests are on record, and what it does for one trial.
pub(super) trait TrialJob: Send + Sync {
    /// The name in the log.
    const NAME: &'static str;
    /// Which request is next.
    const ORDER: RequestOrder = RequestOrder::OldestRequest;
    /// Whether [`Self::requested`] is read with every change of the record. If not, it is read once, and
    /// [`TrialJobs::ask`] announces later requests.
    const READS_REQUESTS: bool = false;
    /// Whether [`Self::carry_out`] ends by itself soon after it was cancelled, and keeps what it has found.
    const KEEPS_PARTS: bool = false;
    /// The parameters of a request, without the trial.
    type Request: Clone + Send + Sync;

    /// The requests on record that were neither carried out nor cancelled since, oldest first.
    fn requested(&self) -> impl Future<Output = StoreResult<Vec<(TrialId, Self::Request)>>> + Send;

    /// The trials whose jobs were cancelled and not requested since.
    fn cancelled(&self) -> impl Future<Output = StoreResult<Vec<TrialId>>> + Send;

    /// Studies that have ended since the last call.
    fn ended(&self) -> impl Future<Output = StoreResult<Vec<StudyId>>> + Send {
        async { Ok(Vec::new()) }
    }

    /// The next trial of an ended study, outside `skipped`.
    fn next_of(
        &self,
        study: StudyId,
        skipped: BTreeSet<TrialId>,
    ) -> impl Future<Output = Result<Option<(TrialId, Self::Request)>, Error>> + Send {
        let _ = (study, skipped);
        async { Ok(None) }
    }

    /// Does the work for a trial and stores the result. Dropping the future stops the work.
    fn carry_out(
        &self,
        trial: TrialId,
        request: Self::Request,
        cancelled: CancellationToken,
    ) -> impl Future<Output = Result<(), Error>> + Send;

    /// Records that the work for a trial is impossible.
    fn record_failure(&self, trial: TrialId, reason: &str) -> impl Future<Output = Result<(), Error>> + Send {
        let _ = (trial, reason);
        async { Ok(()) }
    }
}

/// The jobs of one kind.
pub(super) struct TrialJobs<J: TrialJob> {
    store: Store,
    job: J,
    queue: Mutex<JobQueue<J::Request>>,
    wake: Notify,
}

impl<J: TrialJob> TrialJobs<J> {
    /// Creates the queue; [`Self::run`] starts the jobs.
    pub(super) fn new(store: Store, job: J) -> Self {
        Self { store, job, queue: Mutex::default(), wake: Notify::new() }
    }

    /// The work of the jobs.
    pub(super) fn job(&self) -> &J {
        &self.job
    }

    /// Queues the job of a trial, unless it is queued, is running or has failed.
    pub(super) fn ask(&self, trial: TrialId, request: J::Request) {
        self.queue().ask(trial, request);
        self.wake.notify_one();
    }

    /// Forgets that the job of a trial was cancelled or failed.
    pub(super) fn forget_end(&self, trial: TrialId) {
        self.queue().forget(trial);
        self.wake.notify_one();
    }

    /// Queues an ended study behind requested trials.
    pub(super) fn queue_ended(&self, study: StudyId) {
        self.queue().queue_ended([study]);
        self.wake.notify_one();
    }

    /// Whether an ended study is queued.
    pub(super) fn has(&self, study: StudyId) -> bool {
        self.queue().has(study)
    }

    /// The state of the job of a trial.
    pub(super) fn state(&self, trial: TrialId) -> TrialJobState<J::Request> {
        self.queue().state(trial)
    }

    /// The trials whose jobs are running or queued.
    pub(super) fn open(&self) -> Vec<(TrialId, JobState)> {
        self.queue().open()
    }

    /// Gives up the job of a trial until somebody asks for it again.
    pub(super) fn cancel(&self, trial: TrialId) {
        self.queue().cancel(trial);
    }

    /// Runs forever. `record_changed` changes with the record. Calls `changed` after every job, and `study_done` when an
    /// ended study has no trial left to work on.
    pub(super) async fn run(
        &self,
        mut record_changed: watch::Receiver<u64>,
        changed: impl Fn(),
        study_done: impl Fn(StudyId),
    ) {
        let mut first = true;
        // An earlier run may have ended within a job.
        self.queue().end();
        loop {
            record_changed.mark_unchanged();
            match self.run_next(&mut record_changed, &mut first, &study_done).await {
                Ok(true) => {
                    changed();
                    continue;
                }
                Ok(false) => {}
                Err(error) => tracing::error!(job = J::NAME, %error, "cannot run the next job"),
            }
            let retry = self.queue().next_retry();
            tokio::select! {
                _ = record_changed.changed() => {}
                () = self.wake.notified() => {}
                () = tokio::time::sleep_until(retry.unwrap_or_else(Instant::now).into()), if retry.is_some() => {}
            }
        }
    }

    /// Runs the next job. Returns `false` if there is none.
    async fn run_next(
        &self,
        record_changed: &mut watch::Receiver<u64>,
        first: &mut bool,
        study_done: &impl Fn(StudyId),
    ) -> Result<bool, Error> {
        self.read_record(*first).await?;
        *first = false;
        let Some(running) = self.next(study_done).await? else { return Ok(false) };
        let (trial, request) = (running.trial, running.request.clone());
        let Err(error) = self.carry_out(running, record_changed).await else {
            self.queue().end();
            return Ok(true);
        };
        if error.is_of_machine() {
            tracing::error!(job = J::NAME, %trial, %error, "a job failed; retrying in a minute");
            self.queue().postpone(trial, request);
        } else {
            tracing::warn!(job = J::NAME, %trial, %error, "a job failed");
            let reason = error.to_string();
            // On record before the job counts as failed, because whoever sees the failure looks for its event.
            let recorded = self.job.record_failure(trial, &reason).await;
            self.queue().fail(trial, reason);
            recorded?;
        }
        Ok(true)
    }

    /// Queues the requests on record and the studies that have ended.
    async fn read_record(&self, first: bool) -> StoreResult<()> {
        if first {
            let cancelled = self.job.cancelled().await?;
            self.queue().restore_cancelled(cancelled);
        }
        if first || J::READS_REQUESTS {
            let requested = self.job.requested().await?;
            self.queue().recall(requested);
        }
        let ended = self.job.ended().await?;
        self.queue().queue_ended(ended);
        Ok(())
    }

    /// The next job, which is running from now on. The newest study comes first, because somebody is likely to look at
    /// it soon.
    async fn next(&self, study_done: &impl Fn(StudyId)) -> Result<Option<RunningJob<J::Request>>, Error> {
        loop {
            let (study, skipped) = {
                let mut queue = self.queue();
                if let Some(running) = queue.begin_requested(J::ORDER, Instant::now()) {
                    return Ok(Some(running));
                }
                let Some(study) = queue.newest_study() else { return Ok(None) };
                (study, queue.skipped())
            };
            match self.job.next_of(study, skipped).await {
                Ok(Some((trial, request))) => {
                    // The job may have been cancelled meanwhile.
                    if let Some(running) = self.queue().begin(trial, request) {
                        return Ok(Some(running));
                    }
                    continue;
                }
                Ok(None) => {}
                Err(error) if error.is_of_machine() => return Err(error),
                Err(error) => tracing::error!(job = J::NAME, %study, %error, "cannot choose the next trial of a study"),
            }
            self.queue().remove_study(study);
            study_done(study);
        }
    }

    /// Carries out a job until it is done, it is cancelled or the subject withdraws consent.
    async fn carry_out(
        &self,
        running: RunningJob<J::Request>,
        record_changed: &mut watch::Receiver<u64>,
    ) -> Result<(), Error> {
        let RunningJob { trial, request, cancelled, .. } = running;
        let study = trials::get(&mut *self.store.read().await?, trial).await?.study_id;
        let mut work = std::pin::pin!(self.job.carry_out(trial, request, cancelled.clone()));
        let result = loop {
            if consents::is_withdrawn(&mut *self.store.read().await?, study).await? {
                return Ok(());
            }
            tokio::select! {
                biased;
                () = cancelled.cancelled(), if !J::KEEPS_PARTS => return Ok(()),
                result = &mut work => break result,
                Ok(()) = record_changed.changed() => {}
            }
        };
        match result {
            // Work that fails after a withdrawal fails because of it.
            Err(_) if consents::is_withdrawn(&mut *self.store.read().await?, study).await? => Ok(()),
            result => result,
        }
    }

    fn queue(&self) -> MutexGuard<'_, JobQueue<J::Request>> {
        // The queue is consistent between statements, so a poisoned lock is usable.
        self.queue.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl<J: TrialJob> fmt::Debug for TrialJobs<J> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("TrialJobs").field("job", &J::NAME).finish_non_exhaustive()
    }
}

/// Runs work on a thread of its own, with this priority. The token of the work is cancelled with the job, or if the future is
/// dropped.
///
/// # Errors
/// [`Error::Internal`] if no thread can be started or the work panics.
pub(super) async fn run_cancellable<T: Send + 'static>(
    (name, niceness): (&'static str, i32),
    cancelled: &CancellationToken,
    work: impl FnOnce(&CancelToken) -> T + Send + 'static,
) -> Result<T, Error> {
    let cancel = CancelToken::new();
    let (_cancels, of_thread) = (CancelOnDrop(cancel.clone()), cancel.clone());
    let mut result = run_with(niceness, name, move || work(&of_thread))
        .map_err(|error| Error::Internal(format!("cannot start a thread for the {name}: {error}")))?;
    let result = tokio::select! {
        result = &mut result => result,
        () = cancelled.cancelled() => {
            cancel.cancel();
            result.await
        }
    };
    result.map_err(|_| Error::Internal(format!("the {name} panicked")))
}

/// Cancels work when the caller stops waiting for it.
struct CancelOnDrop(CancelToken);

impl Drop for CancelOnDrop {
    fn drop(&mut self) {
        self.0.cancel();
    }
}
