//! The worker's end: asks for jobs, solves them on threads of its own, tells how far they are, brings the results.

use super::message::{Brought, Order, PROGRAM, Sign, pack, unpack};
use super::{AGAIN, Link, unreachable};
use crate::workers::dispatch::{Attempt, Dispatch, DispatchError, Finding, News};
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
const PULL: Duration = Duration::from_secs(5);
/// Results that were not brought when the worker is told to stop have so long to reach the broker.
const DRAIN: Duration = Duration::from_secs(20);
/// A result that the broker refuses for so many leases is given up: by then its job is lost or run elsewhere.
const GIVE_UP_AFTER_LEASES: u32 = 10;
/// Longest pause before a result is brought again.
const LONGEST_PAUSE: Duration = Duration::from_secs(15);
/// Signs of life are not sent more often than this, however fast the iterations are.
const SIGN_EVERY: Duration = Duration::from_millis(300);

/// Runs jobs of a broker.
pub struct Worker {
    link: Link,
    name: String,
    engine: InProcess,
    slots: Arc<Semaphore>,
    results: TaskTracker,
    /// Packs results.
    pool: Pool,
}

/// A job that was taken from the broker.
struct Held {
    number: u32,
    acker: Acker,
    /// Iterations that were not sent yet.
    untold: Vec<IterationRecord>,
    /// When the solve last came further.
    lived: Instant,
    told: Instant,
    permit: OwnedSemaphorePermit,
}

type Job = (jetstream::Message, OwnedSemaphorePermit);

impl Worker {
    /// Runs at most `size` jobs of a broker at the same time. A broker that is not there yet is waited for.
    ///
    /// # Errors
    /// [`DispatchError::Unreachable`] for an address that is none.
    pub async fn connect(
        url: &str,
        queue: &str,
        name: String,
        size: usize,
        lease: Duration,
        evaluate: Arc<dyn Evaluate>,
    ) -> Result<Self, DispatchError> {
        let link = Link::open(url, queue, lease).await?;
        let slots = Arc::new(Semaphore::new(size.max(1)));
        let engine = InProcess::new(size, evaluate);
        Ok(Self { link, name, engine, slots, results: TaskTracker::new(), pool: Pool::default() })
    }

    /// Works until told to stop; jobs that run then are given back to the broker.
    ///
    /// # Errors
    /// When the broker refuses the subscription to cancellations.
    pub async fn run(&self, stop: CancellationToken) -> Result<(), DispatchError> {
        let mut held: HashMap<TrialId, Held> = HashMap::new();
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
                news = self.engine.next() => self.hear(&mut held, news).await,
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
            tracing::warn!("a result did not reach the broker; its job will be run again");
        }
        Ok(())
    }

    /// Asks for a job whenever a slot is free.
    async fn pull(&self, jobs: Sender<Job>) {
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
                        tracing::warn!(%error, "asking for a job; trying again");
                        tokio::time::sleep(AGAIN).await;
                        slot = Some(permit);
                    }
                }
            }
        }
    }

    async fn pull_one(&self) -> Result<Option<jetstream::Message>, DispatchError> {
        let consumer = self.link.workers().await?;
        let mut batch = consumer.batch().max_messages(1).expires(PULL).messages().await.map_err(unreachable)?;
        batch.next().await.transpose().map_err(unreachable)
    }

    async fn take(&self, held: &mut HashMap<TrialId, Held>, (message, permit): Job) {
        let (message, acker) = message.split();
        let order = match unpack::<Order>(&message.payload) {
            Ok(order) => order,
            Err(error) => {
                tracing::error!(%error, "a job cannot be read; it is left out");
                return answer(&acker, AckKind::Term).await;
            }
        };
        if order.program != PROGRAM {
            tracing::error!(theirs = order.program, ours = PROGRAM, "a job of another version; it is left to others");
            return answer(&acker, AckKind::Nak(Some(self.link.lease))).await;
        }
        let attempt = order.assignment.attempt;
        // The broker gives a job anew that was silent: what hangs here is nobody's business any more.
        self.engine.withdraw(attempt.trial).await;
        tracing::info!(trial = %attempt.trial, attempt = attempt.number, "took a job");
        if let Err(error) = self.engine.submit(order.assignment).await {
            tracing::error!(%error, "a job cannot be begun; it is left to others");
            return answer(&acker, AckKind::Nak(Some(AGAIN))).await;
        }
        let now = Instant::now();
        let job = Held { number: attempt.number, acker, untold: Vec::new(), lived: now, told: now, permit };
        held.insert(attempt.trial, job);
    }

    async fn hear(&self, held: &mut HashMap<TrialId, Held>, news: News) {
        match news {
            News::Started { attempt, .. } => self.tell(attempt, Vec::new()).await,
            News::Iterated { attempt, record } => {
                let Some(job) = held.get_mut(&attempt.trial).filter(|job| job.number == attempt.number) else { return };
                let now = Instant::now();
                job.untold.push(record);
                job.lived = now;
                if now.duration_since(job.told) >= SIGN_EVERY.min(self.link.ack_wait() / 4) {
                    job.told = now;
                    answer(&job.acker, AckKind::Progress).await;
                    let records = std::mem::take(&mut job.untold);
                    self.tell(attempt, records).await;
                }
            }
            News::Ended { attempt, finding, .. } => {
                if held.get(&attempt.trial).is_some_and(|job| job.number == attempt.number)
                    && let Some(job) = held.remove(&attempt.trial)
                {
                    self.results.spawn(bring(
                        self.link.clone(),
                        self.pool.clone(),
                        self.name.clone(),
                        attempt,
                        finding,
                        job,
                    ));
                }
            }
        }
    }

    /// Gives the jobs back whose solve does not come further.
    async fn give_up_hanging(&self, held: &mut HashMap<TrialId, Held>) {
        let hangs = |job: &Held| job.lived.elapsed() > self.link.ack_wait();
        let hanging: Vec<TrialId> = held.iter().filter(|(_, job)| hangs(job)).map(|(trial, _)| *trial).collect();
        for trial in hanging {
            tracing::warn!(%trial, "a solve hangs; its job is given back");
            self.drop_job(held, trial, AckKind::Nak(None)).await;
        }
    }

    async fn drop_job(&self, held: &mut HashMap<TrialId, Held>, trial: TrialId, kind: AckKind) {
        if let Some(job) = held.remove(&trial) {
            self.engine.withdraw(trial).await;
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
            tracing::warn!(%error, "a sign of life was not sent");
        }
    }
}

/// Publishes a result, again and again with longer pauses where the broker refuses it, then says that the job is done. A result
/// that cannot be brought is given up, its slot freed and its job left to others.
async fn bring(link: Link, pool: Pool, worker: String, attempt: Attempt, finding: Finding, job: Held) {
    let Held { acker, permit, .. } = job;
    let brought = Brought { attempt, worker, finding };
    let bytes = pool.run(move |_| {
        let fits = |bytes: Vec<u8>| link.fits("a result", &bytes).map(|()| bytes);
        let bytes = pack(&brought)
            .and_then(fits)
            .or_else(|error| pack(&Brought { finding: Finding::Broke(error.to_string()), ..brought }));
        (link, bytes)
    });
    let Ok((link, bytes)) = bytes.await else { return };
    match bytes {
        Ok(bytes) => {
            if let Err(error) = publish_within(&link, attempt, &bytes, link.lease * GIVE_UP_AFTER_LEASES).await {
                tracing::error!(trial = %attempt.trial, %error, "a result is given up; its job is left to others");
                // After a pause: a job that is given anew comes before all that wait.
                return answer(&acker, AckKind::Nak(Some(link.lease))).await;
            }
            if let Err(error) = acker.double_ack().await {
                tracing::warn!(%error, "the broker does not know that a job is done; it will be run again in vain");
            }
        }
        Err(error) => tracing::error!(%error, "a result cannot be written"),
    }
    drop(permit);
}

/// Publishes a result, tried again with longer and longer pauses until `limit`.
async fn publish_within(link: &Link, attempt: Attempt, bytes: &[u8], limit: Duration) -> Result<(), DispatchError> {
    let begun = Instant::now();
    let mut pause = AGAIN;
    loop {
        match publish(link, attempt, bytes).await {
            Err(error) if begun.elapsed() < limit => {
                tracing::warn!(trial = %attempt.trial, %error, "a result did not reach the broker; trying again");
                tokio::time::sleep(pause).await;
                pause = (pause * 2).min(LONGEST_PAUSE);
            }
            done => return done,
        }
    }
}

async fn publish(link: &Link, attempt: Attempt, bytes: &[u8]) -> Result<(), DispatchError> {
    link.results().await?;
    let acknowledged =
        link.context.publish(link.result_subject(attempt), bytes.to_vec().into()).await.map_err(unreachable)?;
    acknowledged.await.map(drop).map_err(unreachable)
}

async fn answer(acker: &Acker, kind: AckKind) {
    if let Err(error) = acker.ack_with(kind).await {
        tracing::warn!(%error, "a job could not be acknowledged; the broker gives it to another worker");
    }
}
