//! REST: lists the audit trail.

use crate::AppState;
use crate::authorization::Authorized;
use crate::paging::{Page, Paging, SearchText};
use crate::problem_details::Refusal;
use crate::resources::audit::AuditRow;
use axum::Json;
use axum::extract::State;
use gaitwright_service::access::Administer;
use gaitwright_store::audit;
use serde::Deserialize;

/// Filter of rows.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct AuditFilter {
    #[serde(default)]
    text: SearchText,
}

/// List the audit trail
///
/// Every change by a user or a program, newest first.
#[utoipa::path(
    get,
    path = "/audit",
    operation_id = "list_audit_trail",
    tag = "operation",
    params(("text" = Option<String>, Query, max_length = 200, description = "Text to find in the actor, the kind of change or the object")),
    responses((status = 200, description = "A page", body = Page<AuditRow>)),
    security(("token" = ["administer"]), ("session" = ["administer"])),
)]
pub(super) async fn list(
    _: Authorized<Administer>,
    State(app): State<AppState>,
    paging: Paging<i64, AuditFilter>,
) -> Result<Json<Page<AuditRow>>, Refusal> {
    let text = paging.filter.text.as_str();
    let rows = audit::page(&mut *app.read().await?, text, paging.after, paging.to_read()).await?;
    Ok(Json(paging.page(rows, |row| row.seq)?.map(AuditRow::from)))
}
