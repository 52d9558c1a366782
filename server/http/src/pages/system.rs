//! The system page: version, workers, queue, record and backups.

use super::error::{Page, page};
use super::format::{duration, words};
use crate::AppState;
use crate::api::{Copy, Workers};
use crate::authorization::Authorized;
use askama::Template;
use axum::extract::State;
use gaitwright_service::access::{Administer, Caller, Permission, Read};
use gaitwright_service::error::Error;
use gaitwright_store::totals::{self, Totals};
use gaitwright_store::{FORM, backup, jobs, trials};

#[derive(Template)]
#[template(path = "system.html")]
struct SystemPage {
    version: &'static str,
    /// Version of the database schema.
    form: i64,
    workers: Workers,
    /// The backup that was just made.
    copied: Option<Copy>,
    /// Backups in the folder of the record, newest first: name and bytes.
    copies: Vec<(String, i64)>,
    queued: u32,
    running: u32,
    oldest_queued: String,
    totals: Totals,
    record: String,
    measured: [Option<trials::Measured>; 2],
    may_administer: bool,
}

impl SystemPage {
    #[allow(clippy::trivially_copy_pass_by_ref)] // templates pass references
    fn megabytes(bytes: &i64) -> String {
        format!("{:.1}", *bytes as f64 / 1e6)
    }

    /// `3 finished, 1 running`.
    fn by_state(counts: &[(String, i64)]) -> String {
        if counts.is_empty() {
            return "none".to_owned();
        }
        counts.iter().map(|(state, count)| format!("{count} {}", words(state))).collect::<Vec<_>>().join(", ")
    }
}

/// `GET /system`.
pub(super) async fn get(authorized: Authorized<Read>, State(app): State<AppState>) -> Page {
    show(&app, &authorized.caller, None).await
}

/// `POST /system/backup`: copies the record to a new file beside it, and checks the copy.
pub(super) async fn make_backup(authorized: Authorized<Administer>, State(app): State<AppState>) -> Page {
    let copy = Copy::for_page(app.clone(), authorized.caller.actor.clone()).await?;
    show(&app, &authorized.caller, Some(copy)).await
}

async fn show(app: &AppState, caller: &Caller, copied: Option<Copy>) -> Page {
    let workers = Workers::read(app).await?;
    let mut reader = app.read().await?;
    let totals = totals::read(&mut reader).await?;
    let (queued, running) = jobs::depth(&mut reader).await?;
    let may_administer = caller.may(Administer::NEEDED);
    let record = app.store().path();
    let copies = if may_administer { backup::those_beside(record) } else { Ok(Vec::new()) };
    let measured = [trials::measured(&mut reader, true).await?, trials::measured(&mut reader, false).await?];
    page(&SystemPage {
        version: env!("CARGO_PKG_VERSION"),
        form: FORM,
        copies: copies.map_err(|e| Error::Internal(format!("cannot list the backups: {e}")))?,
        workers,
        copied,
        queued,
        running,
        oldest_queued: duration(totals.oldest_queued_seconds),
        totals,
        record: record.display().to_string(),
        measured,
        may_administer,
    })
}
