//! The page of the access log: who viewed or exported data of subjects, and who was refused.

use crate::AppState;
use crate::authorization::Authorized;
use crate::extractors::Params;
use crate::page_error::{PageResult, page};
use askama::Template;
use axum::extract::State;
use gaitwright_service::access::Administer;
use gaitwright_store::SubjectId;
use gaitwright_store::access_log::{self, AccessRow};
use gaitwright_store::subjects;
use serde::Deserialize;

/// Rows of a page.
const PAGE: u32 = 100;

/// Which rows.
#[derive(Debug, Deserialize)]
pub(super) struct AccessLogQuery {
    before: Option<i64>,
    #[serde(default)]
    text: String,
    subject: Option<SubjectId>,
}

#[derive(Template)]
#[template(path = "access_log.html")]
struct AccessLogPage {
    rows: Vec<AccessRow>,
    older: Option<i64>,
    text: String,
    /// The subject whose rows are shown: identifier and pseudonym.
    subject: Option<(SubjectId, String)>,
}

impl AccessLogPage {
    /// The link to older rows with the same search.
    #[allow(clippy::trivially_copy_pass_by_ref)] // templates pass references
    fn before(&self, row: &i64) -> String {
        let subject = self.subject.as_ref().map(|(id, _)| ("subject", id.to_string()));
        let mut chosen = vec![("before", row.to_string()), ("text", self.text.clone())];
        chosen.extend(subject);
        format!("/access-log?{}", serde_urlencoded::to_string(chosen).unwrap_or_default())
    }
}

/// `GET /access-log`.
pub(super) async fn get(
    _: Authorized<Administer>,
    State(app): State<AppState>,
    Params(choice): Params<AccessLogQuery>,
) -> PageResult {
    app.access.log.write(app.store(), true).await?;
    let mut reader = app.read().await?;
    let subject = match choice.subject {
        Some(id) => Some((id, subjects::get(&mut reader, id).await?.pseudonym)),
        None => None,
    };
    let mut rows = access_log::page(&mut reader, choice.text.trim(), choice.subject, choice.before, PAGE + 1).await?;
    drop(reader);
    let more = rows.len() > PAGE as usize;
    rows.truncate(PAGE as usize);
    let older = rows.last().filter(|_| more).map(|row| row.seq);
    page(&AccessLogPage { rows, older, text: choice.text, subject })
}
