//! `gaitwright doctor`: checks the machine, the settings and the record, for bug reports.

use super::output::data;
use super::settings::{Flags, Settings};
use clap::Args;
use gaitwright_service::error::Error;
#[cfg(feature = "nats")]
use gaitwright_service::workers::nats;
use gaitwright_store::{SCHEMA_VERSION, access_clock, free_bytes, now, verify};
use std::path::{Path, PathBuf};
use std::thread::available_parallelism;

/// How far another machine's clock may be ahead without notice, s.
const CLOCKS_DIFFER_S: i64 = 5;

#[derive(Debug, Args)]
pub(super) struct DoctorCommand {
    #[command(flatten)]
    flags: Box<Flags>,
}

/// The outcome of a check.
enum CheckOutcome {
    Good(String),
    Trouble(String),
}
use CheckOutcome::{Good, Trouble};

impl DoctorCommand {
    pub(super) fn flags(&self) -> Flags {
        (*self.flags).clone()
    }

    /// Prints a line for each check. Returns whether all is well.
    pub(super) async fn run(self, settings: &Settings) -> Result<bool, Error> {
        let database = settings.database();
        let mut checks = vec![
            ("program", program()),
            ("kernels", Good(format!("vector instructions: {}", interior_point::vector_instructions()))),
            ("settings", of_service(settings)),
            (
                "disk",
                settings.reserve_bytes().map_or_else(|e| Trouble(e.to_string()), |reserve| disk(&database, reserve)),
            ),
        ];
        if database.exists() {
            checks.push(("record", record(&database, settings.anchor().as_slice()).await));
            checks.push(("clock", clock_after(&database).await));
        } else {
            checks.push(("record", Good(format!("no record yet at {}", database.display()))));
            checks.push(("clock", Good(now().to_string())));
        }
        checks.push(("broker", broker(settings).await));
        for (what, found) in &checks {
            let (state, text) = match found {
                Good(text) => ("ok", text),
                Trouble(text) => ("error", text),
            };
            data(&format!("{state:<8}{what:<9}{text}"))?;
        }
        Ok(checks.iter().all(|(_, found)| matches!(found, Good(_))))
    }
}

fn program() -> CheckOutcome {
    let (version, os, architecture) = (env!("CARGO_PKG_VERSION"), std::env::consts::OS, std::env::consts::ARCH);
    let processors = available_parallelism().map_or_else(|_| "unknown".to_owned(), |number| number.to_string());
    Good(format!("gaitwright {version}, schema {SCHEMA_VERSION}, {os} {architecture}, processors: {processors}"))
}

fn disk(database: &Path, reserve: u64) -> CheckOutcome {
    let gigabytes = |bytes: u64| format!("{:.1} GB", bytes as f64 / 1e9);
    let folder = database.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or_else(|| Path::new("."));
    match free_bytes(folder) {
        _ if !folder.is_dir() => Trouble(format!("the folder {} does not exist", folder.display())),
        Some(free) if free < reserve => {
            Trouble(format!("{} free, less than the reserve of {}", gigabytes(free), gigabytes(reserve)))
        }
        Some(free) => Good(format!("{} free, reserve {}", gigabytes(free), gigabytes(reserve))),
        None => Good("this system does not report free space".to_owned()),
    }
}

async fn record(database: &Path, anchors: &[PathBuf]) -> CheckOutcome {
    match verify::file(database, anchors).await {
        Ok(whole) => Good(format!(
            "{} is intact: audit trail of {} rows, {} seals, anchors: {}",
            database.display(),
            whole.audit.0,
            whole.seals.0,
            whole.anchors.len()
        )),
        Err(error) => Trouble(error.to_string()),
    }
}

/// A clock that is behind the record was set back.
async fn clock_after(database: &Path) -> CheckOutcome {
    let present = now();
    match access_clock::latest_of_file(database).await {
        Ok(Some(latest)) if latest > present.plus_seconds(CLOCKS_DIFFER_S) => {
            Trouble(format!("{present} is earlier than {latest} in the record: the clock was set back"))
        }
        Ok(_) => Good(present.to_string()),
        // The check of the record has the error.
        Err(_) => Good(format!("{present}, not compared with the record")),
    }
}

/// Whether `gaitwright serve` would start with the settings.
fn of_service(settings: &Settings) -> CheckOutcome {
    let read = || -> Result<(), Error> {
        settings.listen()?;
        settings.sign_in()?;
        settings.proxies()?;
        settings.workers()?;
        settings.session_limits()?;
        settings.connections()?;
        settings.access_log_days()?;
        settings.log()?;
        Ok(())
    };
    let files = || -> Result<(), Error> {
        if let Some((certificate, key)) = settings.tls()? {
            for (name, file) in [("tls_certificate", certificate), ("tls_key", key)] {
                if !file.is_file() {
                    return Err(settings.refused(name, "an existing file"));
                }
            }
        }
        if settings.backups()?.is_some_and(|plan| !plan.folder.is_dir()) {
            return Err(settings.refused("backup_folder", "an existing folder"));
        }
        let folder = settings.anchor().and_then(|anchor| anchor.parent().map(Path::to_owned));
        if folder.is_some_and(|folder| !folder.as_os_str().is_empty() && !folder.is_dir()) {
            return Err(settings.refused("anchor", "a file in an existing folder"));
        }
        Ok(())
    };
    match read().and_then(|()| files()) {
        Ok(()) => Good("the service can start with them".to_owned()),
        Err(error) => Trouble(error.to_string()),
    }
}

#[cfg_attr(not(feature = "nats"), allow(clippy::unused_async, reason = "only the check of a broker waits"))]
async fn broker(settings: &Settings) -> CheckOutcome {
    match settings.nats() {
        #[cfg(feature = "nats")]
        Ok(Some((url, _))) => match nats::reach(url).await {
            Ok(version) => Good(format!("NATS {version} with JetStream")),
            Err(error) => Trouble(error.to_string()),
        },
        // A program without NATS refuses a broker in the settings.
        Ok(_) => Good("no NATS broker is set".to_owned()),
        Err(error) => Trouble(error.to_string()),
    }
}
