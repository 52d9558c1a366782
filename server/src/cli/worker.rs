//! `gaitwright worker`: runs solves for a service on another machine.

#[cfg(feature = "nats")]
use super::cores::cores_or;
use super::flag_numbers::workers;
#[cfg(feature = "nats")]
use super::interruption::interrupted;
use super::settings::{Flags, Settings};
use clap::Args;
use gaitwright_service::error::Error;
#[cfg(feature = "nats")]
use gaitwright_service::workers::{GaitSolver, LEASE, nats};
use std::path::PathBuf;
#[cfg(feature = "nats")]
use std::sync::Arc;
#[cfg(feature = "nats")]
use tokio_util::sync::CancellationToken;

#[derive(Debug, Args)]
pub(super) struct WorkerCommand {
    /// TOML settings file (default: the file that the environment variable GAITWRIGHT_CONFIG names, or gaitwright.toml
    /// in the current folder if it exists).
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
    /// Address of the NATS broker, nats://HOST:PORT.
    #[arg(long, value_name = "URL")]
    nats: Option<String>,
    /// Name of the service on the broker (default: gaitwright).
    #[arg(long, value_name = "NAME")]
    nats_queue: Option<String>,
    /// Number of solves that run in parallel (default: number of cores).
    #[arg(long, value_name = "NUMBER", value_parser = workers, allow_negative_numbers = true)]
    workers: Option<usize>,
    /// Name of this worker in the record (default: host name and process ID).
    #[arg(long, value_name = "NAME")]
    name: Option<String>,
}

impl WorkerCommand {
    pub(super) fn flags(&self) -> Flags {
        Flags::of_broker(self.config.clone(), self.nats.clone(), self.nats_queue.clone())
    }

    #[cfg(not(feature = "nats"))]
    #[allow(clippy::unused_async)]
    pub(super) async fn run(self, settings: &Settings) -> Result<(), Error> {
        settings.nats()?;
        Err(Error::Malformed("Workers need the feature `nats`, but this program was built without it.".to_owned()))
    }

    #[cfg(feature = "nats")]
    pub(super) async fn run(self, settings: &Settings) -> Result<(), Error> {
        let missing = || settings.refused("nats", "the address of a NATS broker, nats://HOST:PORT");
        let (url, queue) = settings.nats()?.ok_or_else(missing)?;
        let name = self.name.unwrap_or_else(|| format!("{} {}", host(), std::process::id()));
        if name.is_empty() || name.chars().count() > 200 {
            return Err(Error::invalid("--name", name, "1 to 200 characters long"));
        }
        let size = cores_or(self.workers);
        let solver = Arc::new(GaitSolver);
        let worker = nats::NatsWorker::connect(url, queue, name, size, LEASE, solver).await?;
        tracing::info!(workers = size, queue, "waiting for jobs");
        let stop = CancellationToken::new();
        let asked = tokio::spawn({
            let (stop, interrupted) = (stop.clone(), interrupted());
            async move {
                interrupted.await;
                stop.cancel();
            }
        });
        let worked = Box::pin(worker.run(stop)).await;
        asked.abort();
        Ok(worked?)
    }
}

/// The name of this machine, if known.
#[cfg(feature = "nats")]
fn host() -> String {
    std::fs::read_to_string("/etc/hostname").map_or_else(|_| "worker".to_owned(), |name| name.trim().to_owned())
}
