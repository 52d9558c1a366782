//! Studies.

use crate::AppState;
use crate::may::May;
use crate::once::{Once, OnceWith};
use crate::paging::{Page, Paging};
use crate::problem::Refusal;
use crate::reached::Id;
use crate::revision::{IfMatch, tagged};
use axum::Json;
use axum::extract::State;
use axum::response::{IntoResponse, Response};
use gaitwright_service::access::{Read, Run};
use gaitwright_service::studies::change::{self, Change, Extend, Fork};
use gaitwright_service::studies::command;
use gaitwright_service::studies::lifecycle::{Act, acts_of_people};
use gaitwright_service::studies::plan::{self, NewStudy};
use gaitwright_store::studies::{self, Chosen, Study, StudyState};
use gaitwright_store::trials::{self, TrialCounts};
use gaitwright_store::{Connection, LentWriter, StudyId, SubjectId};
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

/// Which studies.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Filter {
    subject_id: Option<SubjectId>,
    state: Option<StudyState>,
}

/// `GET /studies`: newest first.
#[utoipa::path(
    get,
    path = "/studies",
    operation_id = "list_studies",
    tag = "studies",
    params(
        ("subject_id" = Option<SubjectId>, Query, description = "Studies of this subject"),
        ("state" = Option<StudyState>, Query, description = "Studies in this state")
    ),
    responses((status = 200, description = "A page", body = Page<StudyView>)),
    security(("token" = ["read"]), ("session" = ["read"])),
)]
pub(super) async fn list(
    may: May<Read>,
    State(app): State<AppState>,
    paging: Paging<StudyId, Filter>,
) -> Result<Json<Page<StudyView>>, Refusal> {
    let mut reader = app.read().await?;
    let Filter { subject_id, state } = paging.filter;
    let chosen = Chosen { subject: subject_id, state, before: paging.after, limit: paging.to_read() };
    let found = studies::page(&mut reader, may.caller.reach(), chosen).await?;
    let (found, next) = paging.page(found, |study| study.id)?.into_parts();
    let mut views = Vec::with_capacity(found.len());
    for study in found {
        views.push(StudyView::of(&mut reader, study).await?);
    }
    Ok(Json(Page::of_parts(views, next)))
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
    made(&app, &once, writer, study).await
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
    let answer = once.done(app, writer, &view).await?;
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
    let revision = study.revision;
    let view = StudyView::of(&mut writer, study).await?;
    Ok(tagged(once.done(&app, writer, &view).await?, revision))
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
    let revision = study.revision;
    let view = StudyView::of(&mut writer, study).await?;
    Ok(tagged(once.done(&app, writer, &view).await?, revision))
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
    made(&app, &once, writer, study).await
}

async fn made(app: &AppState, once: &Once<Run>, mut writer: LentWriter<'_>, study: Study) -> Result<Response, Refusal> {
    let (location, revision) = (format!("/api/v1/studies/{}", study.id), study.revision);
    let view = StudyView::of(&mut writer, study).await?;
    Ok(tagged(once.created(app, writer, location, &view).await?, revision))
}
