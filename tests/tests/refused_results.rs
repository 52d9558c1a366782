//! Results that the broker or the record refuses: each side retries for a while, then gives up.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use async_nats::jetstream::stream::{Config, RetentionPolicy};
use gait_optimizer::{GaitProblem, SolveOptions, Subject};
use gaitwright_service::workers::nats::{JetStream, NatsWorker, ResultMessage, pack};
use gaitwright_service::workers::{Assignment, AssignmentResult, Attempt, Dispatch, EngineMessage, Evaluate};
use gaitwright_store::TrialId;
use gaitwright_tests::analytic::Analytic;
use gaitwright_tests::broker::Broker;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};
use tokio_util::sync::CancellationToken;

const QUEUE: &str = "refusing";
const LEASE: Duration = Duration::from_millis(600);
/// A worker gives up after ten leases, and an attempt within its longest pause.
const LONGEST: Duration = Duration::from_secs(20);

fn job(number: u32) -> Assignment {
    let problem = GaitProblem::new(Subject::builtin(1).unwrap(), false).unwrap();
    let attempt = Attempt { trial: TrialId::fresh(), number: 1 };
    Assignment { attempt, number, problem, warm_start: None, options: SolveOptions::default() }
}

#[tokio::test(flavor = "multi_thread")]
async fn unrecordable_result_is_delivered_ten_times_and_then_dropped() {
    let Some(broker) = Broker::start() else { return };
    let engine = JetStream::connect(&broker.url(), QUEUE, 1, Duration::from_millis(200)).await.unwrap();
    let context = async_nats::jetstream::new(async_nats::connect(broker.url()).await.unwrap());
    let attempt = job(1).attempt;
    let brought =
        ResultMessage { attempt, worker: "w".to_owned(), result: AssignmentResult::Broke("as asked".to_owned()) };
    let stream = loop {
        match context.get_stream(format!("{QUEUE}-results")).await {
            Ok(stream) => break stream,
            Err(_) => tokio::time::sleep(Duration::from_millis(20)).await,
        }
    };
    let subject = format!("{QUEUE}.result.{}.1", attempt.trial);
    context.publish(subject, pack(&brought).unwrap().into()).await.unwrap().await.unwrap();
    let begun = Instant::now();
    let mut deliveries = 0;
    while stream.get_info().await.unwrap().state.messages > 0 {
        assert!(begun.elapsed() < LONGEST, "delivered {deliveries} times");
        // The result is not acknowledged.
        if tokio::time::timeout(Duration::from_millis(50), engine.next()).await.is_ok() {
            deliveries += 1;
        }
    }
    assert_eq!(deliveries, 10);
}

#[tokio::test(flavor = "multi_thread")]
async fn worker_gives_up_a_refused_result_and_takes_the_next_job() {
    let Some(broker) = Broker::start() else { return };
    let context = async_nats::jetstream::new(async_nats::connect(broker.url()).await.unwrap());
    let results = |largest| Config {
        name: format!("{QUEUE}-results"),
        subjects: vec![format!("{QUEUE}.result.>")],
        retention: RetentionPolicy::WorkQueue,
        max_message_size: largest,
        ..Config::default()
    };
    context.create_stream(results(10)).await.unwrap();
    let engine = JetStream::connect(&broker.url(), QUEUE, 2, LEASE).await.unwrap();
    let solver = Arc::new(Analytic::slow(Duration::from_millis(2)));
    let evaluate = Arc::clone(&solver) as Arc<dyn Evaluate>;
    let worker = NatsWorker::connect(&broker.url(), QUEUE, "w".to_owned(), 1, LEASE, evaluate).await.unwrap();
    let stop = CancellationToken::new();
    let running = tokio::spawn({
        let stop = stop.clone();
        async move { Box::pin(worker.run(stop)).await }
    });
    let jobs = [job(1), job(2)];
    for job in &jobs {
        // The connection may not be there yet.
        while engine.submit(job.clone()).await.is_err() {
            tokio::time::sleep(Duration::from_millis(20)).await;
        }
    }
    let begun = Instant::now();
    let solved = || {
        let made = solver.made.lock().unwrap();
        jobs.iter().filter(|job| made.contains(&job.attempt.trial)).count()
    };
    while solved() < 2 {
        let attempts = solver.begun.load(Ordering::SeqCst);
        assert!(begun.elapsed() < LONGEST, "a result that nobody takes keeps other jobs waiting: {attempts} solves");
        tokio::time::sleep(Duration::from_millis(20)).await;
    }
    assert!(begun.elapsed() > 5 * LEASE, "it tried for a while: {:?}", begun.elapsed());
    let attempts = solver.begun.load(Ordering::SeqCst);
    assert!(attempts <= 4, "{attempts} solves in {:?}", begun.elapsed());

    // When the broker takes results again, both jobs come to their end.
    context.update_stream(results(-1)).await.unwrap();
    let mut ended = Vec::new();
    while ended.len() < 2 {
        let next = tokio::time::timeout(2 * LONGEST, engine.next()).await.expect("no result comes");
        if let EngineMessage::Ended { attempt, receipt, .. } = next {
            receipt.sign().await;
            if !ended.contains(&attempt.trial) {
                ended.push(attempt.trial);
            }
        }
    }
    assert!(jobs.iter().all(|job| ended.contains(&job.attempt.trial)));
    stop.cancel();
    running.await.unwrap().unwrap();
}
