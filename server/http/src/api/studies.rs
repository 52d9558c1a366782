//! Studies.

use crate::AppState;
use crate::extract::Params;
use crate::may::May;
use crate::once::{Once, OnceWith};
use crate::pages_of::Before;
use crate::problem::Refusal;
use crate::reached::Id;
use crate::revision::{IfMatch, tagged};
use axum::Json;
use axum::extract::State;
use axum::http::StatusCode;
use axum::response::{IntoResponse, Response};
use gaitwright_service::access::{Read, Run};
use gaitwright_service::studies::change::{self, Change, Extend, Fork};
use gaitwright_service::studies::command;
use gaitwright_service::studies::lifecycle::{Act, acts_of_people};
use gaitwright_service::studies::plan::{self, NewStudy};
use gaitwright_store::studies::{self, Study};
use gaitwright_store::trials::{self, TrialCounts};
use gaitwright_store::{Connection, LentWriter, StudyId};
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// A study as answered.
#[derive(Debug, Serialize, ToSchema)]
pub(super) struct StudyView {
    #[serde(flatten)]
    study: Study,
    trials: TrialCounts,
    /// What can be done to it where it stands.
    possible: Vec<&'static str>,
}

impl StudyView {
    async fn of(db: &mut Connection, study: Study) -> Result<Self, Refusal> {
        let trials = trials::counts(db, study.id).await?;
        let possible = acts_of_people(study.state).into_iter().map(Act::as_str).collect();
        Ok(Self { study, trials, possible })
    }
}

/// A page of studies.
#[derive(Debug, Serialize, ToSchema)]
pub(super) struct StudyPage {
    studies: Vec<StudyView>,
    /// Give it as `before` to get the next page; absent on the last one.
    #[serde(skip_serializing_if = "Option::is_none")]
    next: Option<StudyId>,
}

/// `GET`: newest first, by pages.
#[utoipa::path(
    get,
    path = "/studies",
    operation_id = "list_studies",
    tag = "studies",
    params(
        ("before" = Option<StudyId>, Query, description = "Older than this one"),
        ("limit" = Option<u32>, Query, description = "At most so many: 1 to 200")
    ),
    responses((status = 200, description = "A page", body = StudyPage)),
    security(("token" = ["read"]), ("session" = ["read"])),
)]
pub(super) async fn list(
    may: May<Read>,
    State(app): State<AppState>,
    Params(page): Params<Before<StudyId>>,
) -> Result<Json<StudyPage>, Refusal> {
    let limit = page.limit(200)?;
    let mut reader = app.read().await?;
    let mut found = studies::page(&mut reader, may.caller.reach(), page.before, limit + 1).await?;
    let more = found.len() > limit as usize;
    found.truncate(limit as usize);
    let next = if more { found.last().map(|study| study.id) } else { None };
    let mut views = Vec::with_capacity(found.len());
    for study in found {
        views.push(StudyView::of(&mut reader, study).await?);
    }
    Ok(Json(StudyPage { studies: views, next }))
}

/// `GET {id}`: its entity tag is its revision.
#[utoipa::path(
    get,
    path = "/studies/{id}",
    operation_id = "get_study",
    tag = "studies",
    params(("id" = StudyId, Path, description = "The study")),
    responses((
        status = 200,
        description = "The study",
        body = StudyView,
        headers(("ETag" = String, description = "Its revision: give it as If-Match with a change"))
    )),
    security(("token" = ["read"]), ("session" = ["read"])),
)]
pub(super) async fn get(
    _: May<Read>,
    State(app): State<AppState>,
    Id(id, _): Id<StudyId, Read>,
) -> Result<Response, Refusal> {
    let mut reader = app.read().await?;
    let study = studies::get(&mut reader, id).await?;
    let revision = study.revision;
    Ok(tagged(Json(StudyView::of(&mut reader, study).await?).into_response(), revision))
}

/// `POST`: makes one, and starts it unless `start` is false.
#[utoipa::path(
    post,
    path = "/studies",
    operation_id = "create_study",
    tag = "studies",
    request_body = NewStudy,
    responses((status = 201, description = "Made", body = StudyView)),
    security(("token" = ["run"]), ("session" = ["run"])),
)]
pub(super) async fn create(
    State(app): State<AppState>,
    OnceWith(once, new): OnceWith<Run, NewStudy>,
) -> Result<Response, Refusal> {
    let mut writer = match once.begin(&app).await? {
        Ok(writer) => writer,
        Err(before) => return Ok(before),
    };
    let study = plan::create_by(&mut writer, &once.caller, new).await?;
    let view = StudyView::of(&mut writer, study).await?;
    let location = format!("/api/v1/studies/{}", view.study.id);
    once.finish(&app, writer, StatusCode::CREATED, Some(location), &view).await
}

/// Why something is done.
#[derive(Debug, Default, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct Why {
    /// At most 2000 characters; may be left out.
    #[serde(default)]
    #[schema(max_length = 2000)]
    reason: String,
}

/// `POST {id}/start`.
#[utoipa::path(
    post,
    path = "/studies/{id}/start",
    operation_id = "start_study",
    tag = "studies",
    params(("id" = StudyId, Path, description = "The study"), IfMatch),
    request_body(content = Why, description = "May be left out"),
    responses((status = 200, description = "Started", body = StudyView)),
    security(("token" = ["run"]), ("session" = ["run"])),
)]
pub(super) async fn start(
    State(app): State<AppState>,
    Id(id, _): Id<StudyId, Run>,
    expected: IfMatch,
    OnceWith(once, why): OnceWith<Run, Why>,
) -> Result<Response, Refusal> {
    act(&app, id, expected, &once, Act::Start, &why).await
}

/// `POST {id}/pause`.
#[utoipa::path(
    post,
    path = "/studies/{id}/pause",
    operation_id = "pause_study",
    tag = "studies",
    params(("id" = StudyId, Path, description = "The study"), IfMatch),
    request_body(content = Why, description = "May be left out"),
    responses((status = 200, description = "Held: solves that run are finished, nothing new starts", body = StudyView)),
    security(("token" = ["run"]), ("session" = ["run"])),
)]
pub(super) async fn pause(
    State(app): State<AppState>,
    Id(id, _): Id<StudyId, Run>,
    expected: IfMatch,
    OnceWith(once, why): OnceWith<Run, Why>,
) -> Result<Response, Refusal> {
    act(&app, id, expected, &once, Act::Pause, &why).await
}

/// `POST {id}/resume`.
#[utoipa::path(
    post,
    path = "/studies/{id}/resume",
    operation_id = "resume_study",
    tag = "studies",
    params(("id" = StudyId, Path, description = "The study"), IfMatch),
    request_body(content = Why, description = "May be left out"),
    responses((status = 200, description = "Goes on", body = StudyView)),
    security(("token" = ["run"]), ("session" = ["run"])),
)]
pub(super) async fn resume(
    State(app): State<AppState>,
    Id(id, _): Id<StudyId, Run>,
    expected: IfMatch,
    OnceWith(once, why): OnceWith<Run, Why>,
) -> Result<Response, Refusal> {
    act(&app, id, expected, &once, Act::Resume, &why).await
}

/// `POST {id}/stop`.
#[utoipa::path(
    post,
    path = "/studies/{id}/stop",
    operation_id = "stop_study",
    tag = "studies",
    params(("id" = StudyId, Path, description = "The study"), IfMatch),
    request_body(content = Why, description = "May be left out"),
    responses((status = 200, description = "Ended: open trials are cancelled", body = StudyView)),
    security(("token" = ["run"]), ("session" = ["run"])),
)]
pub(super) async fn stop(
    State(app): State<AppState>,
    Id(id, _): Id<StudyId, Run>,
    expected: IfMatch,
    OnceWith(once, why): OnceWith<Run, Why>,
) -> Result<Response, Refusal> {
    act(&app, id, expected, &once, Act::Stop, &why).await
}

async fn act(
    app: &AppState,
    id: StudyId,
    expected: IfMatch,
    once: &Once<Run>,
    act: Act,
    why: &Why,
) -> Result<Response, Refusal> {
    let mut writer = match once.begin(app).await? {
        Ok(writer) => writer,
        Err(before) => return Ok(before),
    };
    expected.check(studies::get(&mut writer, id).await?.revision)?;
    let done = command::act(&mut writer, &once.actor, id, act, &why.reason).await?;
    let revision = done.study.revision;
    let view = StudyView::of(&mut writer, done.study).await?;
    let answer = once.finish(app, writer, StatusCode::OK, None, &view).await?;
    for trial in done.cancelled {
        app.scheduler.cancel_solve(trial).await;
    }
    Ok(tagged(answer, revision))
}

/// `PATCH {id}`: changes it in place.
#[utoipa::path(
    patch,
    path = "/studies/{id}",
    operation_id = "update_study",
    tag = "studies",
    params(("id" = StudyId, Path, description = "The study"), IfMatch),
    request_body = Change,
    responses((status = 200, description = "Changed", body = StudyView)),
    security(("token" = ["run"]), ("session" = ["run"])),
)]
pub(super) async fn patch(
    State(app): State<AppState>,
    Id(id, _): Id<StudyId, Run>,
    expected: IfMatch,
    OnceWith(once, new): OnceWith<Run, Change>,
) -> Result<Response, Refusal> {
    let mut writer = match once.begin(&app).await? {
        Ok(writer) => writer,
        Err(before) => return Ok(before),
    };
    expected.check(studies::get(&mut writer, id).await?.revision)?;
    let study = change::change(&mut writer, &once.actor, id, &new).await?;
    answer(&app, &once, writer, study, StatusCode::OK).await
}

/// `POST {id}/extend`: more trials; an ended study goes on.
#[utoipa::path(
    post,
    path = "/studies/{id}/extend",
    operation_id = "extend_study",
    tag = "studies",
    params(("id" = StudyId, Path, description = "The study"), IfMatch),
    request_body = Extend,
    responses((status = 200, description = "Extended", body = StudyView)),
    security(("token" = ["run"]), ("session" = ["run"])),
)]
pub(super) async fn extend(
    State(app): State<AppState>,
    Id(id, _): Id<StudyId, Run>,
    expected: IfMatch,
    OnceWith(once, more): OnceWith<Run, Extend>,
) -> Result<Response, Refusal> {
    let mut writer = match once.begin(&app).await? {
        Ok(writer) => writer,
        Err(before) => return Ok(before),
    };
    expected.check(studies::get(&mut writer, id).await?.revision)?;
    let study = change::extend(&mut writer, &once.actor, id, &more).await?;
    answer(&app, &once, writer, study, StatusCode::OK).await
}

/// `POST {id}/fork`: a study with the same set-up and none of the trials.
#[utoipa::path(
    post,
    path = "/studies/{id}/fork",
    operation_id = "fork_study",
    tag = "studies",
    params(("id" = StudyId, Path, description = "The study")),
    request_body(content = Fork, description = "What differs; may be left out"),
    responses((status = 201, description = "Made", body = StudyView)),
    security(("token" = ["run"]), ("session" = ["run"])),
)]
pub(super) async fn fork(
    State(app): State<AppState>,
    Id(id, _): Id<StudyId, Run>,
    OnceWith(once, differs): OnceWith<Run, Fork>,
) -> Result<Response, Refusal> {
    let mut writer = match once.begin(&app).await? {
        Ok(writer) => writer,
        Err(before) => return Ok(before),
    };
    let study = change::fork(&mut writer, &once.actor, id, &differs).await?;
    answer(&app, &once, writer, study, StatusCode::CREATED).await
}

async fn answer(
    app: &AppState,
    once: &Once<Run>,
    mut writer: LentWriter<'_>,
    study: Study,
    status: StatusCode,
) -> Result<Response, Refusal> {
    let (id, revision) = (study.id, study.revision);
    let view = StudyView::of(&mut writer, study).await?;
    let location = (status == StatusCode::CREATED).then(|| format!("/api/v1/studies/{id}"));
    Ok(tagged(once.finish(app, writer, status, location, &view).await?, revision))
}
