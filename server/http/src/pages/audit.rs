//! The page of the audit trail, with the check of its hash chain.

use crate::AppState;
use crate::authorization::Authorized;
use crate::extractors::Params;
use crate::format::words;
use crate::page_error::{PageResult, page};
use askama::Template;
use axum::extract::State;
use gaitwright_service::access::Administer;
use gaitwright_store::audit::{self, AuditRow, ChainCheck};
use serde::Deserialize;

/// Rows of a page.
const PAGE: u32 = 100;

/// Which rows to show, and whether to verify the chain.
#[derive(Debug, Deserialize)]
pub(super) struct AuditQuery {
    before: Option<i64>,
    #[serde(default)]
    verify: bool,
    /// Text that the rows contain.
    #[serde(default)]
    text: String,
}

#[derive(Template)]
#[template(path = "audit.html")]
struct AuditPage {
    rows: Vec<AuditRow>,
    older: Option<i64>,
    checked: Option<ChainCheck>,
    text: String,
}

impl AuditPage {
    /// `lab_session.process` as `lab session: process`.
    fn words(change: &str) -> String {
        words(change).replacen('.', ": ", 1)
    }

    /// `study 0190...` with only the end of the identifier, which differs most.
    fn short(object: &str) -> String {
        match object.rsplit_once('-') {
            Some((start, end)) if end.len() == 12 => {
                format!("{} {}", start.rsplit_once(' ').map_or("", |(kind, _)| kind), &end[4..])
            }
            _ => object.to_owned(),
        }
    }

    /// The link to older rows with the same search.
    #[allow(clippy::trivially_copy_pass_by_ref)] // templates pass references
    fn before(&self, row: &i64) -> String {
        let query = serde_urlencoded::to_string([("text", self.text.as_str())]).unwrap_or_default();
        format!("/audit?before={row}&{query}")
    }

    /// The page of an object such as `study 0190...`, if there is one.
    fn link(row: &AuditRow) -> Option<String> {
        let (kind, id) = row.object.split_once(' ')?;
        let folder = match kind {
            "study" => "studies",
            "trial" => "trials",
            _ => return None,
        };
        Some(format!("/{folder}/{id}"))
    }
}

/// `GET /audit`.
pub(super) async fn get(
    _: Authorized<Administer>,
    State(app): State<AppState>,
    Params(choice): Params<AuditQuery>,
) -> PageResult {
    let mut reader = app.read().await?;
    let mut rows = audit::page(&mut reader, choice.text.trim(), choice.before, PAGE + 1).await?;
    let more = rows.len() > PAGE as usize;
    rows.truncate(PAGE as usize);
    let older = rows.last().filter(|_| more).map(|row| row.seq);
    let checked = if choice.verify { Some(audit::verify(&mut reader).await?) } else { None };
    page(&AuditPage { rows, older, checked, text: choice.text })
}
