//! `gaitwright doctor`: checks the machine, the settings, what `serve` needs, the record, the clock and the broker.

use super::output::data;
use super::service_plan::ServicePlan;
use super::settings::{Flags, Settings};
use clap::Args;
use gaitwright_service::error::Error;
#[cfg(feature = "nats")]
use gaitwright_service::workers::nats;
use gaitwright_store::backup_folder::BackupFolder;
use gaitwright_store::{
    Instant, SCHEMA_VERSION, StoreError, access_clock, check_path, free_bytes, is_open_elsewhere, now, verify,
};
use std::io::{Read, Write};
use std::net::{Ipv4Addr, Ipv6Addr, TcpStream};
#[cfg(unix)]
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};
use std::thread::available_parallelism;
use std::time::Duration;
#[cfg(unix)]
use std::time::UNIX_EPOCH;

/// How far the record may be ahead of the clock without notice, s: the clocks of machines that write to it differ.
const CLOCKS_DIFFER_S: i64 = 5;

#[derive(Debug, Args)]
pub(super) struct DoctorCommand {
    #[command(flatten)]
    flags: Box<Flags>,
}

/// How long a running service may take to answer.
const HEALTH_TIMEOUT: Duration = Duration::from_secs(2);
/// Longest answer that is read, bytes.
const MAX_HEALTH_BYTES: u64 = 4096;

const VALID_SETTINGS: &str = "needs valid settings";

/// The outcome of a check.
enum CheckOutcome {
    Good(String),
    Trouble(String),
    /// Skipped, because a check that it needs failed.
    Skipped(&'static str),
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
            ("disk", disk(settings, &plan)),
        ];
        checks.push(("record", record(&database, settings.anchor().as_deref()).await));
        checks.push(("clock", clock(&database, now()).await));
        checks.push(("broker", broker(settings).await));
        for (what, found) in &checks {
            let (state, text) = match found {
                Good(text) => ("ok", text.as_str()),
                Trouble(text) => ("error", text.as_str()),
                Skipped(needs) => ("skipped", *needs),
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

/// Whether every folder to which the service writes has more free space than the reserve.
fn disk(settings: &Settings, plan: &Result<ServicePlan, Error>) -> CheckOutcome {
    let Ok(plan) = plan else { return Skipped(VALID_SETTINGS) };
    if !folder_of(&settings.database()).is_dir() {
        return Skipped("needs the folder of the record");
    }
    let reserve = megabytes(plan.reserve_bytes);
    let least =
        written_folders(settings, plan).into_iter().filter_map(|folder| Some((free_bytes(&folder)?, folder))).min();
    match least {
        Some((free, folder)) if free < plan.reserve_bytes => Trouble(format!(
            "{} free in the folder {}, less than the reserve of {reserve}",
            megabytes(free),
            folder.display()
        )),
        Some((free, _)) => Good(format!("{} free, reserve {reserve}", megabytes(free))),
        None => Good("this system does not report free space".to_owned()),
    }
}

/// The unit of the setting `reserve_mb`.
fn megabytes(bytes: u64) -> String {
    format!("{} MB", bytes / 1_000_000)
}

/// Whether the record, if there is one, is intact and the service can open it; otherwise, whether it was lost.
async fn record(database: &Path, second_anchor: Option<&Path>) -> CheckOutcome {
    if let Err(error) = check_path(database, second_anchor) {
        return Trouble(error.to_string());
    }
    // The service makes a record of an empty file.
    if !database.metadata().is_ok_and(|file| file.len() > 0) {
        return Good(format!("no record yet at {}", database.display()));
    }
    // The service makes a second anchor that is missing.
    let anchors = second_anchor.filter(|anchor| anchor.exists()).map(Path::to_owned);
    match verify::file(database, anchors.as_slice()).await {
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

/// A clock that is behind the program's own file, or behind the record, was set back or never set.
async fn clock(database: &Path, present: Instant) -> CheckOutcome {
    let program = std::env::current_exe().ok().and_then(|program| came_to_this_machine(&program));
    if let Some(program) = program.filter(|&program| behind(present, program)) {
        return Trouble(format!(
            "{present} is earlier than {program}, when the file of this program was last changed: the clock is wrong"
        ));
    }
    if !database.is_file() {
        return Good(present.to_string());
    }
    match access_clock::latest_of_file(database).await {
        Ok(Some(latest)) if behind(present, latest) => Trouble(format!(
            "{present} is earlier than {latest}, the latest time in the record: the clock was set back"
        )),
        Ok(_) => Good(present.to_string()),
        // The check of the record has the error.
        Err(_) => Good(format!("{present}, not compared with the record")),
    }
}

fn behind(present: Instant, recorded: Instant) -> bool {
    recorded > present.plus_seconds(CLOCKS_DIFFER_S)
}

/// When this machine created the file or last changed it, if the system says so. The time of its content is not used:
/// packages and copies set it to any value.
fn came_to_this_machine(file: &Path) -> Option<Instant> {
    let file = file.metadata().ok()?;
    #[cfg(unix)]
    let time = UNIX_EPOCH.checked_add(Duration::from_secs(u64::try_from(file.ctime()).ok()?))?;
    #[cfg(not(unix))]
    let time = file.created().ok()?;
    Instant::of_file(time)
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
        Err(_) => Skipped(VALID_SETTINGS),
        #[cfg(feature = "tls")]
        Ok(plan) if plan.tls.is_some() => match plan.acceptor().await {
            Ok(_) => match plan.certificate_is_valid_now() {
                Ok(()) => Good("the certificate and its key can be used".to_owned()),
                Err(error) => Trouble(error.to_string()),
            },
            Err(error) => Trouble(error.to_string()),
        },
        Ok(_) => Good("no certificate is set, so the service speaks HTTP".to_owned()),
    }
}

/// Whether the service can listen on its address, or the running service does. A process that owns the record and does not
/// listen there prevents the service from starting.
fn address(plan: &Result<ServicePlan, Error>, database: &Path) -> CheckOutcome {
    match plan.as_ref().map(|plan| (plan.listen, plan.listener())) {
        Err(_) => Skipped(VALID_SETTINGS),
        Ok((_, Ok(_))) if is_open_elsewhere(database) => {
            Trouble(StoreError::InUse { path: database.to_owned() }.to_string())
        }
        Ok((listen, Ok(_))) => Good(format!("{listen} is free")),
        Ok((listen, Err(_))) if is_open_elsewhere(database) && answers(plan) => {
            Good(format!("the service is running on {listen}"))
        }
        Ok((_, Err(error))) => Trouble(error.to_string()),
    }
}

/// Whether a service answers on the address. Over TLS, whatever listens there counts.
fn answers(plan: &Result<ServicePlan, Error>) -> bool {
    let Ok(plan) = plan else { return false };
    let mut to = plan.listen;
    if to.ip().is_unspecified() {
        to.set_ip(if to.is_ipv4() { Ipv4Addr::LOCALHOST.into() } else { Ipv6Addr::LOCALHOST.into() });
    }
    let health = || -> std::io::Result<String> {
        let mut stream = TcpStream::connect_timeout(&to, HEALTH_TIMEOUT)?;
        stream.set_read_timeout(Some(HEALTH_TIMEOUT))?;
        stream.write_all(format!("GET /health HTTP/1.1\r\nhost: {to}\r\nconnection: close\r\n\r\n").as_bytes())?;
        let mut answer = String::new();
        stream.take(MAX_HEALTH_BYTES).read_to_string(&mut answer)?;
        Ok(answer)
    };
    plan.tls.is_some()
        || health().is_ok_and(|answer| answer.contains(r#""status":"#) && answer.contains(r#""version":"#))
}

/// The folders of the record, the second anchor and the backups.
fn written_folders(settings: &Settings, plan: &ServicePlan) -> Vec<PathBuf> {
    // The check of the record reports a missing folder of the anchor.
    let of_anchor = settings.anchor().filter(|anchor| folder_of(anchor).is_dir());
    let files = [Some(settings.database()), of_anchor].into_iter().flatten();
    let mut folders: Vec<PathBuf> = files.map(|file| folder_of(&file).to_owned()).collect();
    folders.extend(plan.backups.as_ref().map(|backups| backups.folder.clone()));
    folders
}

/// Whether the service can write to its folders.
fn folders(settings: &Settings, plan: &Result<ServicePlan, Error>) -> CheckOutcome {
    let Ok(plan) = plan else { return Skipped(VALID_SETTINGS) };
    let wanted = written_folders(settings, plan);
    let refused = wanted.iter().find_map(|folder| Some((folder, tempfile::tempfile_in(folder).err()?)));
    let claimed = match refused {
        Some((folder, error)) => {
            return Trouble(format!("cannot write to the folder {}: {}", folder.display(), error.kind()));
        }
        None => plan.backups.as_ref().map(|backups| BackupFolder::check(&settings.database(), &backups.folder)),
    };
    match claimed {
        Some(Err(error)) => Trouble(error.to_string()),
        _ => Good("writable".to_owned()),
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

#[cfg(test)]
mod tests {
    use super::*;

    #[tokio::test]
    async fn clock_before_the_installation_of_the_program_is_reported() {
        let no_record = Path::new("no such record");
        let long_ago = "2001-01-01T00:00:00.000Z".parse().unwrap();
        let Trouble(text) = clock(no_record, long_ago).await else { panic!("the clock was accepted") };
        assert!(text.contains("when the file of this program was last changed: the clock is wrong"), "{text}");
        assert!(matches!(clock(no_record, now()).await, Good(_)));
    }
}
