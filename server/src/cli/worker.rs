//! `gaitwright worker`: runs solves for a service on another machine.

use super::config::queue_name;
use super::numbers::workers;
use super::serve::{cores_or, interrupted};
use clap::Args;
use gaitwright_service::error::Error;
use gaitwright_service::workers::{GaitSolver, LEASE, nats};
use std::sync::Arc;
use tokio_util::sync::CancellationToken;

#[derive(Debug, Args)]
pub(super) struct Worker {
    /// Address of the NATS broker.
    #[arg(long, env = "GAITWRIGHT_NATS", value_name = "URL", hide_env_values = true)]
    nats: String,
    /// Name of the service on the broker.
    #[arg(long, env = "GAITWRIGHT_NATS_QUEUE", default_value = "gaitwright", value_name = "NAME", value_parser = queue_name)]
    nats_queue: String,
    /// Number of solves that run in parallel (default: number of cores).
    #[arg(long, value_name = "NUMBER", value_parser = workers, allow_negative_numbers = true)]
    workers: Option<usize>,
    /// Name of this worker in the record (default: host and process).
    #[arg(long, value_name = "NAME")]
    name: Option<String>,
}

impl Worker {
    pub(super) async fn run(self) -> Result<(), Error> {
        let name = self.name.unwrap_or_else(|| format!("{} {}", host(), std::process::id()));
        if name.is_empty() || name.chars().count() > 200 {
            return Err(Error::invalid("name", name, "1 to 200 characters long"));
        }
        let size = cores_or(self.workers);
        let solver = Arc::new(GaitSolver);
        let worker = nats::Worker::connect(&self.nats, &self.nats_queue, name, size, LEASE, solver).await?;
        tracing::info!(workers = size, queue = self.nats_queue, "waiting for jobs");
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
fn host() -> String {
    std::fs::read_to_string("/etc/hostname").map_or_else(|_| "worker".to_owned(), |name| name.trim().to_owned())
}
