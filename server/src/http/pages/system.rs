//! How the service is: versions, workers, queue, record.

use super::error::{Page, page};
use super::format::{duration, words};
use crate::access::{Administer, Permission, Read};
use crate::http::AppState;
use crate::http::may::May;
use crate::store::totals::{self, Totals};
use crate::store::{jobs, trials};
use askama::Template;
use axum::extract::State;

#[derive(Template)]
#[template(path = "system.html")]
struct SystemPage {
    version: &'static str,
    workers: usize,
    queued: u32,
    running: u32,
    oldest_queued: String,
    totals: Totals,
    record: String,
    measured: [Option<trials::Measured>; 2],
    may_administer: bool,
}

impl SystemPage {
    fn megabytes(&self) -> String {
        format!("{:.1}", self.totals.bytes as f64 / 1e6)
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
pub(super) async fn get(may: May<Read>, State(app): State<AppState>) -> Page {
    let mut reader = app.read().await?;
    let totals = totals::read(&mut reader).await?;
    let (queued, running) = jobs::depth(&mut reader).await?;
    let measured = [trials::measured(&mut reader, true).await?, trials::measured(&mut reader, false).await?];
    page(&SystemPage {
        version: env!("CARGO_PKG_VERSION"),
        workers: app.director.workers(),
        queued,
        running,
        oldest_queued: duration(totals.oldest_queued_seconds),
        totals,
        record: app.store().path().display().to_string(),
        measured,
        may_administer: may.caller.may(Administer::NEEDED),
    })
}
