//! Subjects.

use crate::access::{Read, Run};
use crate::error::Error;
use crate::http::AppState;
use crate::http::extract::{Id, Params};
use crate::http::may::May;
use crate::http::once::OnceWith;
use crate::http::pages_of::{Before, linked};
use crate::store::SubjectId;
use crate::store::subjects::{self, Subject};
use crate::studies::person::{self, NewSubject};
use axum::Json;
use axum::extract::State;
use axum::http::StatusCode;
use axum::response::Response;

/// `GET`: newest first, by pages; the `Link` header has the address of the next one.
#[utoipa::path(
    get,
    path = "/subjects",
    tag = "subjects",
    params(("before" = Option<SubjectId>, Query, description = "Older than this one"), ("limit" = Option<u32>, Query, description = "At most so many: 1 to 1000")),
    responses((status = 200, description = "A page", body = Vec<Subject>)),
    security(("token" = ["read"]), ("session" = ["read"])),
)]
pub(super) async fn list(
    _: May<Read>,
    State(app): State<AppState>,
    Params(page): Params<Before<SubjectId>>,
) -> Result<Response, Error> {
    let limit = page.limit(1000)?;
    let found = subjects::page(&mut *app.read().await?, page.before, limit + 1).await?;
    Ok(linked("/api/v1/subjects", found, limit, |subject| subject.id.to_string()))
}

/// `GET {id}`.
#[utoipa::path(
    get,
    path = "/subjects/{id}",
    tag = "subjects",
    params(("id" = SubjectId, Path, description = "The subject")),
    responses((status = 200, description = "The subject", body = Subject)),
    security(("token" = ["read"]), ("session" = ["read"])),
)]
pub(super) async fn get(
    _: May<Read>,
    State(app): State<AppState>,
    Id(id): Id<SubjectId>,
) -> Result<Json<Subject>, Error> {
    Ok(Json(subjects::get(&mut *app.read().await?, id).await?))
}

/// `POST`: adds one.
#[utoipa::path(
    post,
    path = "/subjects",
    tag = "subjects",
    request_body = NewSubject,
    responses((status = 201, description = "Added", body = Subject)),
    security(("token" = ["run"]), ("session" = ["run"])),
)]
pub(super) async fn create(
    State(app): State<AppState>,
    OnceWith(once, new): OnceWith<Run, NewSubject>,
) -> Result<Response, Error> {
    let mut writer = match once.begin(&app).await? {
        Ok(writer) => writer,
        Err(before) => return Ok(before),
    };
    let subject = person::add(&mut writer, &once.actor, &new).await?;
    let location = format!("/api/v1/subjects/{}", subject.id);
    once.finish(&app, writer, StatusCode::CREATED, Some(location), &subject).await
}
