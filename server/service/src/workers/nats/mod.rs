//! Workers on other machines, through a NATS broker with JetStream.
//!
//! The broker carries jobs and results and may be wiped at any time: SQLite stays the only truth. Jobs wait in a
//! work-queue stream, one message for each attempt; a worker holds its message with signs of life and loses it to
//! another one when it is silent for a third of a lease. Results wait in a second stream until the
//! service has them in its record. Iterations are told without being kept.

mod engine;
mod message;
mod worker;

pub use engine::JetStream;
pub use message::{Brought, Order, Sign, pack, unpack};
pub use worker::Worker;

use super::dispatch::{Attempt, DispatchError};
use async_nats::connection::State;
use async_nats::jetstream::consumer::{AckPolicy, PullConsumer, pull};
use async_nats::jetstream::stream::{Config, DiscardPolicy, RetentionPolicy, Stream};
use async_nats::jetstream::{self, Context};
use gaitwright_store::TrialId;
use std::fmt::Display;
use std::time::Duration;

/// A job goes to another worker well before its lease in the record runs out.
const ACK_WAITS_PER_LEASE: u32 = 3;
/// Pause before something that the broker refused is tried again.
const AGAIN: Duration = Duration::from_secs(1);
/// How long the broker holds a request for messages, and how often it says that it is still there.
const EXPIRES: Duration = Duration::from_secs(10);
const BROKER_HEARTBEAT: Duration = Duration::from_secs(2);

/// A connection to a broker, and the names of what is ours on it.
#[derive(Debug, Clone)]
pub(super) struct Link {
    context: Context,
    queue: String,
    lease: Duration,
}

impl Link {
    /// Connects when the broker is there; the connection is made again by itself whenever it breaks.
    async fn open(url: &str, queue: &str, lease: Duration) -> Result<Self, DispatchError> {
        let client = async_nats::ConnectOptions::new()
            .name(concat!("gaitwright ", env!("CARGO_PKG_VERSION")))
            .reconnect_delay_callback(|_| AGAIN)
            .retry_on_initial_connect()
            .connect(url)
            .await
            .map_err(|error| DispatchError::Unreachable(format!("the NATS broker cannot be reached: {error}")))?;
        Ok(Self { context: jetstream::new(client), queue: queue.to_owned(), lease })
    }

    fn job_subject(&self, attempt: Attempt) -> String {
        format!("{}.job.{}.{}", self.queue, attempt.trial, attempt.number)
    }

    fn jobs_of(&self, trial: TrialId) -> String {
        format!("{}.job.{trial}.*", self.queue)
    }

    fn result_subject(&self, attempt: Attempt) -> String {
        format!("{}.result.{}.{}", self.queue, attempt.trial, attempt.number)
    }

    /// Signs of life, with the iterations since the last one.
    fn sign_subject(&self) -> String {
        format!("{}.sign", self.queue)
    }

    fn cancel_subject(&self) -> String {
        format!("{}.cancel", self.queue)
    }

    /// The stream of jobs: each stays until a worker says that it is done.
    async fn jobs(&self) -> Result<Stream, DispatchError> {
        let config = Config {
            name: format!("{}-jobs", self.queue),
            subjects: vec![format!("{}.job.>", self.queue)],
            retention: RetentionPolicy::WorkQueue,
            // One message for each attempt, whoever submits it again.
            max_messages_per_subject: 1,
            discard: DiscardPolicy::New,
            discard_new_per_subject: true,
            ..Config::default()
        };
        self.context.get_or_create_stream(config).await.map_err(unreachable)
    }

    async fn workers(&self) -> Result<PullConsumer, DispatchError> {
        let config = pull::Config {
            durable_name: Some("workers".to_owned()),
            ack_policy: AckPolicy::Explicit,
            ack_wait: self.ack_wait(),
            ..pull::Config::default()
        };
        self.jobs().await?.get_or_create_consumer("workers", config).await.map_err(unreachable)
    }

    /// The stream of results: each stays until it is in the record.
    async fn results(&self) -> Result<Stream, DispatchError> {
        let config = Config {
            name: format!("{}-results", self.queue),
            subjects: vec![format!("{}.result.>", self.queue)],
            retention: RetentionPolicy::WorkQueue,
            ..Config::default()
        };
        self.context.get_or_create_stream(config).await.map_err(unreachable)
    }

    async fn recorder(&self) -> Result<PullConsumer, DispatchError> {
        let config = pull::Config {
            durable_name: Some("recorder".to_owned()),
            ack_policy: AckPolicy::Explicit,
            ack_wait: self.lease,
            ..pull::Config::default()
        };
        self.results().await?.get_or_create_consumer("recorder", config).await.map_err(unreachable)
    }

    /// A worker without a sign of life for so long loses its job to another one.
    fn ack_wait(&self) -> Duration {
        self.lease / ACK_WAITS_PER_LEASE
    }

    /// Why nothing reaches the broker now.
    fn trouble(&self) -> Option<String> {
        (self.context.client().connection_state() != State::Connected)
            .then(|| "the NATS broker cannot be reached".to_owned())
    }

    /// Refuses what the broker would cut the connection for.
    fn fits(&self, what: &'static str, bytes: &[u8]) -> Result<(), DispatchError> {
        // Subject and headers count as well.
        let Some(info) = self.context.client().try_server_info() else { return Err(unreachable("not connected yet")) };
        let limit = info.max_payload.saturating_sub(1024);
        if bytes.len() > limit {
            return Err(DispatchError::TooLarge { what, bytes: bytes.len(), limit });
        }
        Ok(())
    }
}

fn unreachable(error: impl Display) -> DispatchError {
    DispatchError::Unreachable(format!("the NATS broker: {error}"))
}
