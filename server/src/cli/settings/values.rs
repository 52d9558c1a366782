//! The settings with their types and ranges.

use super::Settings;
use gaitwright_http::connections::ConnectionLimits;
use gaitwright_http::{NETWORKS, Network, Proxies, ProxyHeaders};
use gaitwright_service::access::session::SessionLimits;
use gaitwright_service::error::Error;
use gaitwright_service::scheduled_backups::BackupPlan;
use gaitwright_store::{Store, StoreResult};
use std::net::SocketAddr;
use std::path::PathBuf;
use std::time::Duration;
use tracing_subscriber::EnvFilter;

/// Number of symbolic links that Linux follows.
const MAX_LINK_CHAIN: u32 = 40;

impl Settings {
    pub(in crate::cli) fn listen(&self) -> Result<SocketAddr, Error> {
        self.parsed("listen", "an address and a port such as 127.0.0.1:8080")
    }

    /// The SQLite file of the record. A symbolic link is followed, because the other files of the record are beside the file
    /// itself.
    pub(in crate::cli) fn database(&self) -> PathBuf {
        let mut path = PathBuf::from(self.text("database"));
        // In a circle of links, the path remains a link that cannot be opened.
        for _ in 0..MAX_LINK_CHAIN {
            let Ok(target) = path.read_link() else { break };
            path.pop();
            path.push(target);
        }
        path
    }

    /// The second anchor file.
    pub(in crate::cli) fn anchor(&self) -> Option<PathBuf> {
        Some(self.text("anchor")).filter(|path| !path.is_empty()).map(PathBuf::from)
    }

    /// Opens the record with its anchors.
    pub(in crate::cli) async fn open_record(&self) -> StoreResult<Store> {
        Store::open_anchored(&self.database(), self.anchor().as_deref()).await
    }

    /// The program for notices of studies, if any.
    pub(in crate::cli) fn notify_program(&self) -> Result<Option<PathBuf>, Error> {
        let program = PathBuf::from(self.text("notify_program"));
        match std::path::absolute(&program) {
            _ if program.as_os_str().is_empty() => Ok(None),
            Ok(program) if program.is_file() => Ok(Some(program)),
            _ => Err(self.refused("notify_program", "the path of an existing program")),
        }
    }

    /// Scheduled backups, if any.
    pub(in crate::cli) fn backups(&self) -> Result<Option<BackupPlan>, Error> {
        let hours: u64 = self.parsed("backup_hours", "1 to 8760")?;
        let keep: usize = self.parsed("backup_keep", "1 to 10000")?;
        if !(1..=8760).contains(&hours) {
            return Err(self.refused("backup_hours", "1 to 8760"));
        }
        if !(1..=10_000).contains(&keep) {
            return Err(self.refused("backup_keep", "1 to 10000"));
        }
        let folder = PathBuf::from(self.text("backup_folder"));
        if folder.as_os_str().is_empty() {
            return Ok(None);
        }
        if !folder.is_dir() {
            return Err(self.refused("backup_folder", "an existing folder"));
        }
        Ok(Some(BackupPlan { folder, every: Duration::from_secs(3600 * hours), keep }))
    }

    pub(in crate::cli) fn workers(&self) -> Result<Option<usize>, Error> {
        match self.text("workers") {
            "cores" => Ok(None),
            _ => match self.parsed("workers", "1 to 64, or \"cores\"")? {
                workers @ 1..=64 => Ok(Some(workers)),
                _ => Err(self.refused("workers", "1 to 64, or \"cores\"")),
            },
        }
    }

    /// The broker and the name of the service on it, if any.
    pub(in crate::cli) fn nats(&self) -> Result<Option<(&str, &str)>, Error> {
        let queue = self.text("nats_queue");
        queue_name(queue).map_err(|_| self.refused("nats_queue", QUEUE_NAMES))?;
        if cfg!(not(feature = "nats")) && !self.text("nats").is_empty() {
            return Err(self.refused("nats", "empty, because this program was built without the feature `nats`"));
        }
        Ok(Some((self.text("nats"), queue)).filter(|(url, _)| !url.is_empty()))
    }

    pub(in crate::cli) fn host_names(&self) -> Vec<String> {
        let names = self.text("host_names").split(',').map(str::trim);
        names.filter(|name| !name.is_empty()).map(str::to_owned).collect()
    }

    pub(in crate::cli) fn sign_in(&self) -> Result<bool, Error> {
        self.parsed("sign_in", "true or false")
    }

    /// When sessions expire.
    pub(in crate::cli) fn session_limits(&self) -> Result<SessionLimits, Error> {
        let idle_seconds = 60.0 * self.within("idle_minutes", 1.0, 1440.0)?;
        Ok(SessionLimits { idle_seconds, lifetime_seconds: 3600.0 * self.within("session_hours", 1.0, 720.0)? })
    }

    fn within(&self, name: &str, least: f64, most: f64) -> Result<f64, Error> {
        let allowed = format!("{least} to {most}");
        let number: f64 = self.parsed(name, &allowed)?;
        if (least..=most).contains(&number) { Ok(number) } else { Err(self.refused(name, &allowed)) }
    }

    /// The trusted reverse proxies.
    pub(in crate::cli) fn proxies(&self) -> Result<Proxies, Error> {
        let names = self.text("trusted_proxies").split(',').map(str::trim).filter(|name| !name.is_empty());
        let trusted: Result<Vec<Network>, _> = names.map(str::parse).collect();
        let headers = match self.text("proxy_headers") {
            "x-forwarded" => ProxyHeaders::XForwarded,
            "forwarded" => ProxyHeaders::Forwarded,
            _ => return Err(self.refused("proxy_headers", "x-forwarded or forwarded")),
        };
        Ok(Proxies::new(&trusted.map_err(|_| self.refused("trusted_proxies", NETWORKS))?, headers))
    }

    /// Days for which the access log is kept; `None`: forever.
    pub(in crate::cli) fn access_log_days(&self) -> Result<Option<u32>, Error> {
        let allowed = "0 to 36500";
        let days: u32 = self.parsed("access_log_days", allowed)?;
        if days <= 36_500 { Ok((days > 0).then_some(days)) } else { Err(self.refused("access_log_days", allowed)) }
    }

    /// Limits of open connections.
    pub(in crate::cli) fn connections(&self) -> Result<ConnectionLimits, Error> {
        let number = |name: &str| {
            let allowed = "1 to 60000";
            let number = self.parsed(name, allowed)?;
            if (1..=60_000).contains(&number) { Ok(number) } else { Err(self.refused(name, allowed)) }
        };
        Ok(ConnectionLimits { total: number("connections")?, per_address: number("connections_per_address")? })
    }

    /// Free space that is kept in reserve.
    pub(in crate::cli) fn reserve_bytes(&self) -> Result<u64, Error> {
        const ALLOWED: &str = "0 to 1000000";
        match self.parsed::<u64>("reserve_mb", ALLOWED)? {
            mb @ 0..=1_000_000 => Ok(mb * 1_000_000),
            _ => Err(self.refused("reserve_mb", ALLOWED)),
        }
    }

    /// Certificate and key, both or neither.
    pub(in crate::cli) fn tls(&self) -> Result<Option<(PathBuf, PathBuf)>, Error> {
        match (self.text("tls_certificate"), self.text("tls_key")) {
            ("", "") => Ok(None),
            ("", _) => Err(self.refused("tls_certificate", "a file, because tls_key is set")),
            (_, "") => Err(self.refused("tls_key", "a file, because tls_certificate is set")),
            _ if cfg!(not(feature = "tls")) => {
                Err(self.refused("tls_certificate", "empty, because this program was built without the feature `tls`"))
            }
            (certificate, key) => Ok(Some((certificate.into(), key.into()))),
        }
    }

    /// The log filter, and whether the log is JSON.
    pub(in crate::cli) fn log(&self) -> Result<(EnvFilter, bool), Error> {
        let allowed = "a list of targets and levels such as warn,gaitwright=info";
        let filter = EnvFilter::try_new(self.text("log")).map_err(|_| self.refused("log", allowed))?;
        match self.text("log_format") {
            "text" => Ok((filter, false)),
            "json" => Ok((filter, true)),
            _ => Err(self.refused("log_format", "text or json")),
        }
    }
}

/// Names that NATS accepts for a stream and as the first part of a subject.
const QUEUE_NAMES: &str = "1 to 60 letters, digits, - or _";

/// Checks the name of a service on a broker.
fn queue_name(text: &str) -> Result<String, String> {
    let known = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
    if (1..=60).contains(&text.len()) && text.chars().all(known) {
        Ok(text.to_owned())
    } else {
        Err(QUEUE_NAMES.to_owned())
    }
}
