//! The scheduler: proposes trials, dispatches their solves and records the results, for every running study.
//!
//! One task plans and dispatches jobs, one receives the messages of workers, one prefetches solves for studies that
//! wait for an answer. Their decisions depend on the record alone, so the process may end at any instant.

mod earlier_solves;
mod leases;
mod message_loop;
mod planning_loop;
mod prefetch;
mod prefetched_solves;
mod solve_dispatch;

use self::prefetched_solves::Prefetches;
use super::analysis::Analyses;
use super::execution::{NewExecutionReport, Simulation};
use super::explanation::ExplanationEffort;
use super::jobs_after_solves::JobsAfterSolves;
use super::snapshot::StudySnapshot;
use crate::error::Error;
use crate::job::{JobId, JobState};
use crate::supervise::{Task, Tasks};
use crate::workers::{AfterSolves, Dispatch, RunningSolves};
use futures_util::future::BoxFuture;
use gaitwright_store::{Store, StudyId, TrialId};
use std::fmt;
use std::sync::Arc;
use tokio::sync::{Mutex, Notify, OnceCell, watch};
use tokio_util::sync::CancellationToken;
use tokio_util::task::TaskTracker;

/// How often a lease is renewed within its duration. Workers report each iteration, which is too often to write.
const HEARTBEATS_PER_LEASE: u32 = 3;

/// Runs the studies of a record. Cheap to clone.
#[derive(Debug, Clone)]
pub struct Scheduler(Arc<Inner>);

struct Inner {
    store: Store,
    /// The record with its own thread pool, so that a job does not wait for the posterior of another study.
    unpacking: Store,
    engine: Arc<dyn Dispatch>,
    /// Progress of the running solves.
    running_solves: Arc<RunningSolves>,
    /// Prefetched solves.
    prefetches: Prefetches,
    /// Snapshots of the studies that wait for an answer, for prefetching.
    waiting: watch::Sender<Arc<[Arc<StudySnapshot>]>>,
    /// Certificates, explanations and execution reports.
    after_solves: Option<JobsAfterSolves>,
    analyses: Arc<Analyses>,
    /// Held from the search for a free worker until the engine has the job, so that a prefetch never takes the worker
    /// of a trial.
    hand_over: Mutex<()>,
    /// If set, the only study that is run.
    only: Option<StudyId>,
    /// Signals a change that needs planning.
    wake: Notify,
    /// Counts changes of the record, so that listeners know when to read events.
    pulse: watch::Sender<u64>,
    shutdown: CancellationToken,
    tasks: TaskTracker,
    /// Health of the background tasks.
    health: Tasks,
    leases_taken_back: OnceCell<()>,
}

impl fmt::Debug for Inner {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Scheduler")
            .field("engine", &self.engine.name())
            .field("only", &self.only)
            .finish_non_exhaustive()
    }
}

impl Scheduler {
    /// Creates a scheduler; [`Self::run`] starts it. Without `after_solves`, it certifies gaits on request only,
    /// explains nothing and simulates no walks.
    pub fn new(
        store: &Store,
        engine: Arc<dyn Dispatch>,
        only: Option<StudyId>,
        after_solves: Option<AfterSolves>,
    ) -> Self {
        // A separate pool, so that requests cannot delay planning.
        let store = store.with_own_pool();
        let analyses = Arc::<Analyses>::default();
        Self(Arc::new(Inner {
            after_solves: after_solves.map(|by| JobsAfterSolves::new(&store, by, &analyses)),
            unpacking: store.with_own_pool(),
            store,
            analyses,
            engine,
            running_solves: Arc::default(),
            prefetches: Prefetches::default(),
            waiting: watch::channel(Arc::default()).0,
            hand_over: Mutex::default(),
            only,
            wake: Notify::new(),
            pulse: watch::channel(0).0,
            shutdown: CancellationToken::new(),
            tasks: TaskTracker::new(),
            health: Tasks::default(),
            leases_taken_back: OnceCell::new(),
        }))
    }

    /// The record.
    pub fn store(&self) -> &Store {
        &self.0.store
    }

    /// Progress of the running solves.
    pub fn running_solves(&self) -> &Arc<RunningSolves> {
        &self.0.running_solves
    }

    /// Cached posteriors of studies.
    pub fn analyses(&self) -> &Arc<Analyses> {
        &self.0.analyses
    }

    /// Number of solves that can run in parallel.
    pub fn workers(&self) -> usize {
        self.0.engine.size()
    }

    /// Changes with every change of the record.
    pub fn pulse(&self) -> watch::Receiver<u64> {
        self.0.pulse.subscribe()
    }

    /// Cancelled when the scheduler stops, so that endless streams end.
    pub fn stopping(&self) -> CancellationToken {
        self.0.shutdown.clone()
    }

    /// Announces a change of the record: wakes planning and listeners.
    pub fn changed(&self) {
        self.0.pulse.send_modify(|count| *count = count.wrapping_add(1));
        self.0.wake.notify_one();
    }

    /// Requests certificates of the best gaits of a study; `next` is the first one without. Returns `false` if that one
    /// cannot be certified, its job was cancelled, or this process certifies gaits on request only.
    pub fn certify_best_of(&self, study: StudyId, next: TrialId) -> bool {
        self.0.after_solves.as_ref().is_some_and(|jobs| jobs.certify_best_of(study, next))
    }

    /// Requests the certificate of one gait. Returns `false` if this process certifies none.
    pub fn certify(&self, trial: TrialId) -> bool {
        self.0.after_solves.as_ref().map(|jobs| jobs.certificates.ask(trial, ())).is_some()
    }

    /// Whether a gait of a study is being certified or is queued.
    pub fn is_certifying(&self, study: StudyId, gait: TrialId) -> bool {
        self.0.after_solves.as_ref().is_some_and(|jobs| jobs.is_certifying(study, gait))
    }

    /// The state of the certificate of a gait in this process, and the reason if it failed.
    pub fn certifying(&self, trial: TrialId) -> Option<(JobState, Option<String>)> {
        self.0.after_solves.as_ref().and_then(|jobs| jobs.certifying(trial))
    }

    /// Requests the execution report of one gait; `None` if it exists already. Returns `false` if this process simulates
    /// no walks.
    pub(super) fn simulate(&self, trial: TrialId, asked: Option<NewExecutionReport>) -> bool {
        self.0.after_solves.as_ref().map(|jobs| jobs.simulate(trial, asked)).is_some()
    }

    /// The state of the execution report of a gait in this process.
    pub fn simulating(&self, trial: TrialId) -> Simulation {
        self.0.after_solves.as_ref().map_or(Simulation::None, |jobs| jobs.simulating(trial))
    }

    /// Resumes the explanation of a trial whose explanation was cancelled.
    pub fn explain_again(&self, trial: TrialId) {
        if let Some(jobs) = &self.0.after_solves {
            jobs.explanations.forget_end(trial);
        }
    }

    /// The state of the explanation of a trial in this process.
    pub fn explaining(&self, trial: TrialId) -> ExplanationEffort {
        self.0.after_solves.as_ref().map_or(ExplanationEffort::None, |jobs| jobs.explaining(trial))
    }

    /// The certificates, explanations and execution reports that are queued or running, with their trials.
    pub fn jobs_after_solves(&self) -> Vec<(JobId, TrialId, JobState)> {
        self.0.after_solves.as_ref().map(JobsAfterSolves::open).unwrap_or_default()
    }

    /// Stops the work of a job that was cancelled.
    pub async fn cancel_job(&self, id: JobId) {
        match (id, &self.0.after_solves) {
            (JobId::Solve(trial), _) => self.cancel_solve(trial).await,
            (id, Some(jobs)) => jobs.cancel(id),
            (_, None) => {}
        }
    }

    /// Cancels the solve of a trial, which stops within one iteration.
    pub async fn cancel_solve(&self, trial: TrialId) {
        self.0.engine.cancel(self.0.prefetches.name_of(trial)).await;
        self.0.running_solves.close(trial);
    }

    /// Keeps another background task running until the scheduler stops; [`Self::problem`] reports its failures too.
    pub async fn keep<F>(&self, name: &'static str, begin: impl Fn(Task) -> F)
    where
        F: Future<Output = Result<(), Error>> + Send + 'static,
    {
        self.0.health.keep(name, &self.0.shutdown, begin).await;
    }

    /// Stops the scheduler; [`Self::run`] returns soon after.
    pub fn stop(&self) {
        self.0.shutdown.cancel();
    }

    /// Runs until [`Self::stop`]. Solves that are still running in this process return to the queue.
    ///
    /// # Errors
    /// Errors of the database while stopping. A task that fails earlier is restarted, and [`Self::problem`] reports it.
    pub async fn run(&self) -> Result<(), Error> {
        let keep = |name, begin: fn(Self, Task) -> BoxFuture<'static, Result<(), Error>>| {
            let scheduler = self.clone();
            async move {
                let begin = |task| begin(scheduler.clone(), task);
                scheduler.0.health.keep(name, &scheduler.0.shutdown, begin).await;
            }
        };
        tokio::join!(
            keep("planning", |scheduler, task| Box::pin(async move { scheduler.keep_planning(&task).await })),
            keep("listening to workers", |scheduler, task| Box::pin(
                async move { scheduler.keep_listening(&task).await }
            )),
            keep("prefetching", |scheduler, task| { Box::pin(async move { scheduler.keep_prefetching(&task).await }) }),
            keep("certifying gaits", |scheduler, task| Box::pin(async move { scheduler.keep_certifying(&task).await })),
            keep("explaining trials", |scheduler, task| Box::pin(
                async move { scheduler.keep_explaining(&task).await }
            )),
            keep("simulating walks", |scheduler, task| Box::pin(async move { scheduler.keep_simulating(&task).await })),
        );
        self.0.tasks.close();
        self.0.tasks.wait().await;
        self.cancel_solves(self.0.prefetches.forget_running()).await;
        self.take_back_leases().await
    }

    /// Which background tasks have failed, in words; `None` if all run.
    pub fn problem(&self) -> Option<String> {
        self.0.health.problem().or_else(|| self.0.engine.problem())
    }

    /// Certifies gaits forever. The explanations of a study follow the certificates of its best gaits.
    async fn keep_certifying(&self, task: &Task) -> Result<(), Error> {
        let Some(jobs) = &self.0.after_solves else { return std::future::pending().await };
        task.works();
        jobs.certificates.run(self.pulse(), || self.changed(), |study| jobs.explanations.queue_ended(study)).await;
        Ok(())
    }

    /// Explains trials without a gait forever.
    async fn keep_explaining(&self, task: &Task) -> Result<(), Error> {
        let Some(jobs) = &self.0.after_solves else { return std::future::pending().await };
        task.works();
        jobs.explanations.run(self.pulse(), || self.changed(), |_| {}).await;
        Ok(())
    }

    /// Simulates walks forever.
    async fn keep_simulating(&self, task: &Task) -> Result<(), Error> {
        let Some(jobs) = &self.0.after_solves else { return std::future::pending().await };
        task.works();
        jobs.simulations.run(self.pulse(), || self.changed(), |_| {}).await;
        Ok(())
    }
}
