//! REST: limit cycles of the walks of a lab session.

use crate::AppState;
use crate::authorization::Authorized;
use crate::paging::{Page, Paging};
use crate::problem_details::Refusal;
use crate::resources::limit_cycles::LimitCycles;
use crate::visible::Visible;
use axum::Json;
use axum::extract::State;
use gaitwright_service::access::Read;
use gaitwright_service::studies::lab;
use gaitwright_store::LabSessionId;

/// List limit cycles
///
/// Angle and velocity of every recorded joint, from the newest joint angles of each walk. Sorted by walk.
#[utoipa::path(
    get,
    path = "/lab-sessions/{id}/limit-cycles",
    operation_id = "list_limit_cycles",
    tag = "lab",
    params(("id" = LabSessionId, Path, description = "Identifier of the lab session")),
    responses((status = 200, description = "One entry for each walk", body = Page<LimitCycles>), (status = 409, description = "The subject withdrew consent")),
    security(("token" = ["read"]), ("session" = ["read"])),
)]
pub(super) async fn list(
    _: Authorized<Read>,
    State(mut app): State<AppState>,
    Visible(id, _): Visible<LabSessionId, Read>,
    paging: Paging<u8>,
) -> Result<Json<Page<LimitCycles>>, Refusal> {
    Ok(Json(paging.cut(lab::limit_cycles(app.store_mut(), id).await?, |of| of.walk)?.map(LimitCycles::from)))
}
