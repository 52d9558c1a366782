//! reference gaits: read only; they come with the program.

use crate::error::Error;
use crate::http::AppState;
use crate::http::extract::Id;
use crate::store::ReferenceGaitId;
use crate::store::reference_gaits::{self, ReferenceGait};
use axum::Json;
use axum::extract::State;

/// `GET`: all of them.
pub(super) async fn list(State(app): State<AppState>) -> Result<Json<Vec<ReferenceGait>>, Error> {
    Ok(Json(reference_gaits::all(&mut *app.read().await?).await?))
}

/// `GET {id}`.
pub(super) async fn get(
    State(app): State<AppState>,
    Id(id): Id<ReferenceGaitId>,
) -> Result<Json<ReferenceGait>, Error> {
    Ok(Json(reference_gaits::get(&mut *app.read().await?, id).await?))
}
