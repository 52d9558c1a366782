//! The access log, to read.

use crate::AppState;
use crate::extract::Params;
use crate::may::May;
use crate::pages_of::{checked, linked_with};
use crate::problem::Refusal;
use axum::extract::State;
use axum::response::Response;
use gaitwright_service::access::Administer;
use gaitwright_store::SubjectId;
use gaitwright_store::access_log::{self, AccessRow};
use serde::Deserialize;

/// Which rows.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Choice {
    before: Option<i64>,
    limit: Option<String>,
    #[serde(default)]
    contains: String,
    subject: Option<SubjectId>,
}

/// `GET /access-log`: who saw or exported data of subjects, and who was refused; newest first, by pages. The `Link` header
/// has the address of the next one.
#[utoipa::path(
    get,
    path = "/access-log",
    operation_id = "list_access_log",
    tag = "operation",
    params(
        ("contains" = Option<String>, Query, max_length = 200, description = "Rows with these characters in kind, actor, address, object, study or pseudonym"),
        ("subject" = Option<SubjectId>, Query, description = "Rows of this subject"),
        ("before" = Option<i64>, Query, description = "Older than this `seq`"),
        ("limit" = Option<u32>, Query, minimum = 1, maximum = 1000, description = "At most so many: 1 to 1000")
    ),
    responses((status = 200, description = "A page", body = Vec<AccessRow>)),
    security(("token" = ["administer"]), ("session" = ["administer"])),
)]
pub(super) async fn list(
    _: May<Administer>,
    State(app): State<AppState>,
    Params(choice): Params<Choice>,
) -> Result<Response, Refusal> {
    let limit = checked(choice.limit.as_deref(), 1000)?;
    app.access.log.write(app.store(), true).await?;
    let contains = choice.contains.trim();
    let mut reader = app.read().await?;
    let rows = access_log::page(&mut reader, contains, choice.subject, choice.before, limit + 1).await?;
    drop(reader);
    let mut path = vec![("contains", contains.to_owned())];
    path.extend(choice.subject.map(|subject| ("subject", subject.to_string())));
    path.retain(|(_, value)| !value.is_empty());
    let path: Vec<(&str, &str)> = path.iter().map(|(name, value)| (*name, value.as_str())).collect();
    Ok(linked_with("/api/v1/access-log", &path, rows, limit, |row| row.seq.to_string()))
}
