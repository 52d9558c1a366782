//! REST: reference gaits.

use crate::AppState;
use crate::accessible::Id;
use crate::authorization::Authorized;
use crate::idempotent::IdempotentWith;
use crate::paging::{Page, Paging};
use crate::problem_details::Refusal;
use crate::resources::reference_gaits::{ReferenceGait, ReferenceGaitMatch};
use axum::Json;
use axum::extract::State;
use axum::response::Response;
use gaitwright_service::access::{Read, Run};
use gaitwright_service::studies::nearest_reference::{self, ReferenceGaitMatch as Nearest};
use gaitwright_service::studies::reference_import::{self, NewReferenceGait};
use gaitwright_store::{ReferenceGaitId, SubjectId, reference_gaits, subjects};
use std::cmp::Reverse;

/// List reference gaits
///
/// Newest first.
#[utoipa::path(
    get,
    path = "/reference-gaits",
    operation_id = "list_reference_gaits",
    tag = "reference-gaits",
    responses((status = 200, description = "A page", body = Page<ReferenceGait>)),
    security(("token" = ["read"]), ("session" = ["read"])),
)]
pub(super) async fn list(
    _: Authorized<Read>,
    State(app): State<AppState>,
    paging: Paging<Reverse<ReferenceGaitId>>,
) -> Result<Json<Page<ReferenceGait>>, Refusal> {
    let all = reference_gaits::all(&mut *app.read().await?).await?;
    Ok(Json(paging.cut(all, |one| Reverse(one.id))?.map(ReferenceGait::from)))
}

/// Create a reference gait from a recording
///
/// Segments the recording at right heel strikes and averages its strides. If the recording was already imported, the
/// response contains the existing reference gait.
#[utoipa::path(
    post,
    path = "/reference-gaits",
    operation_id = "create_reference_gait",
    tag = "reference-gaits",
    request_body = NewReferenceGait,
    responses(
        (status = 200, description = "Existing reference gait", body = ReferenceGait),
        (status = 201, description = "Reference gait, with its provenance", body = ReferenceGait)
    ),
    security(("token" = ["run"]), ("session" = ["run"])),
)]
pub(super) async fn create(
    State(mut app): State<AppState>,
    IdempotentWith(request, new): IdempotentWith<Run, NewReferenceGait>,
) -> Result<Response, Refusal> {
    if let Some(before) = request.earlier_response(&app).await? {
        return Ok(before);
    }
    let definition = new.definition_on_pool(app.store_mut()).await?;
    let mut writer = match request.begin(&app).await? {
        Ok(writer) => writer,
        Err(before) => return Ok(before),
    };
    let (gait, added) = reference_import::add(&mut writer, &request.actor, &definition).await?;
    let location = format!("/api/v1/reference-gaits/{}", gait.id);
    let gait = ReferenceGait::from(gait);
    if !added {
        return request.done(&app, writer, &gait).await;
    }
    request.created(&app, writer, location, &gait).await
}

/// Get a reference gait
///
/// Its definition has the joint angles over one stride, deviations where there are any, and the provenance.
#[utoipa::path(
    get,
    path = "/reference-gaits/{id}",
    operation_id = "get_reference_gait",
    tag = "reference-gaits",
    params(("id" = ReferenceGaitId, Path, description = "Identifier of the reference gait")),
    responses((status = 200, description = "Reference gait", body = ReferenceGait)),
    security(("token" = ["read"]), ("session" = ["read"])),
)]
pub(super) async fn get(
    _: Authorized<Read>,
    State(app): State<AppState>,
    Id(id, _): Id<ReferenceGaitId, Read>,
) -> Result<Json<ReferenceGait>, Refusal> {
    Ok(Json(reference_gaits::get(&mut *app.read().await?, id).await?.into()))
}

/// List the reference gaits nearest to a subject
///
/// Sorted by distance in height and body mass, the nearest first. Those without height and mass come last.
#[utoipa::path(
    get,
    path = "/subjects/{id}/reference-gaits",
    operation_id = "list_reference_gaits_by_distance",
    tag = "subjects",
    params(("id" = SubjectId, Path, description = "Identifier of the subject")),
    responses((status = 200, description = "Reference gaits with distances", body = Page<ReferenceGaitMatch>)),
    security(("token" = ["read"]), ("session" = ["read"])),
)]
pub(super) async fn of_subject(
    _: Authorized<Read>,
    State(app): State<AppState>,
    Id(id, _): Id<SubjectId, Read>,
    paging: Paging<(u64, Reverse<ReferenceGaitId>)>,
) -> Result<Json<Page<ReferenceGaitMatch>>, Refusal> {
    let mut reader = app.read().await?;
    let subject = subjects::get(&mut reader, id).await?;
    let found = nearest_reference::matches(&mut reader, &subject.body()).await?;
    Ok(Json(paging.cut(found, Nearest::place)?.map(ReferenceGaitMatch::from)))
}
