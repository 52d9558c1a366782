//! The scheduler: proposes trials, dispatches their solves and records the results, for every running study.
//!
//! One task plans and dispatches jobs, one receives the messages of workers, one prefetches solves for studies that
//! wait for an answer. Their decisions depend on the record alone, so the process may end at any instant.

use super::belief::Beliefs;
use super::certifier::Certifier;
use super::explainer::Explainer;
use super::explanation::Effort;
use super::job::{JobId, JobState};
use super::lifecycle::{self, Act};
use super::next_step::{Step, next_step};
use super::plans_under_way::Plans;
use super::prefetch::{LikelyNext, PREPARED, Prefetches, Prepared};
use super::snapshot::StudySnapshot;
use super::solve_input::{PackedInput, SolveInput};
use super::trial_result;
use crate::error::Error;
use crate::supervise::{Task, Tasks};
use crate::workers::{AfterSolves, Assignment, Attempt, Board, Dispatch, DispatchError, Finding, IN_PROCESS, News};
use futures_util::future::BoxFuture;
use gait_optimizer::SolveStatus;
use gaitwright_compute::OnPool;
use gaitwright_store::jobs::Lease;
use gaitwright_store::studies::{FeedbackMode, Study, StudyState};
use gaitwright_store::trials::{NewTrial, TrialState};
use gaitwright_store::{Store, StoreError, StudyId, TrialId, commit, events, gaits, jobs, now, studies, trials};
use serde_json::json;
use std::collections::HashMap;
use std::fmt;
use std::sync::Arc;
use std::time::{Duration, Instant};
use tokio::sync::{Mutex, Notify, OnceCell, watch};
use tokio_util::sync::CancellationToken;
use tokio_util::task::TaskTracker;

/// How often a lease is renewed within its duration. Workers report each iteration, which is too often to write.
const HEARTBEATS_PER_LEASE: u32 = 3;
/// The longest time between two rounds of planning.
const IDLE: Duration = Duration::from_secs(5);
/// Pause before asking an engine in trouble again whether it can take jobs.
const ENGINE_AGAIN: Duration = Duration::from_millis(100);
/// Changes within this time are planned together.
const TOGETHER: Duration = Duration::from_millis(10);

/// Runs the studies of a record. Cheap to clone.
#[derive(Debug, Clone)]
pub struct Scheduler(Arc<Inner>);

struct Inner {
    store: Store,
    /// The record with its own thread pool, so that a job does not wait for the posterior of another study.
    unpacking: Store,
    engine: Arc<dyn Dispatch>,
    /// Progress of the running solves.
    board: Arc<Board>,
    /// Prefetched solves.
    prefetches: Prefetches,
    /// Snapshots of the studies that wait for an answer, for prefetching.
    waiting: watch::Sender<Arc<[Arc<StudySnapshot>]>>,
    /// The tasks that certify the best gaits of ended studies and explain their trials without a gait.
    after_solves: Option<(Certifier, Explainer)>,
    beliefs: Arc<Beliefs>,
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
    /// Creates a scheduler; [`Self::run`] starts it. Without `after_solves`, it certifies gaits on request only and
    /// explains nothing.
    pub fn new(
        store: &Store,
        engine: Arc<dyn Dispatch>,
        only: Option<StudyId>,
        after_solves: Option<AfterSolves>,
    ) -> Self {
        // A separate pool, so that requests cannot delay planning.
        let store = store.with_own_pool();
        let beliefs = Arc::<Beliefs>::default();
        let over_record = |AfterSolves { certify, explain }| {
            (Certifier::new(store.clone(), certify, Arc::clone(&beliefs)), Explainer::new(store.clone(), explain))
        };
        Self(Arc::new(Inner {
            after_solves: after_solves.map(over_record),
            unpacking: store.with_own_pool(),
            store,
            beliefs,
            engine,
            board: Arc::default(),
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
    pub fn board(&self) -> &Arc<Board> {
        &self.0.board
    }

    /// Cached posteriors of studies.
    pub fn beliefs(&self) -> &Arc<Beliefs> {
        &self.0.beliefs
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

    /// Requests certificates of the best gaits of a study; `next` is the first one without. Returns `false` if this
    /// process certifies gaits on request only.
    pub fn certify_best_of(&self, study: StudyId, next: TrialId) -> bool {
        self.0.after_solves.as_ref().is_some_and(|(certifier, _)| certifier.ask(study, next))
    }

    /// Requests the certificate of one gait. Returns `false` if this process certifies none.
    pub fn certify(&self, trial: TrialId) -> bool {
        self.0.after_solves.as_ref().map(|(certifier, _)| certifier.ask_for(trial)).is_some()
    }

    /// The gaits whose certificates were requested, each with the state of its job.
    pub fn certifying(&self) -> Vec<(TrialId, JobState)> {
        self.0.after_solves.as_ref().map(|(certifier, _)| certifier.jobs()).unwrap_or_default()
    }

    /// Stops the work of a job that was cancelled.
    pub async fn cancel_job(&self, id: JobId) {
        match (id, &self.0.after_solves) {
            (JobId::Solve(trial), _) => self.cancel_solve(trial).await,
            (JobId::Certificate(trial), Some((certifier, _))) => certifier.cancel(trial),
            (JobId::Explanation(trial), Some((_, explainer))) => explainer.cancel(trial),
            (JobId::Certificate(_) | JobId::Explanation(_), None) | (JobId::Backup(_), _) => {}
        }
    }

    /// Resumes the explanation of a trial whose explanation was cancelled.
    pub fn explain_again(&self, trial: TrialId) {
        if let Some((_, explainer)) = &self.0.after_solves {
            explainer.again(trial);
        }
    }

    /// Whether a gait of a study is being certified or is queued.
    pub fn is_certifying(&self, study: StudyId, gait: TrialId) -> bool {
        self.0.after_solves.as_ref().is_some_and(|(certifier, _)| certifier.is_at(study, gait))
    }

    /// The state of the explanation of a trial in this process.
    pub fn explaining(&self, trial: TrialId) -> Effort {
        self.0.after_solves.as_ref().map_or(Effort::None, |(_, explainer)| explainer.effort(trial))
    }

    /// Cancels the solve of a trial, which stops within one iteration.
    pub async fn cancel_solve(&self, trial: TrialId) {
        self.0.engine.withdraw(self.0.prefetches.name_of(trial)).await;
        self.0.board.close(trial);
    }

    /// Keeps another background task running until the scheduler stops; [`Self::trouble`] reports its failures too.
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
    /// Errors of the database while stopping. A task that fails earlier is restarted, and [`Self::trouble`] reports it.
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
        );
        self.0.tasks.close();
        self.0.tasks.wait().await;
        self.withdraw(self.0.prefetches.forget_running()).await;
        self.take_back_leases().await
    }

    /// Which background tasks have failed, in words; `None` if all run.
    pub fn trouble(&self) -> Option<String> {
        self.0.health.trouble().or_else(|| self.0.engine.trouble())
    }

    /// Certifies gaits forever.
    async fn keep_certifying(&self, task: &Task) -> Result<(), Error> {
        let Some((certifier, explainer)) = &self.0.after_solves else { return std::future::pending().await };
        task.works();
        certifier.run(self.pulse(), || self.changed(), |study| explainer.take_up(study)).await;
        Ok(())
    }

    /// Explains trials without a gait forever.
    async fn keep_explaining(&self, task: &Task) -> Result<(), Error> {
        let Some((_, explainer)) = &self.0.after_solves else { return std::future::pending().await };
        task.works();
        explainer.run(self.pulse(), || self.changed()).await;
        Ok(())
    }

    async fn keep_planning(&self, task: &Task) -> Result<(), Error> {
        // Once at the start: later leases belong to running solves.
        self.0.leases_taken_back.get_or_try_init(|| self.take_back_leases()).await?;
        let pause = IDLE.min(self.0.engine.lease() / HEARTBEATS_PER_LEASE);
        let mut plans = Plans::default();
        // Since when jobs may be ready to dispatch.
        let mut since = None;
        let mut storages = 0;
        loop {
            self.look_after_leases().await?;
            self.replace_lost_jobs(&mut storages).await?;
            self.begin_plans(&mut plans).await?;
            since.get_or_insert_with(Instant::now);
            task.works();
            let looked = tokio::time::sleep(pause);
            tokio::pin!(looked);
            loop {
                let hand_out_at = since.map(|since| plans.hand_out_at(since));
                tokio::select! {
                    Some((study, snapshot)) = plans.next() => {
                        let again = plans.ended(study, snapshot?);
                        self.0.waiting.send_replace(plans.waiting());
                        since.get_or_insert_with(Instant::now);
                        if again {
                            break;
                        }
                    }
                    () = self.can_hand_out(hand_out_at), if since.is_some() => {
                        self.dispatch().await?;
                        since = None;
                    }
                    // Wakes on a change or after the idle time. Changes close together are planned once.
                    () = &mut looked => break,
                    () = self.0.wake.notified() => {
                        tokio::time::sleep(TOGETHER).await;
                        break;
                    }
                }
            }
        }
    }

    /// Waits until the engine can take jobs, and until this time at least.
    async fn can_hand_out(&self, at: Option<Instant>) {
        tokio::time::sleep_until(at.unwrap_or_else(Instant::now).into()).await;
        while self.0.engine.trouble().is_some() {
            tokio::time::sleep(ENGINE_AGAIN).await;
        }
    }

    /// Queues the jobs of a killed process again, without counting them as failures.
    async fn take_back_leases(&self) -> Result<(), Error> {
        let engine = self.0.engine.outlives_process().then_some(IN_PROCESS);
        let mut reader = self.0.store.read().await?;
        let left = jobs::leased(&mut reader, engine).await?;
        drop(reader);
        for lease in left {
            self.give_back(&lease).await?;
        }
        Ok(())
    }

    async fn look_after_leases(&self) -> Result<(), Error> {
        let mut reader = self.0.store.read().await?;
        let expired = jobs::expired(&mut reader, now()).await?;
        let held_up = jobs::held_up(&mut reader).await?;
        drop(reader);
        for lease in expired {
            self.look_after(&lease).await?;
        }
        for lease in held_up {
            self.give_back(&lease).await?;
        }
        Ok(())
    }

    /// Dispatches the jobs again that no worker has started, if the engine has another storage than the known one. A
    /// worker that has started a job does not need the storage.
    async fn replace_lost_jobs(&self, known: &mut u64) -> Result<(), Error> {
        let storages = self.0.engine.storages();
        if storages == *known || self.0.engine.trouble().is_some() {
            return Ok(());
        }
        *known = storages;
        self.withdraw(self.0.prefetches.forget_running()).await;
        let leased = jobs::leased(&mut *self.0.store.read().await?, Some(self.0.engine.name())).await?;
        for lease in leased {
            self.replace_unstarted(&lease).await?;
        }
        Ok(())
    }

    /// Starts planning for each active study, in parallel, so that a large study does not delay the others.
    async fn begin_plans(&self, plans: &mut Plans) -> Result<(), Error> {
        let active = studies::active(&mut *self.0.store.read().await?).await?;
        self.withdraw(self.0.prefetches.forget(|id| active.iter().any(|study| study.id == id))).await;
        plans.keep(|id| active.iter().any(|study| study.id == id));
        for study in active.into_iter().filter(|study| self.0.only.is_none_or(|only| only == study.id)) {
            let scheduler = self.clone();
            plans.begin(study.id, async move {
                match scheduler.plan(study.clone()).await {
                    Err(error) if error.is_of_machine() => Err(error),
                    // Planning would fail again, so a person has to see it.
                    Err(error) => scheduler.hold(&study, &error).await.map(|()| None),
                    snapshot => snapshot,
                }
            });
        }
        Ok(())
    }

    /// Takes a job back from the engine, without counting a failure.
    async fn give_back(&self, lease: &Lease) -> Result<(), Error> {
        self.cancel_solve(lease.trial).await;
        trial_result::interrupted(&self.0.store, lease).await.map(drop)
    }

    /// Handles an expired lease. A job that no worker has started is dispatched again, in case the engine lost it. A
    /// job of a silent worker is taken from it.
    async fn look_after(&self, lease: &Lease) -> Result<(), Error> {
        if !self.replace_unstarted(lease).await? {
            self.cancel_solve(lease.trial).await;
            trial_result::silent(&self.0.store, lease).await?;
        }
        Ok(())
    }

    /// Dispatches a job again if no worker has started it. Returns whether that is so.
    async fn replace_unstarted(&self, lease: &Lease) -> Result<bool, Error> {
        let state = trials::get(&mut *self.0.store.read().await?, lease.trial).await?.state;
        if state != TrialState::Queued {
            return Ok(false);
        }
        if self.0.engine.trouble().is_none() {
            self.live_on(lease).await?;
            self.submit(lease).await?;
        }
        Ok(true)
    }

    /// Proposes trials up to the parallel limit of the study, or changes its state. Returns the snapshot if the study
    /// waits for an answer.
    async fn plan(&self, mut study: Study) -> Result<Option<StudySnapshot>, Error> {
        let mut store = self.0.store.clone();
        loop {
            let mut reader = store.read().await?;
            let snapshot = StudySnapshot::read(&mut reader, study.clone()).await?;
            drop(reader);
            self.certify_for_people(&snapshot);
            let beliefs = Arc::clone(&self.0.beliefs);
            let decide = move |pool: &OnPool| {
                let step = next_step(pool, &snapshot, &beliefs);
                (snapshot, step)
            };
            let (snapshot, step) = store.compute(decide).await?;
            match step? {
                Step::Nothing => return Ok(Some(snapshot).filter(|s| s.study.state == StudyState::Waiting)),
                Step::Act(act, reason) => match self.act(&snapshot.study, act, &reason).await? {
                    Some(changed) => study = changed,
                    None => return Ok(None),
                },
                Step::Try(new) => {
                    if !self.propose(&snapshot, &new).await? {
                        return Ok(None);
                    }
                }
            }
        }
    }

    /// Requests the certificates that the next comparison needs.
    fn certify_for_people(&self, snapshot: &StudySnapshot) {
        if snapshot.study.plan.feedback_mode != FeedbackMode::Automatic {
            for trial in snapshot.trials.iter().filter(|trial| snapshot.waits_for_certificate(trial)) {
                self.certify(trial.id);
            }
        }
    }

    /// Pauses a study that cannot be planned, and records the reason.
    async fn hold(&self, study: &Study, error: &Error) -> Result<(), Error> {
        tracing::error!(study = %study.id, %error, "cannot plan a study; pausing it");
        self.act(study, Act::Pause, &format!("Planning failed: {error}")).await.map(drop)
    }

    async fn act(&self, study: &Study, act: Act, reason: &str) -> Result<Option<Study>, Error> {
        let state = lifecycle::after(study.state, act)?;
        let mut writer = self.0.store.write().await?;
        if !studies::set_state(&mut writer, study, state, reason).await? {
            return Ok(None);
        }
        let payload = json!({ "state": state, "reason": reason });
        events::append(&mut writer, study.id, "study_changed", &payload).await?;
        let changed = studies::get(&mut writer, study.id).await?;
        commit(writer).await?;
        self.changed();
        Ok(Some(changed).filter(|s| matches!(s.state, StudyState::Running | StudyState::Waiting)))
    }

    /// Writes trial and job in one transaction, unless the study has changed since the snapshot.
    async fn propose(&self, snapshot: &StudySnapshot, new: &NewTrial) -> Result<bool, Error> {
        let study = snapshot.study.id;
        let mut writer = self.0.store.write().await?;
        if let Err(shortage) = writer.room() {
            tracing::warn!(%study, %shortage, "no trial is proposed because the disk is nearly full");
            return Ok(false);
        }
        let current = studies::get(&mut writer, study).await?;
        let written = match current.state {
            StudyState::Running => snapshot.write_trial(&mut writer, new).await?,
            _ => None,
        };
        let Some(trial) = written else {
            self.0.wake.notify_one();
            return Ok(false);
        };
        jobs::insert(&mut writer, trial).await?;
        let payload = json!({ "trial_id": trial, "number": new.number, "state": TrialState::Queued });
        events::append(&mut writer, study, "trial_queued", &payload).await?;
        commit(writer).await?;
        self.changed();
        Ok(true)
    }

    /// Dispatches jobs while the engine has free workers.
    async fn dispatch(&self) -> Result<(), Error> {
        while let Some(lease) = self.lease().await? {
            self.submit(&lease).await?;
        }
        Ok(())
    }

    async fn lease(&self) -> Result<Option<Lease>, Error> {
        let engine = &self.0.engine;
        // This runs on every change, so it must not occupy the only writer.
        let (queued, leased) = jobs::depth(&mut *self.0.store.read().await?).await?;
        if queued == 0 || leased as usize >= engine.size() || engine.trouble().is_some() {
            return Ok(None);
        }
        let mut writer = self.0.store.write().await?;
        let until = now().after(engine.lease());
        let Some(lease) = jobs::lease(&mut writer, engine.name(), until, self.0.only, engine.size()).await? else {
            return Ok(None);
        };
        commit(writer).await?;
        Ok(Some(lease))
    }

    async fn submit(&self, lease: &Lease) -> Result<(), Error> {
        let assignment = match assignment(&mut self.0.unpacking.clone(), lease).await {
            Ok(assignment) => assignment,
            Err(error) => {
                trial_result::broke(&self.0.store, lease, &error.to_string()).await?;
                return Ok(());
            }
        };
        let attempt = assignment.attempt;
        let hand_over = self.0.hand_over.lock().await;
        match self.0.prefetches.claim(&assignment) {
            Prepared::Nothing => {}
            Prepared::Running => return self.started(attempt, PREPARED).await,
            Prepared::Done(finding) => {
                drop(hand_over);
                self.started(attempt, PREPARED).await?;
                self.ended(attempt, PREPARED, finding).await?;
                self.changed();
                return Ok(());
            }
        }
        if self.busy().await? > self.0.engine.size() {
            self.withdraw(self.0.prefetches.forget_running()).await;
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
    async fn busy(&self) -> Result<usize, Error> {
        let (_, leased) = jobs::depth(&mut *self.0.store.read().await?).await?;
        Ok(leased as usize + self.0.prefetches.running())
    }

    /// Prefetches the solves that may follow each pending answer, on workers that are idle.
    async fn keep_prefetching(&self, task: &Task) -> Result<(), Error> {
        task.works();
        let mut waiting = self.0.waiting.subscribe();
        let mut likely = LikelyNext::default();
        // The sender lives as long as the scheduler, so this loop ends only with it.
        while waiting.changed().await.is_ok() {
            let snapshots = Arc::clone(&waiting.borrow_and_update());
            likely.keep(|study| snapshots.iter().any(|snapshot| snapshot.study.id == study));
            for snapshot in snapshots.iter() {
                if let Err(error) = self.prefetch(&mut likely, snapshot).await {
                    tracing::warn!(study = %snapshot.study.id, %error, "cannot prefetch");
                }
            }
        }
        Ok(())
    }

    async fn prefetch(&self, likely: &mut LikelyNext, snapshot: &StudySnapshot) -> Result<(), Error> {
        let study = &snapshot.study;
        if !likely.knows(snapshot) {
            self.withdraw(self.0.prefetches.forget(|other| other != study.id)).await;
        }
        let mut store = self.0.store.clone();
        let mut unpacking = self.0.unpacking.clone();
        for new in likely.of(&mut store, snapshot).await? {
            if self.busy().await? >= self.0.engine.size() {
                return Ok(());
            }
            // No trial has this identifier: the result is kept here until a trial claims it.
            let attempt = Attempt { trial: TrialId::fresh(), number: 1 };
            let mut reader = unpacking.read().await?;
            let input = PackedInput::of(&mut reader, &study.plan, new.action, new.warm_started_from).await?;
            drop(reader);
            let input = unpacking.compute(move |pool| input.unpack(pool)).await??;
            let assignment = assigned(attempt, new.number, input);
            let _hand_over = self.0.hand_over.lock().await;
            if self.busy().await? < self.0.engine.size()
                && self.0.prefetches.begin(study.id, &assignment)
                && let Err(error) = self.0.engine.submit(assignment).await
            {
                self.withdraw(self.0.prefetches.forget_running()).await;
                return Err(error.into());
            }
        }
        Ok(())
    }

    async fn withdraw(&self, names: Vec<TrialId>) {
        for name in names {
            self.0.engine.withdraw(name).await;
        }
    }

    /// Receives the messages of workers.
    async fn keep_listening(&self, task: &Task) -> Result<(), Error> {
        task.works();
        let mut written: HashMap<TrialId, Instant> = HashMap::new();
        loop {
            let news = match self.0.prefetches.hear(self.0.engine.next().await) {
                Ok(news) => news,
                Err(receipt) => {
                    receipt.sign().await;
                    self.0.wake.notify_one();
                    continue;
                }
            };
            let heard = match news {
                News::Started { attempt, worker } => {
                    written.insert(attempt.trial, Instant::now());
                    self.started(attempt, &worker).await
                }
                News::Iterated { attempt, record } => {
                    self.0.board.add(attempt.trial, record);
                    let last = written.entry(attempt.trial).or_insert_with(Instant::now);
                    if last.elapsed() < self.0.engine.lease() / HEARTBEATS_PER_LEASE {
                        continue;
                    }
                    *last = Instant::now();
                    self.heartbeat(attempt).await
                }
                News::Ended { attempt, worker, finding, receipt } => {
                    written.remove(&attempt.trial);
                    let scheduler = self.clone();
                    self.0.tasks.spawn(async move {
                        match scheduler.ended(attempt, &worker, finding).await {
                            Ok(()) => receipt.sign().await,
                            // Without a receipt the message comes again, or the lease expires.
                            Err(error) => tracing::error!(trial = %attempt.trial, %error, "cannot record a trial"),
                        }
                        scheduler.changed();
                    });
                    Ok(())
                }
            };
            heard?;
        }
    }

    /// Records that a worker started a job.
    async fn started(&self, attempt: Attempt, worker: &str) -> Result<(), Error> {
        let Some(lease) = self.lease_of(attempt).await? else { return Ok(()) };
        let mut writer = self.0.store.write().await?;
        if !jobs::heartbeat(&mut writer, &lease, now().after(self.0.engine.lease())).await? {
            drop(writer);
            self.cancel_solve(attempt.trial).await;
            return Ok(());
        }
        trials::start(&mut writer, lease.trial).await?;
        let trial = trials::get(&mut writer, lease.trial).await?;
        let payload = json!({ "trial_id": trial.id, "number": trial.number, "state": trial.state, "worker": worker });
        events::append(&mut writer, lease.study, "trial_started", &payload).await?;
        commit(writer).await?;
        self.0.board.open(trial.id, lease.study, trial.number);
        self.0.pulse.send_modify(|count| *count = count.wrapping_add(1));
        Ok(())
    }

    /// The lease of an attempt. `None` if the record has no such trial, as after a dropped prefetch.
    async fn lease_of(&self, attempt: Attempt) -> Result<Option<Lease>, Error> {
        match jobs::lease_of(&mut *self.0.store.read().await?, attempt.trial, attempt.number).await {
            Err(StoreError::Missing { .. }) => {
                tracing::debug!(trial = %attempt.trial, "ignoring a message about a dropped prefetch");
                Ok(None)
            }
            found => Ok(Some(found?)),
        }
    }

    async fn heartbeat(&self, attempt: Attempt) -> Result<(), Error> {
        let Some(lease) = self.lease_of(attempt).await? else { return Ok(()) };
        if !self.live_on(&lease).await? {
            self.cancel_solve(attempt.trial).await;
        }
        Ok(())
    }

    /// Renews a lease. Returns `false` if it has passed to another attempt.
    async fn live_on(&self, lease: &Lease) -> Result<bool, Error> {
        self.lease_until(lease, now().after(self.0.engine.lease())).await
    }

    /// Sets the end of a lease. Returns `false` if it has passed to another attempt.
    async fn lease_until(&self, lease: &Lease, until: gaitwright_store::Instant) -> Result<bool, Error> {
        let mut writer = self.0.store.write().await?;
        let ours = jobs::heartbeat(&mut writer, lease, until).await?;
        commit(writer).await?;
        Ok(ours)
    }

    /// Records the result of an attempt.
    async fn ended(&self, attempt: Attempt, worker: &str, finding: Finding) -> Result<(), Error> {
        self.0.board.close(attempt.trial);
        let mut store = self.0.store.clone();
        let Some(lease) = self.lease_of(attempt).await? else { return Ok(()) };
        let (outcome, iterations) = match finding {
            Finding::Ended { outcome, iterations } => (outcome, iterations),
            Finding::Broke(reason) => return trial_result::broke(&store, &lease, &reason).await.map(drop),
        };
        let pack = move |pool: &OnPool| {
            let packed = gaits::PackedGait::new(pool, &outcome, &iterations);
            (outcome, packed)
        };
        let (outcome, packed) = store.compute(pack).await?;
        let packed = packed?;
        if packed.is_none() && outcome.report.status == SolveStatus::Converged {
            let reason = "The solver returned a converged gait with numbers that are not finite.";
            return trial_result::broke(&store, &lease, reason).await.map(drop);
        }
        trial_result::ended(&mut store, &lease, worker, &outcome, packed.as_ref()).await.map(drop)
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

fn assigned(attempt: Attempt, number: u32, input: SolveInput) -> Assignment {
    let SolveInput { problem, options, warm_start } = input;
    Assignment { attempt, number, problem, warm_start, options }
}
