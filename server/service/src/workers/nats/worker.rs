//! The remote worker: pulls jobs from the broker, solves them on its own threads, and publishes heartbeats and results.

use super::broker_connection::{BrokerConnection, RETRY_PAUSE, unreachable};
use super::message::{ResultMessage, Sign, SolveOrder, pack, unpack};
use super::same_version::PROGRAM;
use crate::dispatch_error::DispatchError;
use crate::workers::dispatch::{AssignmentResult, Attempt, Dispatch, EngineMessage};
use crate::workers::{Evaluate, InProcess};
use async_nats::jetstream::message::Acker;
use async_nats::jetstream::{self, AckKind};
use futures_util::StreamExt;
use gait_optimizer::IterationRecord;
use gaitwright_compute::Pool;
use gaitwright_store::TrialId;
use std::collections::HashMap;
use std::sync::Arc;
use std::time::{Duration, Instant};
use tokio::sync::mpsc::{self, Sender};
use tokio::sync::{OwnedSemaphorePermit, Semaphore};
use tokio_util::sync::CancellationToken;
use tokio_util::task::TaskTracker;

/// How long the broker holds a request for one job.
const PULL_TIMEOUT: Duration = Duration::from_secs(5);
/// Time to publish remaining results when the worker stops.
const DRAIN: Duration = Duration::from_secs(20);
/// Number of leases after which an unpublished result is dropped. By then its job is lost or runs elsewhere.
const MAX_UNPUBLISHED_LEASES: u32 = 10;
/// Longest pause before publishing a result is retried.
const MAX_PAUSE: Duration = Duration::from_secs(15);
/// Least time between two heartbeats of a solve.
const HEARTBEAT_INTERVAL: Duration = Duration::from_millis(300);

/// Runs jobs of a broker.
pub struct NatsWorker {
    link: BrokerConnection,
    name: String,
    engine: InProcess,
    slots: Arc<Semaphore>,
    results: TaskTracker,
    /// Threads that compress results.
    pool: Pool,
}

/// A job that this worker holds.
struct HeldJob {
    number: u32,
    acker: Acker,
    /// Iterations that are not sent yet.
    unreported: Vec<IterationRecord>,
    /// Time of the last iteration.
    last_renewal: Instant,
    last_sign: Instant,
    permit: OwnedSemaphorePermit,
}

type PulledJob = (jetstream::Message, OwnedSemaphorePermit);

impl NatsWorker {
    /// Connects to a broker, for at most `size` parallel jobs. Waits for a broker that is not available yet.
    ///
    /// # Errors
    /// [`DispatchError::Unreachable`] for a malformed address.
    pub async fn connect(
        url: &str,
        queue: &str,
        name: String,
        size: usize,
        lease: Duration,
        evaluate: Arc<dyn Evaluate>,
    ) -> Result<Self, DispatchError> {
        let link = BrokerConnection::open(url, queue, lease).await?;
        let slots = Arc::new(Semaphore::new(size.max(1)));
        let engine = InProcess::new(size, evaluate);
        Ok(Self { link, name, engine, slots, results: TaskTracker::new(), pool: Pool::default() })
    }

    /// Runs until `stop`. Running jobs then return to the broker.
    ///
    /// # Errors
    /// When the broker refuses the subscription to cancellations.
    pub async fn run(&self, stop: CancellationToken) -> Result<(), DispatchError> {
        let mut held: HashMap<TrialId, HeldJob> = HashMap::new();
        let (sender, mut jobs) = mpsc::channel(1);
        let mut cancels =
            self.link.context.client().subscribe(self.link.cancel_subject()).await.map_err(unreachable)?;
        let puller = stop.run_until_cancelled(self.pull(sender));
        tokio::pin!(puller);
        let mut watch = tokio::time::interval(self.link.ack_wait() / 4);
        loop {
            tokio::select! {
                _ = &mut puller => break,
                Some(job) = jobs.recv() => self.take(&mut held, job).await,
                event = self.engine.next() => self.receive(&mut held, event).await,
                Some(message) = cancels.next() => {
                    let trial = std::str::from_utf8(&message.payload).ok().and_then(|text| text.parse().ok());
                    if let Some(trial) = trial {
                        self.drop_job(&mut held, trial, AckKind::Term).await;
                    }
                }
                _ = watch.tick() => self.give_up_hanging(&mut held).await,
            }
        }
        for trial in held.keys().copied().collect::<Vec<_>>() {
            self.drop_job(&mut held, trial, AckKind::Nak(None)).await;
        }
        self.results.close();
        if tokio::time::timeout(DRAIN, self.results.wait()).await.is_err() {
            tracing::warn!("a result was not published; its job will be run again");
        }
        Ok(())
    }

    /// Pulls a job whenever a slot is free.
    async fn pull(&self, jobs: Sender<PulledJob>) {
        while let Ok(permit) = Arc::clone(&self.slots).acquire_owned().await {
            let mut slot = Some(permit);
            while let Some(permit) = slot.take() {
                match self.pull_one().await {
                    Ok(Some(message)) => {
                        if jobs.send((message, permit)).await.is_err() {
                            return;
                        }
                    }
                    Ok(None) => slot = Some(permit),
                    Err(error) => {
                        tracing::warn!(broker = %self.link.address, %error, "cannot pull a job; retrying");
                        tokio::time::sleep(RETRY_PAUSE).await;
                        slot = Some(permit);
                    }
                }
            }
        }
    }

    async fn pull_one(&self) -> Result<Option<jetstream::Message>, DispatchError> {
        let consumer = self.link.workers().await?;
        let mut batch = consumer.batch().max_messages(1).expires(PULL_TIMEOUT).messages().await.map_err(unreachable)?;
        batch.next().await.transpose().map_err(unreachable)
    }

    async fn take(&self, held: &mut HashMap<TrialId, HeldJob>, (message, permit): PulledJob) {
        let (message, acker) = message.split();
        let order = match unpack::<SolveOrder>(&message.payload) {
            Ok(order) => order,
            Err(error) => {
                tracing::error!(%error, "ignoring a malformed job");
                return answer(&acker, AckKind::Term).await;
            }
        };
        if !order.is_of_this_version() {
            tracing::error!(
                theirs = order.program,
                ours = PROGRAM,
                "ignoring a job from another version of the program"
            );
            return answer(&acker, AckKind::Nak(Some(self.link.lease))).await;
        }
        let attempt = order.assignment.attempt;
        // The broker redelivers jobs without heartbeats, so an older solve of this trial is obsolete.
        self.engine.cancel(attempt.trial).await;
        tracing::info!(trial = %attempt.trial, attempt = attempt.number, "started a job");
        if let Err(error) = self.engine.submit(order.assignment).await {
            tracing::error!(%error, "cannot start a job; leaving it to other workers");
            return answer(&acker, AckKind::Nak(Some(RETRY_PAUSE))).await;
        }
        let now = Instant::now();
        let job = HeldJob {
            number: attempt.number,
            acker,
            unreported: Vec::new(),
            last_renewal: now,
            last_sign: now,
            permit,
        };
        held.insert(attempt.trial, job);
    }

    async fn receive(&self, held: &mut HashMap<TrialId, HeldJob>, event: EngineMessage) {
        match event {
            EngineMessage::Started { attempt, .. } => self.tell(attempt, Vec::new()).await,
            EngineMessage::Iterated { attempt, record } => {
                let Some(job) = held.get_mut(&attempt.trial).filter(|job| job.number == attempt.number) else { return };
                let now = Instant::now();
                job.unreported.push(record);
                job.last_renewal = now;
                if now.duration_since(job.last_sign) >= HEARTBEAT_INTERVAL.min(self.link.ack_wait() / 4) {
                    job.last_sign = now;
                    answer(&job.acker, AckKind::Progress).await;
                    let records = std::mem::take(&mut job.unreported);
                    self.tell(attempt, records).await;
                }
            }
            EngineMessage::Ended { attempt, result, .. } => {
                if held.get(&attempt.trial).is_some_and(|job| job.number == attempt.number)
                    && let Some(job) = held.remove(&attempt.trial)
                {
                    self.results.spawn(deliver(
                        self.link.clone(),
                        self.pool.clone(),
                        self.name.clone(),
                        attempt,
                        result,
                        job,
                    ));
                }
            }
        }
    }

    /// Returns jobs whose solve makes no progress.
    async fn give_up_hanging(&self, held: &mut HashMap<TrialId, HeldJob>) {
        let hangs = |job: &HeldJob| job.last_renewal.elapsed() > self.link.ack_wait();
        let hanging: Vec<TrialId> = held.iter().filter(|(_, job)| hangs(job)).map(|(trial, _)| *trial).collect();
        for trial in hanging {
            tracing::warn!(%trial, "a solve is hanging; returning its job");
            self.drop_job(held, trial, AckKind::Nak(None)).await;
        }
    }

    async fn drop_job(&self, held: &mut HashMap<TrialId, HeldJob>, trial: TrialId, kind: AckKind) {
        if let Some(job) = held.remove(&trial) {
            self.engine.cancel(trial).await;
            answer(&job.acker, kind).await;
        }
    }

    async fn tell(&self, attempt: Attempt, records: Vec<IterationRecord>) {
        let sign = Sign { attempt, worker: self.name.clone(), records };
        let sent = match pack(&sign) {
            Ok(bytes) => {
                let client = self.link.context.client();
                client.publish(self.link.sign_subject(), bytes.into()).await.map_err(unreachable)
            }
            Err(error) => Err(error),
        };
        if let Err(error) = sent {
            tracing::warn!(%error, "cannot send a heartbeat");
        }
    }
}

/// Publishes a result, with retries, then acknowledges the job. A result that cannot be published is dropped: its slot
/// is freed and its job left to other workers.
async fn deliver(
    link: BrokerConnection,
    pool: Pool,
    worker: String,
    attempt: Attempt,
    result: AssignmentResult,
    job: HeldJob,
) {
    let HeldJob { acker, permit, .. } = job;
    let brought = ResultMessage { attempt, worker, result };
    let bytes = pool.run(move |_| {
        let fits = |bytes: Vec<u8>| link.fits("A result", &bytes).map(|()| bytes);
        let bytes = pack(&brought)
            .and_then(fits)
            .or_else(|error| pack(&ResultMessage { result: AssignmentResult::Broke(error.to_string()), ..brought }));
        (link, bytes)
    });
    let Ok((link, bytes)) = bytes.await else { return };
    match bytes {
        Ok(bytes) => {
            if let Err(error) = publish_within(&link, attempt, &bytes, link.lease * MAX_UNPUBLISHED_LEASES).await {
                tracing::error!(trial = %attempt.trial, %error, "dropping a result; leaving its job to other workers");
                // After a pause, because a redelivered job comes before all queued ones.
                return answer(&acker, AckKind::Nak(Some(link.lease))).await;
            }
            if let Err(error) = acker.double_ack().await {
                tracing::warn!(%error, "cannot acknowledge a completed job; it will be run again");
            }
        }
        Err(error) => tracing::error!(%error, "cannot serialise a result"),
    }
    drop(permit);
}

/// Publishes a result, with retries and growing pauses until `limit`.
async fn publish_within(
    link: &BrokerConnection,
    attempt: Attempt,
    bytes: &[u8],
    limit: Duration,
) -> Result<(), DispatchError> {
    let begun = Instant::now();
    let mut pause = RETRY_PAUSE;
    loop {
        match publish(link, attempt, bytes).await {
            Err(error) if begun.elapsed() < limit => {
                tracing::warn!(trial = %attempt.trial, %error, "cannot publish a result; retrying");
                tokio::time::sleep(pause).await;
                pause = (pause * 2).min(MAX_PAUSE);
            }
            done => return done,
        }
    }
}

async fn publish(link: &BrokerConnection, attempt: Attempt, bytes: &[u8]) -> Result<(), DispatchError> {
    link.results().await?;
    let acknowledged =
        link.context.publish(link.result_subject(attempt), bytes.to_vec().into()).await.map_err(unreachable)?;
    acknowledged.await.map(drop).map_err(unreachable)
}

async fn answer(acker: &Acker, kind: AckKind) {
    if let Err(error) = acker.ack_with(kind).await {
        tracing::warn!(%error, "cannot acknowledge a job; the broker will give it to another worker");
    }
}
