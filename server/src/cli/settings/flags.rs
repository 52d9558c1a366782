//! Flags that override settings.

use crate::cli::flag_numbers::workers;
use clap::Args;
use std::path::PathBuf;

/// Flags of every command that reads a record.
#[derive(Debug, Clone, Default, Args)]
pub(in crate::cli) struct RecordFlags {
    /// TOML settings file (default: the file that the environment variable GAITWRIGHT_CONFIG names, or gaitwright.toml
    /// in the current folder if it exists).
    #[arg(long, value_name = "FILE")]
    pub(super) config: Option<PathBuf>,
    /// SQLite file of the record (default: gaitwright.db).
    #[arg(long, value_name = "FILE")]
    pub(super) database: Option<String>,
}

/// Flags of every command that verifies or changes a record.
#[derive(Debug, Clone, Default, Args)]
pub(in crate::cli) struct AnchoredFlags {
    #[command(flatten)]
    pub(super) record: RecordFlags,
    /// Second anchor file, for the newest hashes of the record, preferably on another disk; the first one is next to
    /// the database (default: no second one). An empty name means none, even if the settings file names one.
    #[arg(long, value_name = "FILE")]
    pub(super) anchor: Option<String>,
}

impl From<RecordFlags> for AnchoredFlags {
    fn from(record: RecordFlags) -> Self {
        Self { record, anchor: None }
    }
}

impl From<AnchoredFlags> for Flags {
    fn from(record: AnchoredFlags) -> Self {
        Self { record, ..Self::default() }
    }
}

/// Flags of `serve` and `config show`.
#[derive(Debug, Clone, Default, Args)]
pub(in crate::cli) struct Flags {
    #[command(flatten)]
    pub(super) record: AnchoredFlags,
    /// Address and port to listen on (default: 127.0.0.1:8080).
    #[arg(long, value_name = "ADDRESS:PORT")]
    pub(super) listen: Option<String>,
    /// Folder for scheduled backups, preferably on another disk (default: no backups).
    #[arg(long, value_name = "FOLDER")]
    pub(super) backup_folder: Option<String>,
    /// Hours between scheduled backups (default: 24).
    #[arg(long, value_name = "HOURS")]
    pub(super) backup_hours: Option<String>,
    /// Number of scheduled backups to keep (default: 14).
    #[arg(long, value_name = "NUMBER")]
    pub(super) backup_keep: Option<String>,
    /// Host name of the service, besides its address and localhost; can be repeated.
    #[arg(long, value_delimiter = ',', value_name = "NAME")]
    pub(super) host_name: Vec<String>,
    /// Number of solves that run in parallel (default: number of cores).
    #[arg(long, value_name = "NUMBER", value_parser = workers, allow_negative_numbers = true)]
    pub(super) workers: Option<usize>,
    /// NATS broker for remote workers; see `gaitwright worker` (default: solve in this process).
    #[arg(long, value_name = "URL")]
    pub(super) nats: Option<String>,
    /// Name of this service on the broker (default: gaitwright).
    #[arg(long, value_name = "NAME")]
    pub(super) nats_queue: Option<String>,
    /// Do not require users to sign in. Allowed only on a loopback address.
    #[arg(long)]
    pub(super) no_sign_in: bool,
    /// Minutes without a request after which a session ends (default: 60).
    #[arg(long, value_name = "MINUTES")]
    pub(super) idle_minutes: Option<String>,
    /// Hours after which a session ends even if it is in use (default: 12).
    #[arg(long, value_name = "HOURS")]
    pub(super) session_hours: Option<String>,
    /// Address or network of a reverse proxy whose headers are trusted; can be repeated.
    #[arg(long, value_delimiter = ',', value_name = "ADDRESS[/BITS]")]
    pub(super) trusted_proxy: Vec<String>,
    /// Headers of trusted proxies: x-forwarded or forwarded (default: x-forwarded).
    #[arg(long, value_name = "KIND")]
    pub(super) proxy_headers: Option<String>,
    /// PEM file with the certificate chain. HTTPS needs this file and --tls-key.
    #[arg(long, value_name = "FILE")]
    pub(super) tls_certificate: Option<String>,
    /// PEM file with the private key.
    #[arg(long, value_name = "FILE")]
    pub(super) tls_key: Option<String>,
    /// Program that runs as `PROGRAM STUDY STATE` when a study finishes, stops or pauses, or has waited for an answer for a
    /// minute (default: none).
    #[arg(long, value_name = "PROGRAM")]
    pub(super) notify_program: Option<String>,
}

impl Flags {
    /// The flags of a worker.
    pub(in crate::cli) fn of_broker(config: Option<PathBuf>, nats: Option<String>, nats_queue: Option<String>) -> Self {
        Self { record: RecordFlags { config, database: None }.into(), nats, nats_queue, ..Self::default() }
    }

    pub(super) fn get(&self, name: &str) -> Option<String> {
        match name {
            "listen" => self.listen.clone(),
            "database" => self.record.record.database.clone(),
            "anchor" => self.record.anchor.clone(),
            "backup_folder" => self.backup_folder.clone(),
            "backup_hours" => self.backup_hours.clone(),
            "backup_keep" => self.backup_keep.clone(),
            "host_names" => Some(self.host_name.join(",")).filter(|names| !names.is_empty()),
            "workers" => self.workers.map(|workers| workers.to_string()),
            "nats" => self.nats.clone(),
            "nats_queue" => self.nats_queue.clone(),
            "sign_in" => self.no_sign_in.then(|| "false".to_owned()),
            "idle_minutes" => self.idle_minutes.clone(),
            "session_hours" => self.session_hours.clone(),
            "trusted_proxies" => Some(self.trusted_proxy.join(",")).filter(|proxies| !proxies.is_empty()),
            "proxy_headers" => self.proxy_headers.clone(),
            "tls_certificate" => self.tls_certificate.clone(),
            "tls_key" => self.tls_key.clone(),
            "notify_program" => self.notify_program.clone(),
            _ => None,
        }
    }
}
