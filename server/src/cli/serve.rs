//! `gaitwright serve`.

use super::numbers::workers;
use crate::error::Error;
use crate::http::{AppState, Hosts, router};
use crate::store::{Store, commit};
use crate::studies::catalogue;
use crate::studies::director::Director;
use crate::workers::{Board, GaitSolver, Pool};
use clap::Args;
use std::net::SocketAddr;
use std::path::PathBuf;
use std::sync::Arc;
use tokio::net::TcpListener;

#[derive(Debug, Args)]
pub(super) struct Serve {
    /// Where to listen.
    #[arg(long, env = "GAITWRIGHT_LISTEN", default_value = "127.0.0.1:8080", value_name = "ADDRESS:PORT")]
    listen: SocketAddr,
    /// Listen on an address that other machines reach, though there is no sign-in.
    #[arg(long)]
    allow_remote: bool,
    /// A name under which browsers reach the service, besides its address and localhost; may be given several times.
    #[arg(long, env = "GAITWRIGHT_HOST_NAMES", value_delimiter = ',', value_name = "NAME")]
    host_name: Vec<String>,
    /// The SQLite file; made if it does not exist.
    #[arg(long, env = "GAITWRIGHT_DATABASE", default_value = "gaitwright.db", value_name = "FILE")]
    database: PathBuf,
    /// How many solves at the same time; default: the number of cores.
    #[arg(long, env = "GAITWRIGHT_WORKERS", value_name = "NUMBER", value_parser = workers, allow_negative_numbers = true)]
    workers: Option<usize>,
}

impl Serve {
    pub(super) async fn run(self) -> Result<(), Error> {
        if !self.listen.ip().is_loopback() && !self.allow_remote {
            let allowed = "a loopback address such as 127.0.0.1:8080: there is no sign-in yet, whoever reaches the service \
                           may change everything; --allow-remote listens all the same";
            return Err(Error::invalid("listen", self.listen.to_string(), allowed));
        }
        let store = Store::open(&self.database).await?;
        let mut writer = store.write().await?;
        catalogue::ensure(&mut writer).await?;
        commit(writer).await?;

        let listener = TcpListener::bind(self.listen)
            .await
            .map_err(|e| Error::Malformed(format!("cannot listen on {}: {e}", self.listen)))?;
        let address = listener.local_addr().map_err(|e| Error::Internal(e.to_string()))?;
        let pool = Pool::new(cores_or(self.workers), Arc::new(GaitSolver), Arc::new(Board::default()));
        let director = Director::new(store.clone(), pool, None);
        let app = router(AppState { director: director.clone(), hosts: Hosts::new(address, &self.host_name) });
        let work = tokio::spawn({
            let director = director.clone();
            async move { director.run().await }
        });
        tracing::info!(database = %self.database.display(), workers = director.workers(), "listening on http://{address}");

        // Streams end when the director stops, so that the drain below is not held up by them.
        let stopping = director.clone();
        let until_signal = async move {
            interrupted().await;
            stopping.stop();
        };
        let served = axum::serve(listener, app).with_graceful_shutdown(until_signal).await;
        director.stop();
        work.await.map_err(|e| Error::Internal(e.to_string()))??;
        store.close().await;
        served.map_err(|e| Error::Internal(e.to_string()))
    }
}

/// The number given, or that of the cores.
pub(super) fn cores_or(given: Option<usize>) -> usize {
    given.unwrap_or_else(|| std::thread::available_parallelism().map_or(1, std::num::NonZero::get))
}

/// Ctrl-C or, where there is one, SIGTERM.
pub(super) async fn interrupted() {
    #[cfg(unix)]
    {
        use tokio::signal::unix::{SignalKind, signal};
        if let Ok(mut terminate) = signal(SignalKind::terminate()) {
            tokio::select! {
                _ = tokio::signal::ctrl_c() => {}
                _ = terminate.recv() => {}
            }
            return;
        }
    }
    // Without signals the process is ended from outside; the record stands that.
    if tokio::signal::ctrl_c().await.is_err() {
        std::future::pending::<()>().await;
    }
}
