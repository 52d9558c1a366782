//! `gaitwright serve`.

use super::config::{Flags, Settings};
use super::output::tell;
use super::scheduled_backups::BackupPlan;
use axum_server::tls_rustls::{RustlsAcceptor, RustlsConfig};
use axum_server::{Handle, Server};
use clap::Args;
use gaitwright_http::access_log::keep_pruning;
use gaitwright_http::connections::{LimitedListener, Peer};
use gaitwright_http::{Access, AppState, Hosts, router};
use gaitwright_service::access::people;
use gaitwright_service::error::Error;
use gaitwright_service::studies::catalogue;
use gaitwright_service::studies::retention;
use gaitwright_service::studies::scheduler::Scheduler;
use gaitwright_service::workers::nats::JetStream;
use gaitwright_service::workers::{AfterSolves, Dispatch, GaitSolver, InProcess, LEASE};
use gaitwright_store::audit::Actor;
use gaitwright_store::{Store, commit};
use hyper_util::rt::{TokioExecutor, TokioTimer};
use hyper_util::server::conn::auto::Builder;
use std::net::{SocketAddr, TcpListener};
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

/// Requests that run when the service is told to stop have so long to end.
const DRAIN: Duration = Duration::from_secs(20);
/// A connection without a whole request head for so long is closed.
const SILENCE: Duration = Duration::from_secs(15);

#[derive(Debug, Args)]
pub(super) struct Serve {
    #[command(flatten)]
    flags: Flags,
    /// Print a one-time sign-in link for an administrator, also when there is a password; a new administrator when all
    /// are disabled.
    #[arg(long)]
    sign_in_link: bool,
}

impl Serve {
    pub(super) fn settings(&self) -> Result<Settings, Error> {
        Settings::read(&self.flags)
    }

    pub(super) async fn run(self, settings: &Settings) -> Result<(), Error> {
        let (listen, sign_in, tls) = (settings.listen()?, settings.sign_in()?, settings.tls()?);
        if !listen.ip().is_loopback() && !sign_in {
            let allowed = "a loopback address such as 127.0.0.1:8080: without sign-in, whoever reaches the service may \
                           change everything";
            return Err(settings.refused("listen", allowed));
        }
        let local = listen.ip().is_loopback();
        let (workers, sessions, database) = (settings.workers()?, settings.session_limits()?, settings.database());
        let (proxies, limits) = (settings.proxies()?, settings.connections()?.within_descriptors());
        let access_log_days = settings.access_log_days()?;
        let backups = settings.backups()?;
        // What can be refused is refused before a file is made.
        let reserve = settings.reserve_bytes()?;
        let tls = match tls {
            Some((certificate, key)) => Some(certificate_of(certificate, key).await?),
            None => None,
        };
        let cannot_listen = |e: std::io::Error| Error::Malformed(format!("cannot listen on {listen}: {e}"));
        let listener = TcpListener::bind(listen).map_err(cannot_listen)?;
        listener.set_nonblocking(true).map_err(cannot_listen)?;
        let address = listener.local_addr().map_err(cannot_listen)?;
        let store = Store::open_anchored(&database, settings.anchor().as_deref()).await?;
        store.set_reserve(reserve);
        let mut writer = store.write().await?;
        catalogue::ensure(&mut writer).await?;
        commit(writer).await?;
        let mut access = if sign_in { Access::by_sign_in(sessions.idle_seconds) } else { Access::without_sign_in() };
        access.limits = sessions;
        access.secure = tls.is_some();

        let scheme = if access.secure { "https" } else { "http" };
        let origin = format!("{scheme}://{address}");
        let link = if sign_in { self.link(&store).await? } else { None };

        let size = cores_or(workers);
        let engine: Arc<dyn Dispatch> = match settings.nats()? {
            Some((url, queue)) => Arc::new(JetStream::connect(url, queue, size, LEASE).await?),
            None => Arc::new(InProcess::new(size, Arc::new(GaitSolver)).standing_back()),
        };
        let scheduler = Scheduler::new(&store, engine, None, Some(AfterSolves::by_optimizer()));
        let hosts = Hosts::new(address, &settings.host_names());
        let access = Arc::new(access);
        // What commands exported while no service ran.
        access.log.write(&store, true).await?;
        let mut state = AppState::new(scheduler.clone(), Arc::clone(&access), hosts);
        state.proxies = proxies.clone();
        let app = router(state);
        let work = tokio::spawn({
            let scheduler = scheduler.clone();
            async move { Box::pin(scheduler.run()).await }
        });
        let chores = tokio::spawn(keep_house(scheduler.clone(), store.clone(), access_log_days, backups));
        tracing::info!(database = %database.display(), workers = scheduler.workers(), "listening on {origin}");
        if !local && scheme == "http" && !proxies.are_any() {
            tracing::warn!("no TLS: passwords and sign-in links cross the network unencrypted, except on this machine");
        }
        if let Some(secret) = link {
            // All addresses are none that a browser can open.
            let here = if address.ip().is_unspecified() {
                format!("localhost:{}", address.port())
            } else {
                address.to_string()
            };
            tell(&format!("sign in (once, within a day): {scheme}://{here}/sign-in/{secret}"));
        }

        // Streams end when the scheduler stops, so that the drain is not held up by them.
        let handle = Handle::<Peer>::new();
        tokio::spawn({
            let (scheduler, handle, interrupted) = (scheduler.clone(), handle.clone(), interrupted());
            async move {
                interrupted.await;
                scheduler.stop();
                handle.graceful_shutdown(Some(DRAIN));
            }
        });
        let service = app.into_make_service_with_connect_info::<SocketAddr>();
        let listener = LimitedListener::new(listener, limits, proxies).map_err(cannot_listen)?;
        let mut server = Server::<Peer>::from_listener(listener).handle(handle);
        cut_off_silence(server.http_builder());
        let served = match tls {
            Some(config) => server.acceptor(RustlsAcceptor::new(config)).http1_only().serve(service).await,
            None => server.http1_only().serve(service).await,
        };
        scheduler.stop();
        work.await.map_err(|e| Error::Internal(e.to_string()))??;
        chores.await.map_err(|e| Error::Internal(e.to_string()))?;
        access.log.write(&store, true).await?;
        store.close().await;
        served.map_err(|e| Error::Internal(e.to_string()))
    }

    /// A sign-in link for whoever started the service, unless somebody can sign in already.
    async fn link(&self, store: &Store) -> Result<Option<String>, Error> {
        if !self.sign_in_link && people::has_admin(&mut *store.read().await?).await? {
            return Ok(None);
        }
        let mut writer = store.write().await?;
        let admin = people::way_in(&mut writer).await?;
        let secret = people::link(&mut writer, &Actor::terminal(), admin.id).await?;
        commit(writer).await?;
        Ok(Some(secret))
    }
}

/// Whoever connects and does not say what is wanted loses the connection.
fn cut_off_silence(http: &mut Builder<TokioExecutor>) {
    http.http1().timer(TokioTimer::new()).header_read_timeout(SILENCE);
}

async fn certificate_of(certificate: PathBuf, key: PathBuf) -> Result<RustlsConfig, Error> {
    // Fails only when one was installed before, and that is this one.
    let _ = rustls::crypto::ring::default_provider().install_default();
    let name = certificate.display().to_string();
    let read = RustlsConfig::from_pem_file(certificate, key)
        .await
        .map_err(|e| Error::Malformed(format!("cannot use the certificate {name} and its key: {e}")))?;
    // Silence is cut off in HTTP/1 alone, so that is what is spoken.
    let mut config = rustls::ServerConfig::clone(&read.get_inner());
    config.alpn_protocols = vec![b"http/1.1".to_vec()];
    Ok(RustlsConfig::from_config(Arc::new(config)))
}

/// The number given, or that of the cores.
pub(super) fn cores_or(given: Option<usize>) -> usize {
    given.unwrap_or_else(|| std::thread::available_parallelism().map_or(1, std::num::NonZero::get))
}

/// Ctrl-C or, where there is one, SIGTERM. From this call on, not only once it is waited for, they do not end the process.
#[cfg(unix)]
pub(super) fn interrupted() -> impl Future<Output = ()> + use<> {
    use tokio::signal::unix::{SignalKind, signal};
    let signals = [SignalKind::interrupt(), SignalKind::terminate()].map(signal);
    async move {
        if let [Ok(mut interrupt), Ok(mut terminate)] = signals {
            tokio::select! {
                _ = interrupt.recv() => {}
                _ = terminate.recv() => {}
            }
        } else {
            // Without signals the process is ended from outside; the record stands that.
            std::future::pending::<()>().await;
        }
    }
}

/// Ctrl-C.
#[cfg(not(unix))]
pub(super) async fn interrupted() {
    if tokio::signal::ctrl_c().await.is_err() {
        std::future::pending::<()>().await;
    }
}

/// What the service does by itself beside tuning, until the scheduler is told to stop: drops what is past its time, and makes
/// copies. What fails is logged and tried again; a task that panics is begun again, and `/ready` says so.
async fn keep_house(scheduler: Scheduler, store: Store, access_log_days: Option<u32>, backups: Option<BackupPlan>) {
    let dropping =
        scheduler.keep("dropping what is past its time", |task| retention::keep_dropping(store.clone(), task));
    let pruning = async {
        if let Some(days) = access_log_days {
            scheduler.keep("pruning the access log", |task| keep_pruning(store.clone(), days, task)).await;
        }
    };
    let copying = async {
        if let Some(plan) = backups {
            scheduler.keep("copying the record", |task| plan.clone().follow(store.clone(), task)).await;
        }
    };
    tokio::join!(dropping, pruning, copying);
}
