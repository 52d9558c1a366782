//! The service's end: jobs out, signs of life and results in.

use super::message::{Brought, Order, PROGRAM, Sign, pack, unpack};
use super::{AGAIN, BROKER_HEARTBEAT, EXPIRES, Link, unreachable};
use crate::workers::Assignment;
use crate::workers::dispatch::{Dispatch, DispatchError, News, Receipt};
use async_nats::jetstream::stream::LastRawMessageErrorKind;
use async_nats::jetstream::{self, AckKind};
use futures_util::StreamExt;
use futures_util::future::BoxFuture;
use gaitwright_compute::Pool;
use gaitwright_store::TrialId;
use std::fmt;
use std::time::Duration;
use tokio::sync::mpsc::{self, Receiver, Sender};
use tokio::sync::{Mutex, watch};
use tokio_util::sync::{CancellationToken, DropGuard};

/// News that wait for the service; more wait in the broker.
const WAITING: usize = 256;

/// A result that could not be recorded so often, a lease after the other, is left out: its job was run again long ago.
const MOST_DELIVERIES: i64 = 10;

/// Jobs are run by whoever asks a NATS broker for them.
pub struct JetStream {
    link: Link,
    size: usize,
    heard: Mutex<Receiver<News>>,
    /// Packs jobs.
    pool: Pool,
    /// Why nothing is heard of workers; none: it is.
    listening: watch::Receiver<Option<String>>,
    _ends: DropGuard,
}

impl JetStream {
    /// Hands jobs to a broker, at most `size` at the same time. A broker that is not there yet is waited for.
    ///
    /// # Errors
    /// [`DispatchError::Unreachable`] for an address that is none.
    pub async fn connect(url: &str, queue: &str, size: usize, lease: Duration) -> Result<Self, DispatchError> {
        let link = Link::open(url, queue, lease).await?;
        let (news, heard) = mpsc::channel(WAITING);
        let ends = CancellationToken::new();
        let (trouble, listening) = watch::channel(None);
        for task in [0, 1] {
            let (link, news, ends, trouble) = (link.clone(), news.clone(), ends.clone(), trouble.clone());
            tokio::spawn(ends.run_until_cancelled_owned(async move {
                loop {
                    let ended = match task {
                        0 => signs(&link, &news).await,
                        _ => results(&link, &news, &trouble).await,
                    };
                    if let Err(error) = ended {
                        tracing::warn!(%error, "listening to workers; trying again");
                        if task == 1 {
                            trouble.send_replace(Some(error.to_string()));
                        }
                    }
                    tokio::time::sleep(AGAIN).await;
                }
            }));
        }
        Ok(Self {
            link,
            size: size.max(1),
            heard: Mutex::new(heard),
            pool: Pool::default(),
            listening,
            _ends: ends.drop_guard(),
        })
    }

    async fn publish(&self, assignment: Assignment) -> Result<(), DispatchError> {
        let subject = self.link.job_subject(assignment.attempt);
        let order = Order { program: PROGRAM.to_owned(), assignment };
        let bytes = self.pool.run(move |_| pack(&order)).await.map_err(unreachable)??;
        self.link.fits("a job", &bytes)?;
        let jobs = self.link.jobs().await?;
        match jobs.get_last_raw_message_by_subject(&subject).await {
            // It waits already, or a worker has it.
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

    fn trouble(&self) -> Option<String> {
        self.link.trouble().or_else(|| self.listening.borrow().clone())
    }

    fn outlives_process(&self) -> bool {
        true
    }

    fn submit(&self, assignment: Assignment) -> BoxFuture<'_, Result<(), DispatchError>> {
        Box::pin(self.publish(assignment))
    }

    fn withdraw(&self, trial: TrialId) -> BoxFuture<'_, ()> {
        Box::pin(async move {
            if let Err(error) = self.recall(trial).await {
                // Its result will come late, and not count.
                tracing::warn!(%trial, %error, "a job cannot be taken back from the broker");
            }
        })
    }

    fn next(&self) -> BoxFuture<'_, News> {
        Box::pin(async move {
            match self.heard.lock().await.recv().await {
                Some(news) => news,
                // The listening tasks live as long as this engine.
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

/// The service went away.
fn gone<T>(_: T) -> DispatchError {
    DispatchError::Unreachable("nobody listens".to_owned())
}

/// Tells signs of life until the subscription ends.
async fn signs(link: &Link, news: &Sender<News>) -> Result<(), DispatchError> {
    let mut signs = link.context.client().subscribe(link.sign_subject()).await.map_err(unreachable)?;
    while let Some(message) = signs.next().await {
        match unpack::<Sign>(&message.payload) {
            Ok(Sign { attempt, worker, records }) if records.is_empty() => {
                news.send(News::Started { attempt, worker }).await.map_err(gone)?;
            }
            Ok(Sign { attempt, records, .. }) => {
                for record in records {
                    news.send(News::Iterated { attempt, record }).await.map_err(gone)?;
                }
            }
            Err(error) => tracing::warn!(%error, "a sign of life cannot be read"),
        }
    }
    Ok(())
}

/// Brings results until the broker refuses.
async fn results(
    link: &Link,
    news: &Sender<News>,
    trouble: &watch::Sender<Option<String>>,
) -> Result<(), DispatchError> {
    let pool = Pool::default();
    let recorder = link.recorder().await?;
    let messages = recorder.stream().max_messages_per_batch(16).expires(EXPIRES).heartbeat(BROKER_HEARTBEAT);
    let mut messages = messages.messages().await.map_err(unreachable)?;
    link.jobs().await?;
    trouble.send_replace(None);
    while let Some(message) = messages.next().await {
        let message = message.map_err(unreachable)?;
        bring(message, news, &pool).await?;
    }
    Ok(())
}

async fn bring(message: jetstream::Message, news: &Sender<News>, pool: &Pool) -> Result<(), DispatchError> {
    let delivered = message.info().map_or(1, |info| info.delivered);
    let (message, acker) = message.split();
    if delivered > MOST_DELIVERIES {
        tracing::error!(subject = %message.subject, "a result could not be recorded {MOST_DELIVERIES} times; it is left out");
        return acker.ack_with(AckKind::Term).await.map_err(unreachable);
    }
    let read = pool.run(move |_| unpack::<Brought>(&message.payload)).await.map_err(unreachable)?;
    let brought = match read {
        Ok(brought) => brought,
        Err(error) => {
            tracing::error!(%error, "a result cannot be read; it is left out");
            return acker.ack_with(AckKind::Term).await.map_err(unreachable);
        }
    };
    let receipt = Receipt::new(async move {
        if let Err(error) = acker.double_ack().await {
            // It comes again, and is known then.
            tracing::warn!(%error, "a receipt did not reach the broker");
        }
    });
    let Brought { attempt, worker, finding } = brought;
    news.send(News::Ended { attempt, worker, finding, receipt }).await.map_err(gone)
}
