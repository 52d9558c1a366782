//! The engine of the service for remote workers: publishes jobs, receives heartbeats and results.

use super::broker_connection::{BROKER_HEARTBEAT, BrokerConnection, EXPIRES, RETRY_PAUSE, unreachable};
use super::message::{ResultMessage, Sign, SolveOrder, pack, unpack};
use crate::dispatch_error::DispatchError;
use crate::workers::Assignment;
use crate::workers::dispatch::{Dispatch, EngineMessage, Receipt};
use async_nats::jetstream::stream::{LastRawMessageErrorKind, Stream};
use async_nats::jetstream::{self, AckKind};
use futures_util::StreamExt;
use futures_util::future::BoxFuture;
use gaitwright_compute::Pool;
use gaitwright_store::TrialId;
use std::fmt;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;
use tokio::sync::mpsc::{self, Receiver, Sender};
use tokio::sync::{Mutex, watch};
use tokio_util::sync::{CancellationToken, DropGuard};

/// Length of the queue of messages. Further messages wait in the broker.
const WAITING: usize = 256;

/// Number of deliveries of a result, one per lease, after which it is dropped. Its job was run again long ago.
const MAX_DELIVERIES: i64 = 10;

/// An engine whose jobs are run by remote workers.
pub struct JetStream {
    link: BrokerConnection,
    size: usize,
    messages: Mutex<Receiver<EngineMessage>>,
    /// Threads that compress jobs.
    pool: Pool,
    /// Why the engine does not receive messages, if it does not.
    listening: watch::Receiver<Option<String>>,
    /// Number of storages of the broker since this process started.
    storages: Arc<AtomicU64>,
    _ends: DropGuard,
}

impl JetStream {
    /// Connects to a broker, for at most `size` dispatched jobs. Waits for a broker that is not available yet.
    ///
    /// # Errors
    /// [`DispatchError::Unreachable`] for a malformed address.
    pub async fn connect(url: &str, queue: &str, size: usize, lease: Duration) -> Result<Self, DispatchError> {
        let link = BrokerConnection::open(url, queue, lease).await?;
        let (sender, messages) = mpsc::channel(WAITING);
        let ends = CancellationToken::new();
        let (problem, listening) = watch::channel(Some("The NATS broker is not connected yet.".to_owned()));
        let storages = Arc::<AtomicU64>::default();
        for task in [0, 1] {
            let (link, sender, ends, problem) = (link.clone(), sender.clone(), ends.clone(), problem.clone());
            let mut storage = Storage { created: None, count: Arc::clone(&storages) };
            tokio::spawn(ends.run_until_cancelled_owned(async move {
                loop {
                    let ended = match task {
                        0 => signs(&link, &sender).await,
                        _ => results(&link, &sender, &problem, &mut storage).await,
                    };
                    if let Err(error) = ended {
                        tracing::warn!(broker = %link.address, %error, "cannot receive messages from workers; retrying");
                        if task == 1 {
                            problem.send_replace(Some(error.to_string()));
                        }
                    }
                    tokio::time::sleep(RETRY_PAUSE).await;
                }
            }));
        }
        Ok(Self {
            link,
            size: size.max(1),
            messages: Mutex::new(messages),
            pool: Pool::default(),
            listening,
            storages,
            _ends: ends.drop_guard(),
        })
    }

    async fn publish(&self, assignment: Assignment) -> Result<(), DispatchError> {
        let subject = self.link.job_subject(assignment.attempt);
        let order = SolveOrder::from_this_version(assignment);
        let bytes = self.pool.run(move |_| pack(&order)).await.map_err(unreachable)??;
        self.link.fits("A job", &bytes)?;
        let jobs = self.link.jobs().await?;
        match jobs.get_last_raw_message_by_subject(&subject).await {
            // Already queued, or held by a worker.
            Ok(_) => return Ok(()),
            Err(error) if error.kind() == LastRawMessageErrorKind::NoMessageFound => {}
            Err(error) => return Err(unreachable(error)),
        }
        let acknowledged = self.link.context.publish(subject, bytes.into()).await.map_err(unreachable)?;
        acknowledged.await.map(drop).map_err(unreachable)
    }

    async fn recall(&self, trial: TrialId) -> Result<(), DispatchError> {
        let client = self.link.context.client();
        client.publish(self.link.cancel_subject(), trial.to_string().into()).await.map_err(unreachable)?;
        self.link.jobs().await?.purge().filter(self.link.jobs_of(trial)).await.map(drop).map_err(unreachable)
    }
}

impl Dispatch for JetStream {
    fn name(&self) -> &'static str {
        "nats"
    }

    fn size(&self) -> usize {
        self.size
    }

    fn lease(&self) -> Duration {
        self.link.lease
    }

    fn problem(&self) -> Option<String> {
        self.link.problem().or_else(|| self.listening.borrow().clone())
    }

    fn outlives_process(&self) -> bool {
        true
    }

    fn storages(&self) -> u64 {
        self.storages.load(Ordering::Relaxed)
    }

    fn submit(&self, assignment: Assignment) -> BoxFuture<'_, Result<(), DispatchError>> {
        Box::pin(self.publish(assignment))
    }

    fn cancel(&self, trial: TrialId) -> BoxFuture<'_, ()> {
        Box::pin(async move {
            if let Err(error) = self.recall(trial).await {
                // Its result will arrive late and be ignored.
                tracing::warn!(broker = %self.link.address, %trial, %error, "cannot remove a job from the broker");
            }
        })
    }

    fn next(&self) -> BoxFuture<'_, EngineMessage> {
        Box::pin(async move {
            match self.messages.lock().await.recv().await {
                Some(message) => message,
                // Unreachable: the receiving tasks live as long as this engine.
                None => std::future::pending().await,
            }
        })
    }
}

impl fmt::Debug for JetStream {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("JetStream").field("link", &self.link).field("size", &self.size).finish_non_exhaustive()
    }
}

/// The storage of the broker, known by the time at which its stream of jobs was created.
struct Storage {
    created: Option<i128>,
    /// Number of storages so far.
    count: Arc<AtomicU64>,
}

impl Storage {
    /// Counts the storage of this stream of jobs, unless it is the known one.
    fn note(&mut self, jobs: &Stream) {
        let created = jobs.cached_info().created.unix_timestamp_nanos();
        if self.created.replace(created) != Some(created) {
            self.count.fetch_add(1, Ordering::Relaxed);
        }
    }
}

/// The error after the service has stopped receiving.
fn gone<T>(_: T) -> DispatchError {
    DispatchError::Unreachable("The service is shutting down.".to_owned())
}

/// Forwards heartbeats until the subscription ends.
async fn signs(link: &BrokerConnection, sender: &Sender<EngineMessage>) -> Result<(), DispatchError> {
    let mut signs = link.context.client().subscribe(link.sign_subject()).await.map_err(unreachable)?;
    while let Some(message) = signs.next().await {
        match unpack::<Sign>(&message.payload) {
            Ok(Sign { attempt, worker, records }) if records.is_empty() => {
                sender.send(EngineMessage::Started { attempt, worker }).await.map_err(gone)?;
            }
            Ok(Sign { attempt, records, .. }) => {
                for record in records {
                    sender.send(EngineMessage::Iterated { attempt, record }).await.map_err(gone)?;
                }
            }
            Err(error) => tracing::warn!(%error, "ignoring a malformed heartbeat"),
        }
    }
    Ok(())
}

/// Forwards results until the broker reports an error.
async fn results(
    link: &BrokerConnection,
    sender: &Sender<EngineMessage>,
    problem: &watch::Sender<Option<String>>,
    storage: &mut Storage,
) -> Result<(), DispatchError> {
    let pool = Pool::default();
    let recorder = link.recorder().await?;
    let messages = recorder.stream().max_messages_per_batch(16).expires(EXPIRES).heartbeat(BROKER_HEARTBEAT);
    let mut messages = messages.messages().await.map_err(unreachable)?;
    storage.note(&link.jobs().await?);
    problem.send_replace(None);
    while let Some(message) = messages.next().await {
        let message = message.map_err(unreachable)?;
        deliver(message, sender, &pool).await?;
    }
    Ok(())
}

async fn deliver(
    message: jetstream::Message,
    sender: &Sender<EngineMessage>,
    pool: &Pool,
) -> Result<(), DispatchError> {
    let delivered = message.info().map_or(1, |info| info.delivered);
    let (message, acker) = message.split();
    if delivered > MAX_DELIVERIES {
        tracing::error!(subject = %message.subject, "recording a result failed {MAX_DELIVERIES} times; discarding it");
        return acker.ack_with(AckKind::Term).await.map_err(unreachable);
    }
    let read = pool.run(move |_| unpack::<ResultMessage>(&message.payload)).await.map_err(unreachable)?;
    let brought = match read {
        Ok(brought) => brought,
        Err(error) => {
            tracing::error!(%error, "ignoring a malformed result");
            return acker.ack_with(AckKind::Term).await.map_err(unreachable);
        }
    };
    let receipt = Receipt::new(async move {
        if let Err(error) = acker.double_ack().await {
            // The result will be delivered again, and recognised.
            tracing::warn!(%error, "cannot acknowledge a result to the broker");
        }
    });
    let ResultMessage { attempt, worker, result } = brought;
    sender.send(EngineMessage::Ended { attempt, worker, result, receipt }).await.map_err(gone)
}
