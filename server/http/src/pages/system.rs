//! The system page: version, workers, queue, record and backups.

use crate::AppState;
use crate::authorization::Authorized;
use crate::format::{count, duration, words};
use crate::page_error::{PageResult, page};
use crate::readiness;
use askama::Template;
use axum::extract::State;
use gaitwright_service::access::{Administer, Caller, Read, RequiredRight};
use gaitwright_service::backups;
use gaitwright_service::error::Error;
use gaitwright_service::job::JobState;
use gaitwright_service::scheduled_backups::{Failure, ScheduledBackups};
use gaitwright_service::studies::lifecycle;
use gaitwright_store::backup::in_record_folder;
use gaitwright_store::studies::StudyState;
use gaitwright_store::totals::{self, Totals};
use gaitwright_store::{SCHEMA_VERSION, commit, solve_jobs, trials};
use std::collections::BTreeMap;
use std::time::Duration;

#[derive(Template)]
#[template(path = "system.html")]
struct SystemPage {
    /// Why the service cannot do its work, if it cannot.
    problem: Option<String>,
    version: &'static str,
    /// Version of the database schema.
    schema_version: i64,
    /// Number of solves that can run in parallel.
    parallel_solves: usize,
    /// Number of running solves by worker.
    running_by_worker: BTreeMap<String, u32>,
    /// The outcome of the backup that was just requested.
    backup: Option<BackupNotice>,
    /// Backups in the folder of the record, newest first: name and bytes.
    copies: Vec<(String, i64)>,
    scheduled: Option<Scheduled>,
    queued: u32,
    running: u32,
    /// Numbers of running and queued jobs that follow solves.
    other_jobs: [usize; 2],
    oldest_queued: String,
    totals: Totals,
    free_bytes: Option<u64>,
    record: String,
    measured: [Option<trials::SolveTimes>; 2],
    may_administer: bool,
}

/// The folder of scheduled backups.
struct Scheduled {
    folder: String,
    /// The backups in it, newest first: name and bytes, or why it cannot be read.
    found: Result<Vec<(String, i64)>, String>,
    failure: Option<Failure>,
}

impl Scheduled {
    fn of(backups: &ScheduledBackups) -> Self {
        let folder = backups.folder();
        Self {
            folder: folder.path().display().to_string(),
            found: folder.sizes().map_err(|e| e.to_string()),
            failure: backups.failure(),
        }
    }
}

impl SystemPage {
    #[allow(clippy::trivially_copy_pass_by_ref)] // templates pass references
    fn megabytes(bytes: &i64) -> String {
        format!("{:.1}", *bytes as f64 / 1e6)
    }

    #[allow(clippy::trivially_copy_pass_by_ref)] // templates pass references
    fn gigabytes(bytes: &u64) -> String {
        format!("{:.1}", *bytes as f64 / 1e9)
    }

    /// `1 not started, 3 finished`.
    fn studies_by_state(counts: &[(String, i64)]) -> String {
        let shown = |known| lifecycle::in_words(known).to_owned();
        Self::by_state(counts, |state| state.parse::<StudyState>().map_or_else(|_| words(state), shown))
    }

    /// `3 converged, 1 not converged`.
    fn trials_by_state(counts: &[(String, i64)]) -> String {
        Self::by_state(counts, words)
    }

    /// `3 done, 1 running`: the job of a running solve is leased.
    fn solves_by_state(counts: &[(String, i64)]) -> String {
        Self::by_state(counts, |state| if state == "leased" { "running".to_owned() } else { words(state) })
    }

    fn by_state(counts: &[(String, i64)], shown: impl Fn(&str) -> String) -> String {
        if counts.is_empty() {
            return "none".to_owned();
        }
        counts.iter().map(|(state, rows)| format!("{} {}", count(rows), shown(state))).collect::<Vec<_>>().join(", ")
    }
}

/// `GET /system`.
pub(super) async fn get(authorized: Authorized<Read>, State(app): State<AppState>) -> PageResult {
    show(&app, &authorized.caller, None).await
}

/// The outcome of a requested backup.
enum BackupNotice {
    Complete { file: String },
    Running,
    Failed { reason: String },
}

/// Time that the page waits for a backup.
const BACKUP_WAIT: Duration = Duration::from_secs(20);

/// `POST /system/backup`: copies the record to a new file beside it, and checks the copy.
pub(super) async fn make_backup(authorized: Authorized<Administer>, State(app): State<AppState>) -> PageResult {
    let actor = &authorized.caller.actor;
    let mut writer = app.write().await?;
    let requested = app.backups.request(app.store(), &mut writer, actor).await?;
    commit(writer).await?;
    let id = requested.id;
    // A backup that takes longer continues in the background.
    let _ = tokio::time::timeout(BACKUP_WAIT, requested.begin(app.store().clone(), actor.clone())).await;
    let mut reader = app.read().await?;
    let notice = match app.backups.find(&mut reader, id).await? {
        Some((JobState::Done, _)) => BackupNotice::Complete { file: backups::get(&mut reader, id).await?.file },
        Some((JobState::Failed, reason)) => BackupNotice::Failed { reason: reason.unwrap_or_default() },
        _ => BackupNotice::Running,
    };
    drop(reader);
    show(&app, &authorized.caller, Some(notice)).await
}

async fn show(app: &AppState, caller: &Caller, backup: Option<BackupNotice>) -> PageResult {
    let mut reader = app.read().await?;
    let totals = totals::read(&mut reader).await?;
    let (queued, running) = solve_jobs::depth(&mut reader).await?;
    let may_administer = caller.may(Administer::NEEDED);
    let record = app.store().path();
    let copies = if may_administer { in_record_folder(record) } else { Ok(Vec::new()) };
    let measured = [trials::measured(&mut reader, true).await?, trials::measured(&mut reader, false).await?];
    let scheduled = app.backups.scheduled().filter(|_| may_administer).map(Scheduled::of);
    page(&SystemPage {
        problem: readiness::check(app).await.err().map(|error| error.to_string()),
        scheduled,
        version: env!("CARGO_PKG_VERSION"),
        schema_version: SCHEMA_VERSION,
        copies: copies.map_err(|e| Error::Internal(format!("cannot list the backups: {e}")))?,
        parallel_solves: app.scheduler.workers(),
        running_by_worker: solve_jobs::by_worker(&mut reader).await?,
        backup,
        queued,
        running,
        other_jobs: [JobState::Running, JobState::Queued]
            .map(|state| app.scheduler.jobs_after_solves().iter().filter(|(_, _, own)| *own == state).count()),
        oldest_queued: duration(totals.oldest_queued_seconds),
        totals,
        free_bytes: app.store().free_bytes(),
        record: record.display().to_string(),
        measured,
        may_administer,
    })
}

#[cfg(test)]
mod tests {
    use super::SystemPage;

    #[test]
    fn states_are_shown_in_words() {
        let counts = |states: &[&str]| states.iter().map(|state| ((*state).to_owned(), 1)).collect::<Vec<_>>();
        assert_eq!(SystemPage::studies_by_state(&counts(&["not_started", "finished"])), "1 not started, 1 finished");
        assert_eq!(SystemPage::trials_by_state(&counts(&["not_converged"])), "1 not converged");
        assert_eq!(SystemPage::solves_by_state(&counts(&["done", "leased"])), "1 done, 1 running");
        assert_eq!(SystemPage::solves_by_state(&[]), "none");
    }
}
