//! reference gaits: read only; they come with the program.

use crate::access::Read;
use crate::error::Error;
use crate::http::AppState;
use crate::http::extract::Id;
use crate::http::may::May;
use crate::store::ReferenceGaitId;
use crate::store::reference_gaits::{self, ReferenceGait};
use axum::Json;
use axum::extract::State;

/// `GET`: all of them.
#[utoipa::path(
    get,
    path = "/reference-gaits",
    tag = "reference-gaits",
    responses((status = 200, description = "All of them", body = Vec<ReferenceGait>)),
    security(("token" = ["read"]), ("session" = ["read"])),
)]
pub(super) async fn list(_: May<Read>, State(app): State<AppState>) -> Result<Json<Vec<ReferenceGait>>, Error> {
    Ok(Json(reference_gaits::all(&mut *app.read().await?).await?))
}

/// `GET {id}`.
#[utoipa::path(
    get,
    path = "/reference-gaits/{id}",
    tag = "reference-gaits",
    params(("id" = ReferenceGaitId, Path, description = "The reference gait")),
    responses((status = 200, description = "The reference gait", body = ReferenceGait)),
    security(("token" = ["read"]), ("session" = ["read"])),
)]
pub(super) async fn get(
    _: May<Read>,
    State(app): State<AppState>,
    Id(id): Id<ReferenceGaitId>,
) -> Result<Json<ReferenceGait>, Error> {
    Ok(Json(reference_gaits::get(&mut *app.read().await?, id).await?))
}
