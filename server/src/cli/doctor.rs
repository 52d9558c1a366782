//! `gaitwright doctor`: checks the machine, the settings and the record, for bug reports.

use super::output::data;
use super::service_plan::ServicePlan;
use super::settings::{Flags, Settings};
use clap::Args;
use gaitwright_service::error::Error;
#[cfg(feature = "nats")]
use gaitwright_service::workers::nats;
use gaitwright_store::{SCHEMA_VERSION, access_clock, free_bytes, is_open_elsewhere, now, verify};
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
    /// The error of another check prevents this one.
    Skipped,
}
use CheckOutcome::{Good, Skipped, Trouble};

impl DoctorCommand {
    pub(super) fn flags(&self) -> Flags {
        (*self.flags).clone()
    }

    /// Prints a line for each check. Returns whether all is well. If the settings file could not be read, the report has
    /// its error.
    pub(super) async fn run(self, settings: &Settings, unread_file: Option<Error>) -> Result<bool, Error> {
        let database = settings.database();
        let plan = ServicePlan::of(settings).and_then(|plan| settings.log().map(|_| plan));
        let mut checks = vec![
            ("program", program()),
            ("kernels", Good(format!("vector instructions: {}", interior_point::vector_instructions()))),
            ("settings", of_settings(unread_file.as_ref(), &plan)),
            ("tls", tls(&plan).await),
            ("address", address(&plan, &database)),
            ("folders", folders(settings, &plan)),
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
                Good(text) => ("ok", text.as_str()),
                Trouble(text) => ("error", text.as_str()),
                Skipped => ("skipped", "needs valid settings"),
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
    match free_bytes(folder_of(database)) {
        _ if !folder_of(database).is_dir() => Skipped,
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

/// Whether the settings are readable, within their ranges and consistent.
fn of_settings(unread_file: Option<&Error>, plan: &Result<ServicePlan, Error>) -> CheckOutcome {
    match (unread_file, plan) {
        (Some(error), _) => Trouble(format!("{error} The other checks ignore this file.")),
        (None, Err(error)) => Trouble(error.to_string()),
        (None, Ok(_)) => Good("valid".to_owned()),
    }
}

#[cfg_attr(not(feature = "tls"), allow(clippy::unused_async, reason = "only reading the files waits"))]
async fn tls(plan: &Result<ServicePlan, Error>) -> CheckOutcome {
    match plan {
        Err(_) => Skipped,
        #[cfg(feature = "tls")]
        Ok(plan) if plan.tls.is_some() => match plan.acceptor().await {
            Ok(_) => Good("the certificate and its key can be used".to_owned()),
            Err(error) => Trouble(error.to_string()),
        },
        Ok(_) => Good("no certificate is set, so the service speaks HTTP".to_owned()),
    }
}

/// Whether the service can listen on its address, or the running service does.
fn address(plan: &Result<ServicePlan, Error>, database: &Path) -> CheckOutcome {
    match plan.as_ref().map(|plan| (plan.listen, plan.listener())) {
        Err(_) => Skipped,
        Ok((listen, Ok(_))) => Good(format!("{listen} is free")),
        Ok((listen, Err(_))) if is_open_elsewhere(database) => {
            Good(format!("{listen} is in use, and so is the record: the service seems to be running"))
        }
        Ok((_, Err(error))) => Trouble(error.to_string()),
    }
}

/// Whether the service can write to the folders of the record, the second anchor and the backups.
fn folders(settings: &Settings, plan: &Result<ServicePlan, Error>) -> CheckOutcome {
    let Ok(plan) = plan else { return Skipped };
    let files = [Some(settings.database()), settings.anchor()].into_iter().flatten();
    let mut wanted: Vec<PathBuf> = files.map(|file| folder_of(&file).to_owned()).collect();
    wanted.extend(plan.backups.as_ref().map(|backups| backups.folder.clone()));
    let refused = wanted.iter().find_map(|folder| Some((folder, tempfile::tempfile_in(folder).err()?)));
    match refused {
        Some((folder, error)) => Trouble(format!("cannot write to the folder {}: {}", folder.display(), error.kind())),
        None => Good("writable".to_owned()),
    }
}

fn folder_of(file: &Path) -> &Path {
    file.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or_else(|| Path::new("."))
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
