//! `gaitwright serve`: starts the service, and stops it on Ctrl-C or SIGTERM.

use super::cores::cores_or;
use super::interruption::interrupted;
use super::output::tell;
use super::service_plan::ServicePlan;
use super::settings::{Flags, Settings};
use axum_server::{Handle, Server};
use clap::Args;
use gaitwright_http::access_log_layer::keep_pruning;
use gaitwright_http::connections::{LimitedListener, Peer};
use gaitwright_http::{AccessState, AppState, Hosts, router};
use gaitwright_service::access::user_administration;
use gaitwright_service::backups::Backups;
use gaitwright_service::error::Error;
use gaitwright_service::expired_data;
use gaitwright_service::scheduled_backups::ClaimedPlan;
use gaitwright_service::studies::built_in_entries;
use gaitwright_service::studies::scheduler::Scheduler;
use gaitwright_service::study_notices;
use gaitwright_service::workers::{AfterSolves, Dispatch, GaitSolver, InProcess};
#[cfg(feature = "nats")]
use gaitwright_service::workers::{LEASE, nats::JetStream};
use gaitwright_store::audit::Actor;
use gaitwright_store::{Store, commit};
use hyper_util::rt::{TokioExecutor, TokioTimer};
use hyper_util::server::conn::auto::Builder;
use std::net::SocketAddr;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

/// Time for running requests to finish when the service stops.
const DRAIN: Duration = Duration::from_secs(20);
/// Time after which a connection without a complete request head is closed.
const REQUEST_HEAD_TIMEOUT: Duration = Duration::from_secs(15);

#[derive(Debug, Args)]
pub(super) struct ServeCommand {
    #[command(flatten)]
    pub(super) flags: Flags,
    /// At startup, print a one-time sign-in link for an administrator. Without this flag, a link is printed only until an
    /// administrator has a password. If every administrator account is disabled, an administrator is added.
    #[arg(long)]
    sign_in_link: bool,
}

impl ServeCommand {
    pub(super) async fn run(self, settings: &Settings) -> Result<(), Error> {
        // Check everything before any file is created.
        let plan = ServicePlan::of(settings)?;
        #[cfg(feature = "tls")]
        let acceptor = plan.acceptor().await?;
        #[cfg(feature = "tls")]
        if let Err(error) = plan.certificate_is_valid_now() {
            tracing::warn!("{error}");
        }
        let listener = plan.listener()?;
        let address = listener.local_addr().map_err(|e| plan.cannot_listen(&e))?;
        let (database, proxies) = (settings.database(), plan.proxies.clone());
        let store = settings.open_record().await?;
        let backups = plan.backups.clone().map(|backups| backups.claim(&store)).transpose()?;
        store.set_reserve(plan.reserve_bytes);
        let mut writer = store.write().await?;
        built_in_entries::ensure(&mut writer).await?;
        commit(writer).await?;
        let mut access = if plan.sign_in {
            AccessState::by_sign_in(plan.sessions.idle_seconds)
        } else {
            AccessState::without_sign_in()
        };
        access.limits = plan.sessions;
        access.secure = plan.tls.is_some();

        let scheme = if access.secure { "https" } else { "http" };
        let origin = format!("{scheme}://{address}");
        let link = if plan.sign_in { self.link(&store).await? } else { None };

        let size = cores_or(plan.workers);
        let engine: Arc<dyn Dispatch> = match &plan.nats {
            #[cfg(feature = "nats")]
            Some((url, queue)) => Arc::new(JetStream::connect(url, queue, size, LEASE).await?),
            _ => Arc::new(InProcess::new(size, Arc::new(GaitSolver)).with_lower_priority()),
        };
        let scheduler = Scheduler::new(&store, engine, None, Some(AfterSolves::by_optimizer()));
        let hosts = Hosts::new(address, &settings.host_names());
        let access = Arc::new(access);
        // Exports by commands while the service was not running.
        access.log.write(&store, true).await?;
        let on_request = Arc::new(Backups::new(backups.as_ref().map(ClaimedPlan::backups)));
        let mut state = AppState::new(scheduler.clone(), Arc::clone(&access), on_request, hosts);
        state.proxies = proxies.clone();
        let app = router(state);
        let work = tokio::spawn({
            let scheduler = scheduler.clone();
            async move { Box::pin(scheduler.run()).await }
        });
        let chores = tokio::spawn(run_maintenance(
            scheduler.clone(),
            store.clone(),
            plan.access_log_days,
            backups,
            plan.notify_program.clone(),
        ));
        tracing::info!(database = %database.display(), workers = scheduler.workers(), "listening on {origin}");
        if !plan.listen.ip().is_loopback() && scheme == "http" && !proxies.are_any() {
            tracing::warn!("no TLS: passwords and sign-in links cross the network unencrypted");
        }
        if let Some(secret) = link {
            // A browser cannot open the unspecified address.
            let here = if address.ip().is_unspecified() {
                format!("localhost:{}", address.port())
            } else {
                address.to_string()
            };
            tell(&format!(
                "sign in (the link works only once and expires after a day): {scheme}://{here}/sign-in/{secret}"
            ));
        }

        // Event streams end with the scheduler, so they do not delay the shutdown.
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
        let listener = LimitedListener::new(listener, plan.connections.within_descriptors(), proxies)
            .map_err(|e| plan.cannot_listen(&e))?;
        let mut server = Server::<Peer>::from_listener(listener).handle(handle);
        cut_off_silence(server.http_builder());
        #[cfg(not(feature = "tls"))]
        let served = server.http1_only().serve(service).await;
        #[cfg(feature = "tls")]
        let served = match acceptor {
            Some(acceptor) => server.acceptor(acceptor).http1_only().serve(service).await,
            None => server.http1_only().serve(service).await,
        };
        scheduler.stop();
        work.await.map_err(|e| Error::Internal(e.to_string()))??;
        chores.await.map_err(|e| Error::Internal(e.to_string()))?;
        access.log.write(&store, true).await?;
        store.close().await;
        served.map_err(|e| Error::Internal(e.to_string()))
    }

    /// A sign-in link for the first administrator, unless a user can already sign in.
    async fn link(&self, store: &Store) -> Result<Option<String>, Error> {
        if !self.sign_in_link && user_administration::has_admin(&mut *store.read().await?).await? {
            return Ok(None);
        }
        let mut writer = store.write().await?;
        let admin = user_administration::operator_administrator(&mut writer).await?;
        let secret = user_administration::link(&mut writer, &Actor::terminal(), admin.id).await?;
        commit(writer).await?;
        Ok(Some(secret))
    }
}

/// Closes connections that send no request.
fn cut_off_silence(http: &mut Builder<TokioExecutor>) {
    http.http1().timer(TokioTimer::new()).header_read_timeout(REQUEST_HEAD_TIMEOUT);
}

/// Runs the housekeeping tasks until the scheduler stops: deletes expired data, makes backups and gives notices of studies.
/// Failures are logged and retried. A task that panics is restarted, and `/ready` reports it.
async fn run_maintenance(
    scheduler: Scheduler,
    store: Store,
    access_log_days: Option<u32>,
    backups: Option<ClaimedPlan>,
    notify_program: Option<PathBuf>,
) {
    let dropping =
        scheduler.keep("deleting expired data", |task| expired_data::delete_expired_hourly(store.clone(), task));
    let pruning = async {
        if let Some(days) = access_log_days {
            scheduler.keep("pruning the access log", |task| keep_pruning(store.clone(), days, task)).await;
        }
    };
    let copying = async {
        if let Some(plan) = backups {
            scheduler.keep("backing up the record", |task| plan.clone().follow(store.clone(), task)).await;
        }
    };
    let notifying = async {
        if let Some(program) = notify_program {
            let begin = |task| study_notices::give_notices(store.clone(), program.clone(), task);
            scheduler.keep("notices of studies", begin).await;
        }
    };
    tokio::join!(dropping, pruning, copying, notifying);
}
