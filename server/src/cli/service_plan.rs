//! Requirements of `gaitwright serve` before it opens the record: settings that agree, TLS files and a free address.
//! `gaitwright doctor` checks the same.

use super::settings::Settings;
#[cfg(feature = "tls")]
use super::tls;
#[cfg(feature = "tls")]
use axum_server::tls_rustls::RustlsAcceptor;
use gaitwright_http::connections::ConnectionLimits;
use gaitwright_http::{Proxies, is_loopback_name};
use gaitwright_service::access::session::SessionLimits;
use gaitwright_service::error::Error;
use gaitwright_service::scheduled_backups::BackupPlan;
use std::net::{SocketAddr, TcpListener};
use std::path::PathBuf;

/// The settings of a service, each within its range and consistent with the others.
pub(super) struct ServicePlan {
    pub(super) listen: SocketAddr,
    pub(super) sign_in: bool,
    /// Certificate and key.
    pub(super) tls: Option<(PathBuf, PathBuf)>,
    pub(super) proxies: Proxies,
    /// `None`: one for each core.
    pub(super) workers: Option<usize>,
    pub(super) sessions: SessionLimits,
    pub(super) connections: ConnectionLimits,
    pub(super) access_log_days: Option<u32>,
    pub(super) backups: Option<BackupPlan>,
    pub(super) reserve_bytes: u64,
    pub(super) notify_program: Option<PathBuf>,
    /// The broker and the name of the service on it.
    #[cfg_attr(not(feature = "nats"), allow(dead_code, reason = "always `None`"))]
    pub(super) nats: Option<(String, String)>,
}

impl ServicePlan {
    /// # Errors
    /// The first setting that is outside its range or contradicts another one.
    pub(super) fn of(settings: &Settings) -> Result<Self, Error> {
        let plan = Self {
            listen: settings.listen()?,
            sign_in: settings.sign_in()?,
            tls: settings.tls()?,
            proxies: settings.proxies()?,
            workers: settings.workers()?,
            sessions: settings.session_limits()?,
            connections: settings.connections()?,
            access_log_days: settings.access_log_days()?,
            backups: settings.backups()?,
            reserve_bytes: settings.reserve_bytes()?,
            notify_program: settings.notify_program()?,
            nats: settings.nats()?.map(|(url, queue)| (url.to_owned(), queue.to_owned())),
        };
        plan.refuse_strangers(settings)?;
        Ok(plan)
    }

    /// Without sign-in, anyone who reaches the service may change everything.
    fn refuse_strangers(&self, settings: &Settings) -> Result<(), Error> {
        if self.sign_in {
            return Ok(());
        }
        if !self.listen.ip().is_loopback() {
            let allowed = "a loopback address such as 127.0.0.1:8080, because the service runs without sign-in";
            return Err(settings.refused("listen", allowed));
        }
        if self.proxies.are_any() {
            let allowed = "empty, because the service runs without sign-in and a proxy would let other machines change everything";
            return Err(settings.refused("trusted_proxies", allowed));
        }
        if !settings.host_names().iter().all(|name| is_loopback_name(name)) {
            let allowed = "localhost, because the service runs without sign-in and other names would let other machines change everything";
            return Err(settings.refused("host_names", allowed));
        }
        Ok(())
    }

    /// Reads the certificate and its key, if there are any.
    #[cfg(feature = "tls")]
    pub(super) async fn acceptor(&self) -> Result<Option<RustlsAcceptor>, Error> {
        match self.tls.clone() {
            Some((certificate, key)) => tls::acceptor(certificate, key).await.map(Some),
            None => Ok(None),
        }
    }

    /// # Errors
    /// If the certificate is expired, or not valid yet.
    #[cfg(feature = "tls")]
    pub(super) fn certificate_is_valid_now(&self) -> Result<(), Error> {
        self.tls.as_ref().map_or(Ok(()), |(certificate, _)| tls::valid_now(certificate))
    }

    /// Listens on the address.
    pub(super) fn listener(&self) -> Result<TcpListener, Error> {
        let bound =
            TcpListener::bind(self.listen).and_then(|listener| listener.set_nonblocking(true).map(|()| listener));
        bound.map_err(|e| self.cannot_listen(&e))
    }

    pub(super) fn cannot_listen(&self, error: &std::io::Error) -> Error {
        Error::Malformed(format!("Cannot listen on {}: {error}.", self.listen))
    }
}
