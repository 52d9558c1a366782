//! The audit trail, to read.

use crate::access::Administer;
use crate::error::Error;
use crate::http::AppState;
use crate::http::extract::Params;
use crate::http::may::May;
use crate::http::pages_of::{Before, linked};
use crate::store::audit::{self, AuditRow};
use axum::extract::State;
use axum::response::Response;

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
) -> Result<Response, Error> {
    let limit = page.limit(1000)?;
    let rows = audit::page(&mut *app.read().await?, "", page.before, limit + 1).await?;
    Ok(linked("/api/v1/audit", rows, limit, |row| row.seq.to_string()))
}
