//! A whole study as one file.

use crate::access::Administer;
use crate::error::Error;
use crate::http::AppState;
use crate::http::may::May;
use crate::http::reached::Id;
use crate::store::{StudyId, archive};
use axum::extract::State;
use axum::http::header;
use axum::response::{IntoResponse, Response};

/// `GET /studies/{id}/archive`: every row, blind sessions included, as `gaitwright export` writes it.
#[utoipa::path(
    get,
    path = "/studies/{id}/archive",
    tag = "studies",
    params(("id" = StudyId, Path, description = "The study")),
    responses((status = 200, description = "An archive for `gaitwright import`", body = Vec<u8>, content_type = "application/octet-stream")),
    security(("token" = ["administer"]), ("session" = ["administer"])),
)]
pub(super) async fn of_study(
    _: May<Administer>,
    State(app): State<AppState>,
    Id(id, _): Id<StudyId, Administer>,
) -> Result<Response, Error> {
    let bytes = archive::of_study(&mut *app.read().await?, id).await?;
    let headers = [
        (header::CONTENT_TYPE, "application/octet-stream".to_owned()),
        (header::CONTENT_DISPOSITION, format!("attachment; filename=\"study-{}.gait\"", id.short())),
    ];
    Ok((headers, bytes).into_response())
}
