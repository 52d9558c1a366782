//! The audit trail, to read.

use crate::AppState;
use crate::extract::Params;
use crate::may::May;
use crate::pages_of::{Before, linked};
use crate::problem::Refusal;
use axum::extract::State;
use axum::response::Response;
use gaitwright_service::access::Administer;
use gaitwright_store::audit::{self, AuditRow};

/// `GET /audit`: newest first, by pages; the `Link` header has the address of the next one.
#[utoipa::path(
    get,
    path = "/audit",
    operation_id = "list_audit_trail",
    tag = "operation",
    params(
        ("before" = Option<i64>, Query, description = "Older than this `seq`"),
        ("limit" = Option<u32>, Query, description = "At most so many: 1 to 1000")
    ),
    responses((status = 200, description = "A page", body = Vec<AuditRow>)),
    security(("token" = ["administer"]), ("session" = ["administer"])),
)]
pub(super) async fn list(
    _: May<Administer>,
    State(app): State<AppState>,
    Params(page): Params<Before<i64>>,
) -> Result<Response, Refusal> {
    let limit = page.limit(1000)?;
    let rows = audit::page(&mut *app.read().await?, "", page.before, limit + 1).await?;
    Ok(linked("/api/v1/audit", rows, limit, |row| row.seq.to_string()))
}
