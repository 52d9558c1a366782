//! Remarks: what is said of two gaits that is no preference.

use super::preferences::Retract;
use crate::AppState;
use crate::may::May;
use crate::once::OnceWith;
use crate::problem::Refusal;
use crate::reached::Id;
use crate::shown::Shown;
use axum::Json;
use axum::extract::State;
use axum::http::StatusCode;
use axum::response::Response;
use gaitwright_service::access::{self, Read};
use gaitwright_service::studies::remark::{self, NewRemark};
use gaitwright_store::remarks::{self, Remark};
use gaitwright_store::{RemarkId, StudyId, studies};

/// `GET /studies/{id}/remarks`: as made, those that were taken back included.
#[utoipa::path(
    get,
    path = "/studies/{id}/remarks",
    operation_id = "list_remarks",
    tag = "preferences",
    params(("id" = StudyId, Path, description = "The study")),
    responses((status = 200, description = "Every remark, by time", body = Vec<Remark>)),
    security(("token" = ["read"]), ("session" = ["read"])),
)]
pub(super) async fn of_study(
    _: May<Read>,
    State(app): State<AppState>,
    Shown(id, _): Shown<StudyId, Read>,
) -> Result<Json<Vec<Remark>>, Refusal> {
    let mut reader = app.read().await?;
    studies::get(&mut reader, id).await?;
    Ok(Json(remarks::of_study(&mut reader, id).await?))
}

/// `POST /studies/{id}/remarks`: that nobody can tell which of two gaits is better, or that one must not be walked. A
/// gait that was called unsafe is not recommended, not asked about and not planned for a lab session.
#[utoipa::path(
    post,
    path = "/studies/{id}/remarks",
    operation_id = "create_remark",
    tag = "preferences",
    params(("id" = StudyId, Path, description = "The study")),
    request_body = NewRemark,
    responses((status = 201, description = "Recorded", body = Remark)),
    security(("token" = ["answer"]), ("session" = ["answer"])),
)]
pub(super) async fn create(
    State(app): State<AppState>,
    Id(id, _): Id<StudyId, access::Answer>,
    OnceWith(once, new): OnceWith<access::Answer, NewRemark>,
) -> Result<Response, Refusal> {
    let mut writer = match once.begin(&app).await? {
        Ok(writer) => writer,
        Err(before) => return Ok(before),
    };
    let made = remark::give(&mut writer, &once.caller, id, &new).await?;
    let row = remarks::get(&mut writer, made).await?;
    once.finish(&app, writer, StatusCode::CREATED, Some(format!("/api/v1/remarks/{made}")), &row).await
}

/// `GET /remarks/{id}`.
#[utoipa::path(
    get,
    path = "/remarks/{id}",
    operation_id = "get_remark",
    tag = "preferences",
    params(("id" = RemarkId, Path, description = "The remark")),
    responses((status = 200, description = "The remark", body = Remark)),
    security(("token" = ["read"]), ("session" = ["read"])),
)]
pub(super) async fn get(
    _: May<Read>,
    State(app): State<AppState>,
    Shown(id, _): Shown<RemarkId, Read>,
) -> Result<Json<Remark>, Refusal> {
    Ok(Json(remarks::get(&mut *app.read().await?, id).await?))
}

/// `POST /remarks/{id}/retract`.
#[utoipa::path(
    post,
    path = "/remarks/{id}/retract",
    operation_id = "retract_remark",
    tag = "preferences",
    params(("id" = RemarkId, Path, description = "The remark")),
    request_body = Retract,
    responses((status = 200, description = "Taken back, with what the learner heard of it: the row stays", body = Remark)),
    security(("token" = ["answer"]), ("session" = ["answer"])),
)]
pub(super) async fn retract(
    State(app): State<AppState>,
    Id(id, _): Id<RemarkId, access::Answer>,
    OnceWith(once, why): OnceWith<access::Answer, Retract>,
) -> Result<Response, Refusal> {
    let mut writer = match once.begin(&app).await? {
        Ok(writer) => writer,
        Err(before) => return Ok(before),
    };
    let row = remark::retract(&mut writer, &once.caller, None, id, (why.author.as_deref(), &why.reason)).await?;
    once.finish(&app, writer, StatusCode::OK, None, &row).await
}
