//! REST: lists the access log.

use crate::AppState;
use crate::authorization::Authorized;
use crate::paging::{Page, Paging, SearchText};
use crate::problem_details::Refusal;
use crate::resources::access_log::AccessRow;
use axum::Json;
use axum::extract::State;
use gaitwright_service::access::Administer;
use gaitwright_store::{SubjectId, access_log};
use serde::Deserialize;

/// Filter of rows.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct AccessLogFilter {
    #[serde(default)]
    text: SearchText,
    subject_id: Option<SubjectId>,
}

/// List the access log
///
/// Views and exports of subjects' data, and refusals, newest first.
#[utoipa::path(
    get,
    path = "/access-log",
    operation_id = "list_access_log",
    tag = "operation",
    params(
        ("text" = Option<String>, Query, max_length = 200, description = "Text to find in the kind, actor, address, object, study or pseudonym"),
        ("subject_id" = Option<SubjectId>, Query, description = "Only rows of this subject")
    ),
    responses((status = 200, description = "A page", body = Page<AccessRow>)),
    security(("token" = ["administer"]), ("session" = ["administer"])),
)]
pub(super) async fn list(
    _: Authorized<Administer>,
    State(app): State<AppState>,
    paging: Paging<i64, AccessLogFilter>,
) -> Result<Json<Page<AccessRow>>, Refusal> {
    app.access.log.write(app.store(), true).await?;
    let AccessLogFilter { text, subject_id } = &paging.filter;
    let mut reader = app.read().await?;
    let rows = access_log::page(&mut reader, text.as_str(), *subject_id, paging.after, paging.to_read()).await?;
    Ok(Json(paging.page(rows, |row| row.seq)?.map(AccessRow::from)))
}
