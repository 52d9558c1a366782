//! The connection to a broker: its streams, consumers and subjects.

use crate::dispatch_error::DispatchError;
use crate::workers::dispatch::Attempt;
use async_nats::connection::State;
use async_nats::jetstream::consumer::{AckPolicy, PullConsumer, pull};
use async_nats::jetstream::stream::{Config, DiscardPolicy, RetentionPolicy, Stream};
use async_nats::jetstream::{self, Context};
use async_nats::{ConnectOptions, ServerAddr};
use gaitwright_store::TrialId;
use percent_encoding::percent_decode_str;
use std::borrow::Cow;
use std::fmt::Display;
use std::time::Duration;

/// A silent worker loses its job well before the lease in the record expires.
const ACK_WAITS_PER_LEASE: u32 = 3;
/// Pause before a retry after an error of the broker.
pub(super) const RETRY_PAUSE: Duration = Duration::from_secs(1);
/// Longest time for a check of the broker.
const CHECK_TIMEOUT: Duration = Duration::from_secs(5);
/// How long the broker holds a request for messages, and the interval of its heartbeats.
pub(super) const EXPIRES: Duration = Duration::from_secs(10);
pub(super) const BROKER_HEARTBEAT: Duration = Duration::from_secs(2);

/// A connection to a broker, and the names of our streams and subjects.
#[derive(Debug, Clone)]
pub(super) struct BrokerConnection {
    /// Host and port, without a user and a password, for messages.
    pub(super) address: String,
    pub(super) context: Context,
    pub(super) queue: String,
    pub(super) lease: Duration,
}

/// Connects to a broker once, and returns its version.
///
/// # Errors
/// [`DispatchError::Unreachable`], also if the broker has no JetStream.
pub async fn reach(url: &str) -> Result<String, DispatchError> {
    let (address, options) = address_and_credentials(url)?;
    let options = options.connection_timeout(CHECK_TIMEOUT);
    let client = options.connect(address).await.map_err(unreachable)?;
    let about = client.server_info();
    if about.jetstream {
        Ok(about.version)
    } else {
        Err(DispatchError::Unreachable("The NATS broker runs without JetStream. Enable it on the broker.".to_owned()))
    }
}

/// The address, and options with its user and password, which the library does not send by itself.
fn address_and_credentials(url: &str) -> Result<(ServerAddr, ConnectOptions), DispatchError> {
    let address: ServerAddr = url.parse().map_err(unreachable)?;
    let decoded = |part: &str| {
        let decoded = percent_decode_str(part).decode_utf8();
        decoded.map(Cow::into_owned).map_err(|_| {
            DispatchError::Unreachable("The user name and password for the NATS broker must be valid UTF-8.".to_owned())
        })
    };
    let options = match (address.username(), address.password()) {
        (None, None) => ConnectOptions::new(),
        (Some(token), None) => ConnectOptions::with_token(decoded(token)?),
        (user, password) => {
            ConnectOptions::with_user_and_password(decoded(user.unwrap_or(""))?, decoded(password.unwrap_or(""))?)
        }
    };
    Ok((address, options))
}

impl BrokerConnection {
    /// Connects once the broker is available, and reconnects whenever the connection breaks.
    pub(super) async fn open(url: &str, queue: &str, lease: Duration) -> Result<Self, DispatchError> {
        let address = url.rsplit(['@', '/']).next().unwrap_or_default().to_owned();
        let (server, options) = address_and_credentials(url)?;
        let client = options
            .name(concat!("gaitwright ", env!("CARGO_PKG_VERSION")))
            .reconnect_delay_callback(|_| RETRY_PAUSE)
            .retry_on_initial_connect()
            .connect(server)
            .await
            .map_err(|error| {
                DispatchError::Unreachable(format!("The NATS broker {address} cannot be reached: {error}."))
            })?;
        Ok(Self { address, context: jetstream::new(client), queue: queue.to_owned(), lease })
    }

    pub(super) fn job_subject(&self, attempt: Attempt) -> String {
        format!("{}.job.{}.{}", self.queue, attempt.trial, attempt.number)
    }

    pub(super) fn jobs_of(&self, trial: TrialId) -> String {
        format!("{}.job.{trial}.*", self.queue)
    }

    pub(super) fn result_subject(&self, attempt: Attempt) -> String {
        format!("{}.result.{}.{}", self.queue, attempt.trial, attempt.number)
    }

    /// Heartbeats, with the iterations since the last one.
    pub(super) fn sign_subject(&self) -> String {
        format!("{}.sign", self.queue)
    }

    pub(super) fn cancel_subject(&self) -> String {
        format!("{}.cancel", self.queue)
    }

    /// The stream of jobs. Each stays until a worker acknowledges it.
    pub(super) async fn jobs(&self) -> Result<Stream, DispatchError> {
        let config = Config {
            name: format!("{}-jobs", self.queue),
            subjects: vec![format!("{}.job.>", self.queue)],
            retention: RetentionPolicy::WorkQueue,
            // One message for each attempt, even if it is submitted twice.
            max_messages_per_subject: 1,
            discard: DiscardPolicy::New,
            discard_new_per_subject: true,
            ..Config::default()
        };
        self.context.get_or_create_stream(config).await.map_err(unreachable)
    }

    pub(super) async fn workers(&self) -> Result<PullConsumer, DispatchError> {
        let config = pull::Config {
            durable_name: Some("workers".to_owned()),
            ack_policy: AckPolicy::Explicit,
            ack_wait: self.ack_wait(),
            ..pull::Config::default()
        };
        self.jobs().await?.get_or_create_consumer("workers", config).await.map_err(unreachable)
    }

    /// The stream of results. Each stays until it is on record.
    pub(super) async fn results(&self) -> Result<Stream, DispatchError> {
        let config = Config {
            name: format!("{}-results", self.queue),
            subjects: vec![format!("{}.result.>", self.queue)],
            retention: RetentionPolicy::WorkQueue,
            ..Config::default()
        };
        self.context.get_or_create_stream(config).await.map_err(unreachable)
    }

    pub(super) async fn recorder(&self) -> Result<PullConsumer, DispatchError> {
        let config = pull::Config {
            durable_name: Some("recorder".to_owned()),
            ack_policy: AckPolicy::Explicit,
            ack_wait: self.lease,
            ..pull::Config::default()
        };
        self.results().await?.get_or_create_consumer("recorder", config).await.map_err(unreachable)
    }

    /// Time without a heartbeat after which a worker loses its job.
    pub(super) fn ack_wait(&self) -> Duration {
        self.lease / ACK_WAITS_PER_LEASE
    }

    /// Why the broker cannot be reached now, if it cannot.
    pub(super) fn problem(&self) -> Option<String> {
        (self.context.client().connection_state() != State::Connected)
            .then(|| format!("The NATS broker {} cannot be reached.", self.address))
    }

    /// Refuses a message that is too large, for which the broker would close the connection.
    pub(super) fn fits(&self, what: &'static str, bytes: &[u8]) -> Result<(), DispatchError> {
        // Subject and headers count too.
        let Some(info) = self.context.client().try_server_info() else {
            return Err(DispatchError::Unreachable("The NATS broker is not connected yet.".to_owned()));
        };
        let limit = info.max_payload.saturating_sub(1024);
        if bytes.len() > limit {
            return Err(DispatchError::TooLarge { what, bytes: bytes.len(), limit });
        }
        Ok(())
    }
}

/// The error for a failure of the broker.
pub(super) fn unreachable(error: impl Display) -> DispatchError {
    DispatchError::Unreachable(format!("The NATS broker failed: {error}."))
}
