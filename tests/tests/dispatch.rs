//! The contract of an engine, for threads of this process and for workers behind a broker: failures of a worker, of a
//! delivery or of the engine itself neither lose a result nor count one twice.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use axum::http::StatusCode;
use futures_util::future::BoxFuture;
use gaitwright_service::dispatch_error::DispatchError;
use gaitwright_service::workers::nats::JetStream;
use gaitwright_service::workers::{Assignment, Dispatch, EngineMessage, InProcess, Receipt};
use gaitwright_store::feedback::FeedbackContent;
use gaitwright_store::studies::StudyState;
use gaitwright_store::trials::TrialState;
use gaitwright_store::{StudyId, TrialId, attempts, solve_jobs};
use gaitwright_tests::analytic::Analytic;
use gaitwright_tests::broker::Broker;
use gaitwright_tests::service::Service;
use std::collections::VecDeque;
use std::path::PathBuf;
use std::process::{Child, Command};
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::sync::{Arc, Mutex};
use std::time::Duration;
use tempfile::TempDir;

const LEASE: Duration = Duration::from_secs(3);
/// Twelve of them make a solve.
const ITERATION: Duration = Duration::from_millis(15);
const QUEUE: &str = "contract";
const TRIALS: u32 = 4;

/// Behaviour of a worker during its first solve.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Worker {
    Steady,
    /// Ends during the solve: a thread panics, or the test kills a process.
    Dies,
    Hangs,
}

/// Where jobs run.
struct Rig {
    /// `None`: threads of this process.
    broker: Option<Broker>,
    workers: Vec<Child>,
    folder: TempDir,
}

impl Rig {
    #[allow(clippy::unnecessary_wraps, reason = "the other rig may be missing")]
    fn threads() -> Option<Self> {
        Some(Self { broker: None, workers: Vec::new(), folder: tempfile::tempdir().unwrap() })
    }

    fn nats() -> Option<Self> {
        Some(Self { broker: Some(Broker::start()?), workers: Vec::new(), folder: tempfile::tempdir().unwrap() })
    }

    fn database(&self) -> PathBuf {
        self.folder.path().join("a.db")
    }

    async fn engine(&mut self, worker: Worker) -> Arc<dyn Dispatch> {
        let Some(broker) = &self.broker else {
            let panics_once = if worker == Worker::Dies { vec![1] } else { Vec::new() };
            let solver =
                Analytic { panics_once, hangs: u32::from(worker == Worker::Hangs), ..Analytic::slow(ITERATION) };
            return Arc::new(InProcess::new(1, Arc::new(solver)).with_lease(LEASE));
        };
        let url = broker.url();
        self.add_worker(worker);
        for _ in 0..100 {
            match JetStream::connect(&url, QUEUE, 1, LEASE).await {
                Ok(engine) => return Arc::new(engine),
                Err(_) => tokio::time::sleep(Duration::from_millis(100)).await,
            }
        }
        panic!("no JetStream at {url}");
    }

    fn add_worker(&mut self, worker: Worker) {
        let url = self.broker.as_ref().unwrap().url();
        let process = Command::new(env!("CARGO_BIN_EXE_worker-analytic"))
            .args([&url, QUEUE, &LEASE.as_millis().to_string(), &ITERATION.as_millis().to_string()])
            .arg((worker == Worker::Hangs).to_string())
            .spawn()
            .unwrap();
        self.workers.push(process);
    }

    /// Kills what runs the present job; another worker is there. A thread does that by itself.
    fn kill_worker(&mut self) {
        if self.broker.is_some() {
            let mut victim = self.workers.remove(0);
            victim.kill().unwrap();
            victim.wait().unwrap();
            self.add_worker(Worker::Steady);
        }
    }
}

impl Drop for Rig {
    fn drop(&mut self) {
        for worker in &mut self.workers {
            worker.kill().unwrap();
            worker.wait().unwrap();
        }
    }
}

async fn started(service: &Service) -> StudyId {
    service.study(|new| (new.seed, new.number_of_trials) = (3, TRIALS)).await
}

async fn wait_for_a_solve(service: &Service, study: StudyId) {
    for _ in 0..2000 {
        if service.trials(study).await.iter().any(|trial| trial.state == TrialState::Running) {
            return tokio::time::sleep(3 * ITERATION).await;
        }
        tokio::time::sleep(Duration::from_millis(5)).await;
    }
    panic!("no solve was begun");
}

/// The parts of a trial that must not depend on failures.
async fn essence(service: &Service, study: StudyId) -> Vec<String> {
    let trials = service.trials(study).await;
    let line = |t: &gaitwright_store::trials::Trial| {
        format!("{} {} {:?} {:?}", t.number, t.action_index, t.state, t.gait_rmse_rad.map(f64::to_bits))
    };
    trials.iter().map(line).collect()
}

async fn undisturbed() -> Vec<String> {
    let folder = tempfile::tempdir().unwrap();
    let service = Service::start(&folder.path().join("a.db"), Analytic::default(), 1).await;
    let study = started(&service).await;
    service.wait_for(study, &[StudyState::Finished]).await;
    let expected = essence(&service, study).await;
    service.stop().await;
    expected
}

/// The study ends with the trials of an uninterrupted run, each with one label and one result that counts.
async fn nothing_is_lost_or_doubled(service: &Service, study: StudyId) {
    service.wait_for(study, &[StudyState::Finished]).await;
    assert_eq!(essence(service, study).await, undisturbed().await);
    let feedback = service.feedback(study).await;
    for trial in service.trials(study).await {
        let labels = feedback
            .iter()
            .filter(|row| matches!(row.content, FeedbackContent::Label { trial: of, .. } if of == trial.id));
        assert_eq!(labels.count(), 1, "labels of trial {}", trial.number);
        let brought = attempts::of_trial(&mut service.store.read().await.unwrap(), trial.id).await.unwrap();
        assert_eq!(brought.iter().filter(|result| result.used).count(), 1, "{brought:?}");
    }
}

async fn an_undisturbed_study(mut rig: Rig) {
    let service = Service::start_with(&rig.database(), rig.engine(Worker::Steady).await).await;
    let study = started(&service).await;
    nothing_is_lost_or_doubled(&service, study).await;
    service.stop().await;
}

async fn a_worker_that_is_killed(mut rig: Rig) {
    let service = Service::start_with(&rig.database(), rig.engine(Worker::Dies).await).await;
    let study = started(&service).await;
    wait_for_a_solve(&service, study).await;
    rig.kill_worker();
    nothing_is_lost_or_doubled(&service, study).await;
    service.stop().await;
}

async fn a_worker_that_hangs(mut rig: Rig) {
    let service = Service::start_with(&rig.database(), rig.engine(Worker::Hangs).await).await;
    let study = started(&service).await;
    nothing_is_lost_or_doubled(&service, study).await;
    service.stop().await;
}

async fn a_result_that_is_brought_twice(mut rig: Rig) {
    let engine = Changed {
        engine: rig.engine(Worker::Steady).await,
        change: Change::Twice,
        held: Mutex::default(),
        holds_back: AtomicBool::new(false),
    };
    let service = Service::start_with(&rig.database(), Arc::new(engine)).await;
    let study = started(&service).await;
    nothing_is_lost_or_doubled(&service, study).await;
    service.stop().await;
}

async fn a_result_that_comes_late(mut rig: Rig) {
    let engine = Changed {
        engine: rig.engine(Worker::Steady).await,
        change: Change::Late,
        held: Mutex::default(),
        holds_back: AtomicBool::new(true),
    };
    let service = Service::start_with(&rig.database(), Arc::new(engine)).await;
    let study = started(&service).await;
    nothing_is_lost_or_doubled(&service, study).await;
    let first = service.trials(study).await[0].id;
    let brought = service.fetch(&format!("/api/v1/trials/{first}/attempts")).await.items();
    let brought: Vec<_> = brought.as_array().unwrap().iter().map(|r| (&r["attempt"], &r["used"])).collect();
    assert_eq!(brought.len(), 2, "{brought:?}");
    assert!(brought[0] == (&1.into(), &false.into()) && brought[1] == (&2.into(), &true.into()), "{brought:?}");
    service.stop().await;
}

async fn a_job_that_is_cancelled(mut rig: Rig) {
    let service = Service::start_with(&rig.database(), rig.engine(Worker::Steady).await).await;
    let study = started(&service).await;
    let running = loop {
        wait_for_a_solve(&service, study).await;
        // On a busy machine it may have ended meanwhile; there are others.
        let trials = service.trials(study).await;
        let Some(running) = trials.iter().find(|trial| trial.state == TrialState::Running) else { continue };
        let cancelled = service.post(&format!("/api/v1/trials/{}/cancel", running.id), &serde_json::json!({})).await;
        if cancelled.status.is_success() {
            assert_eq!(cancelled.json()["state"], "cancelled");
            break running.id;
        }
    };
    service.wait_for(study, &[StudyState::Finished]).await;
    let feedback = service.feedback(study).await;
    assert!(
        !feedback.iter().any(|row| matches!(row.content, FeedbackContent::Label { trial, .. } if trial == running))
    );
    let brought = attempts::of_trial(&mut service.store.read().await.unwrap(), running).await.unwrap();
    assert!(brought.iter().all(|result| !result.used), "{brought:?}");
    service.stop().await;
}

async fn an_engine_that_is_restarted(rig: Rig) {
    disturbed(rig, Broker::restart).await;
}

async fn an_engine_that_is_wiped(rig: Rig) {
    disturbed(rig, Broker::wipe).await;
}

/// The broker goes away and comes back; of threads, the process does.
async fn disturbed(mut rig: Rig, disturb: impl Fn(&mut Broker)) {
    let mut service = Service::start_with(&rig.database(), rig.engine(Worker::Steady).await).await;
    let study = started(&service).await;
    for ended in [0, 2] {
        service.wait_for_trials(study, ended).await;
        wait_for_a_solve(&service, study).await;
        if let Some(broker) = &mut rig.broker {
            disturb(broker);
        } else {
            service.stop().await;
            service = Service::start_with(&rig.database(), rig.engine(Worker::Steady).await).await;
        }
    }
    nothing_is_lost_or_doubled(&service, study).await;
    service.stop().await;
}

/// Longer than any test, so that no job is handed out again because its lease has expired.
const LONG: Duration = Duration::from_hours(1);

#[tokio::test(flavor = "multi_thread")]
async fn service_is_not_ready_and_keeps_its_jobs_until_the_broker_is_connected() {
    let Some(mut broker) = Broker::start() else { return };
    broker.kill();
    let mut rig = Rig { broker: Some(broker), workers: Vec::new(), folder: tempfile::tempdir().unwrap() };
    let broker = rig.broker.as_ref().unwrap();
    let engine = JetStream::connect(&broker.url(), QUEUE, 1, LONG).await.unwrap();
    let service = Service::start_with(&rig.database(), Arc::new(engine)).await;
    let study = started(&service).await;
    while service.trials(study).await.is_empty() {
        tokio::time::sleep(Duration::from_millis(5)).await;
    }
    let ready = service.fetch("/ready").await;
    assert_eq!(ready.status, StatusCode::SERVICE_UNAVAILABLE);
    assert!(ready.text.contains("NATS broker"), "{}", ready.text);
    rig.broker.as_mut().unwrap().restart();
    rig.add_worker(Worker::Steady);
    nothing_is_lost_or_doubled(&service, study).await;
    assert_eq!(service.fetch("/ready").await.text, "ready");
    service.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn queued_job_of_a_wiped_broker_is_dispatched_again_before_its_lease_expires() {
    let Some(broker) = Broker::start() else { return };
    let mut rig = Rig { broker: Some(broker), workers: Vec::new(), folder: tempfile::tempdir().unwrap() };
    let url = rig.broker.as_ref().unwrap().url();
    let engine = JetStream::connect(&url, QUEUE, 1, LONG).await.unwrap();
    let service = Service::start_with(&rig.database(), Arc::new(engine)).await;
    let study = started(&service).await;
    while solve_jobs::depth(&mut service.store.read().await.unwrap()).await.unwrap() != (0, 1) {
        tokio::time::sleep(Duration::from_millis(5)).await;
    }
    // The broker has received the job.
    tokio::time::sleep(Duration::from_secs(2)).await;
    rig.broker.as_mut().unwrap().wipe();
    rig.add_worker(Worker::Steady);
    nothing_is_lost_or_doubled(&service, study).await;
    service.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn refused_job_is_handed_out_again_before_its_lease_expires() {
    let folder = tempfile::tempdir().unwrap();
    let inner = InProcess::new(1, Arc::new(Analytic::default())).with_lease(LONG);
    let engine = Refuses { inner, refusals: AtomicU32::new(1) };
    let service = Service::start_with(&folder.path().join("a.db"), Arc::new(engine)).await;
    let study = started(&service).await;
    nothing_is_lost_or_doubled(&service, study).await;
    service.stop().await;
}

/// An engine that refuses its first jobs.
struct Refuses {
    inner: InProcess,
    refusals: AtomicU32,
}

impl Dispatch for Refuses {
    fn name(&self) -> &'static str {
        self.inner.name()
    }

    fn size(&self) -> usize {
        self.inner.size()
    }

    fn lease(&self) -> Duration {
        self.inner.lease()
    }

    fn outlives_process(&self) -> bool {
        self.inner.outlives_process()
    }

    fn submit(&self, assignment: Assignment) -> BoxFuture<'_, Result<(), DispatchError>> {
        let left = |left: u32| left.checked_sub(1);
        if self.refusals.fetch_update(Ordering::SeqCst, Ordering::SeqCst, left).is_ok() {
            return Box::pin(async { Err(DispatchError::Unreachable("a test refuses".to_owned())) });
        }
        self.inner.submit(assignment)
    }

    fn cancel(&self, trial: TrialId) -> BoxFuture<'_, ()> {
        self.inner.cancel(trial)
    }

    fn next(&self) -> BoxFuture<'_, EngineMessage> {
        self.inner.next()
    }
}

#[derive(Debug, Clone, Copy)]
enum Change {
    /// Every result is delivered twice.
    Twice,
    /// The first result arrives while another attempt is running.
    Late,
}

/// An engine with modified delivery of results.
struct Changed {
    engine: Arc<dyn Dispatch>,
    change: Change,
    held: Mutex<VecDeque<EngineMessage>>,
    /// The held result waits until another attempt is running.
    holds_back: AtomicBool,
}

impl Changed {
    async fn changed(&self) -> EngineMessage {
        loop {
            if !self.holds_back.load(Ordering::SeqCst)
                && let Some(message) = self.held.lock().unwrap().pop_front()
            {
                return message;
            }
            let message = self.engine.next().await;
            let attempt = match &message {
                EngineMessage::Started { attempt, .. }
                | EngineMessage::Iterated { attempt, .. }
                | EngineMessage::Ended { attempt, .. } => *attempt,
            };
            let mut held = self.held.lock().unwrap();
            match (self.change, &message) {
                (Change::Twice, EngineMessage::Ended { worker, result, .. }) => {
                    let (worker, result, receipt) = (worker.clone(), result.clone(), Receipt::not_needed());
                    held.push_back(EngineMessage::Ended { attempt, worker, result, receipt });
                }
                (Change::Late, EngineMessage::Ended { .. })
                    if attempt.number == 1 && self.holds_back.load(Ordering::SeqCst) =>
                {
                    // A broker delivers unacknowledged messages again.
                    held.clear();
                    held.push_back(message);
                    continue;
                }
                (Change::Late, _) if attempt.number == 2 && self.holds_back.swap(false, Ordering::SeqCst) => {
                    held.push_back(message);
                    continue;
                }
                _ => {}
            }
            return message;
        }
    }
}

impl Dispatch for Changed {
    fn name(&self) -> &'static str {
        self.engine.name()
    }

    fn size(&self) -> usize {
        self.engine.size()
    }

    fn lease(&self) -> Duration {
        self.engine.lease()
    }

    fn outlives_process(&self) -> bool {
        self.engine.outlives_process()
    }

    fn submit(&self, assignment: Assignment) -> BoxFuture<'_, Result<(), DispatchError>> {
        self.engine.submit(assignment)
    }

    fn cancel(&self, trial: TrialId) -> BoxFuture<'_, ()> {
        self.engine.cancel(trial)
    }

    fn next(&self) -> BoxFuture<'_, EngineMessage> {
        Box::pin(self.changed())
    }
}

macro_rules! contract {
    ($($clause:ident),* $(,)?) => {
        contract!(@on threads, $($clause),*);
        contract!(@on nats, $($clause),*);
    };
    (@on $rig:ident, $($clause:ident),*) => {
        mod $rig {
            $(#[tokio::test(flavor = "multi_thread")]
            async fn $clause() {
                if let Some(rig) = super::Rig::$rig() {
                    super::$clause(rig).await;
                }
            })*
        }
    };
}

contract!(
    an_undisturbed_study,
    a_worker_that_is_killed,
    a_worker_that_hangs,
    a_result_that_is_brought_twice,
    a_result_that_comes_late,
    a_job_that_is_cancelled,
    an_engine_that_is_restarted,
    an_engine_that_is_wiped,
);
