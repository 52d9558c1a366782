//! REST: studies.

use super::study_sort::StudySort;
use crate::AppState;
use crate::accessible::Id;
use crate::authorization::Authorized;
use crate::entity_tag::{IfMatch, tagged};
use crate::idempotent::{Idempotent, IdempotentWith};
use crate::paging::{Page, Paging};
use crate::problem_details::Refusal;
use crate::resources::studies::Study;
use crate::resources::trials::TrialCounts;
use axum::Json;
use axum::extract::State;
use axum::response::{IntoResponse, Response};
use gaitwright_service::access::{Read, Run};
use gaitwright_service::studies::command;
use gaitwright_service::studies::lifecycle::{StudyTransition, transitions_for_people};
use gaitwright_service::studies::study_change::{self, StudyChange};
use gaitwright_service::studies::study_clone::{self, StudyClone};
use gaitwright_service::studies::study_extension::{self, StudyExtension};
use gaitwright_service::studies::study_plan::{self, NewStudy};
use gaitwright_store::studies::{self, StudyFilter, StudyState};
use gaitwright_store::{BorrowedWriter, Connection, StudyId, SubjectId, trials};
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// Study with its possible commands.
#[derive(Debug, Serialize, ToSchema)]
pub(super) struct StudyWithCommands {
    #[serde(flatten)]
    study: Study,
    /// Numbers of trials by state.
    trials: TrialCounts,
    /// Commands that are possible in the current state: `start`, `pause`, `resume`, `stop`, `extend`.
    possible: Vec<&'static str>,
}

impl StudyWithCommands {
    async fn of(db: &mut Connection, study: studies::Study) -> Result<Self, Refusal> {
        let trials = trials::counts(db, study.id).await?;
        let possible = transitions_for_people(study.state).into_iter().map(StudyTransition::as_str).collect();
        Ok(Self { study: study.into(), trials: trials.into(), possible })
    }
}

/// Filter of studies.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct StudyQuery {
    subject_id: Option<SubjectId>,
    #[serde(default)]
    text: String,
    #[serde(default)]
    tag: String,
    state: Option<StudyState>,
    #[serde(default)]
    archived: bool,
    #[serde(default)]
    sort: StudySort,
}

/// List studies
///
/// Newest first, unless `sort` names another order.
#[utoipa::path(
    get,
    path = "/studies",
    operation_id = "list_studies",
    tag = "studies",
    params(
        ("subject_id" = Option<SubjectId>, Query, description = "Only studies of this subject"),
        ("text" = Option<String>, Query, description = "Only studies whose name, tags, notes or subject's pseudonym contains this text"),
        ("tag" = Option<String>, Query, description = "Only studies with this tag"),
        ("state" = Option<StudyState>, Query, description = "Only studies in this state"),
        ("archived" = Option<bool>, Query, description = "If true, only archived studies. If false (the default), only studies that are not archived"),
        ("sort" = Option<String>, Query, description = "Column to sort by: `created_at`, `name` or `state`. A leading minus sorts in descending order")
    ),
    responses((status = 200, description = "A page", body = Page<StudyWithCommands>)),
    security(("token" = ["read"]), ("session" = ["read"])),
)]
pub(super) async fn list(
    authorized: Authorized<Read>,
    State(app): State<AppState>,
    paging: Paging<StudyId, StudyQuery>,
) -> Result<Json<Page<StudyWithCommands>>, Refusal> {
    let mut reader = app.read().await?;
    let (after, limit) = (paging.after, paging.to_read());
    let StudyQuery { subject_id: subject, text, tag, state, archived, sort } = paging.filter.clone();
    let (archived, ascending) = (Some(archived), sort.ascending);
    let filter = StudyFilter { subject, text, tag, state, archived, sort: sort.column, ascending, after, limit };
    let found = studies::page(&mut reader, authorized.caller.reach(), &filter).await?;
    let (found, next) = paging.page(found, |study| study.id)?.into_parts();
    let mut views = Vec::with_capacity(found.len());
    for study in found {
        views.push(StudyWithCommands::of(&mut reader, study).await?);
    }
    Ok(Json(Page::of_parts(views, next)))
}

/// Get a study
///
/// The ETag is the revision of the study.
#[utoipa::path(
    get,
    path = "/studies/{id}",
    operation_id = "get_study",
    tag = "studies",
    params(("id" = StudyId, Path, description = "Identifier of the study")),
    responses((
        status = 200,
        description = "The study",
        body = StudyWithCommands,
        headers(("ETag" = String, description = "Revision, for the If-Match header of a change"))
    )),
    security(("token" = ["read"]), ("session" = ["read"])),
)]
pub(super) async fn get(
    _: Authorized<Read>,
    State(app): State<AppState>,
    Id(id, _): Id<StudyId, Read>,
) -> Result<Response, Refusal> {
    let mut reader = app.read().await?;
    let study = studies::get(&mut reader, id).await?;
    let revision = study.revision;
    Ok(tagged(Json(StudyWithCommands::of(&mut reader, study).await?).into_response(), revision))
}

/// Create a study
///
/// Starts the study, unless `start` is false.
#[utoipa::path(
    post,
    path = "/studies",
    operation_id = "create_study",
    tag = "studies",
    request_body = NewStudy,
    responses((status = 201, description = "Study", body = StudyWithCommands), (status = 404, description = "No such subject, device or reference gait")),
    security(("token" = ["run"]), ("session" = ["run"])),
)]
pub(super) async fn create(
    State(app): State<AppState>,
    IdempotentWith(request, new): IdempotentWith<Run, NewStudy>,
) -> Result<Response, Refusal> {
    let mut writer = match request.begin(&app).await? {
        Ok(writer) => writer,
        Err(before) => return Ok(before),
    };
    let study = study_plan::create_by(&mut writer, &request.caller, new).await?;
    made(&app, &request, writer, study).await
}

/// Reason for a command.
#[derive(Debug, Default, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct StateChangeReason {
    /// Reason, at most 2000 characters.
    #[serde(default)]
    #[schema(max_length = 2000)]
    reason: String,
}

/// Start a study
///
/// Possible while the study is `not_started`.
#[utoipa::path(
    post,
    path = "/studies/{id}/start",
    operation_id = "start_study",
    tag = "studies",
    params(("id" = StudyId, Path, description = "Identifier of the study"), IfMatch),
    request_body(content = StateChangeReason, description = "Optional: the reason"),
    responses((status = 200, description = "Started study", body = StudyWithCommands)),
    security(("token" = ["run"]), ("session" = ["run"])),
)]
pub(super) async fn start(
    State(app): State<AppState>,
    Id(id, _): Id<StudyId, Run>,
    expected: IfMatch,
    IdempotentWith(request, why): IdempotentWith<Run, StateChangeReason>,
) -> Result<Response, Refusal> {
    transition(&app, id, expected, &request, StudyTransition::Start, &why).await
}

/// Pause a study
///
/// Running solves finish, and no new one starts.
#[utoipa::path(
    post,
    path = "/studies/{id}/pause",
    operation_id = "pause_study",
    tag = "studies",
    params(("id" = StudyId, Path, description = "Identifier of the study"), IfMatch),
    request_body(content = StateChangeReason, description = "Optional: the reason"),
    responses((status = 200, description = "Paused study", body = StudyWithCommands)),
    security(("token" = ["run"]), ("session" = ["run"])),
)]
pub(super) async fn pause(
    State(app): State<AppState>,
    Id(id, _): Id<StudyId, Run>,
    expected: IfMatch,
    IdempotentWith(request, why): IdempotentWith<Run, StateChangeReason>,
) -> Result<Response, Refusal> {
    transition(&app, id, expected, &request, StudyTransition::Pause, &why).await
}

/// Resume a study
///
/// Possible while the study is `paused`.
#[utoipa::path(
    post,
    path = "/studies/{id}/resume",
    operation_id = "resume_study",
    tag = "studies",
    params(("id" = StudyId, Path, description = "Identifier of the study"), IfMatch),
    request_body(content = StateChangeReason, description = "Optional: the reason"),
    responses((status = 200, description = "Resumed study", body = StudyWithCommands)),
    security(("token" = ["run"]), ("session" = ["run"])),
)]
pub(super) async fn resume(
    State(app): State<AppState>,
    Id(id, _): Id<StudyId, Run>,
    expected: IfMatch,
    IdempotentWith(request, why): IdempotentWith<Run, StateChangeReason>,
) -> Result<Response, Refusal> {
    transition(&app, id, expected, &request, StudyTransition::Resume, &why).await
}

/// Stop a study
///
/// Cancels open trials.
#[utoipa::path(
    post,
    path = "/studies/{id}/stop",
    operation_id = "stop_study",
    tag = "studies",
    params(("id" = StudyId, Path, description = "Identifier of the study"), IfMatch),
    request_body(content = StateChangeReason, description = "Optional: the reason"),
    responses((status = 200, description = "Stopped study", body = StudyWithCommands)),
    security(("token" = ["run"]), ("session" = ["run"])),
)]
pub(super) async fn stop(
    State(app): State<AppState>,
    Id(id, _): Id<StudyId, Run>,
    expected: IfMatch,
    IdempotentWith(request, why): IdempotentWith<Run, StateChangeReason>,
) -> Result<Response, Refusal> {
    transition(&app, id, expected, &request, StudyTransition::Stop, &why).await
}

async fn transition(
    app: &AppState,
    id: StudyId,
    expected: IfMatch,
    request: &Idempotent<Run>,
    transition: StudyTransition,
    why: &StateChangeReason,
) -> Result<Response, Refusal> {
    let mut writer = match request.begin(app).await? {
        Ok(writer) => writer,
        Err(before) => return Ok(before),
    };
    expected.check(studies::get(&mut writer, id).await?.revision)?;
    let done = command::transition(&mut writer, &request.actor, id, transition, &why.reason).await?;
    let revision = done.study.revision;
    let view = StudyWithCommands::of(&mut writer, done.study).await?;
    let answer = request.done(app, writer, &view).await?;
    for trial in done.cancelled {
        app.scheduler.cancel_solve(trial).await;
    }
    Ok(tagged(answer, revision))
}

/// Update a study
///
/// Changes the name, tags, notes, priority, number of parallel trials or archived state. Absent fields keep their
/// values.
#[utoipa::path(
    patch,
    path = "/studies/{id}",
    operation_id = "update_study",
    tag = "studies",
    params(("id" = StudyId, Path, description = "Identifier of the study"), IfMatch),
    request_body = StudyChange,
    responses((status = 200, description = "Updated study", body = StudyWithCommands)),
    security(("token" = ["run"]), ("session" = ["run"])),
)]
pub(super) async fn patch(
    State(app): State<AppState>,
    Id(id, _): Id<StudyId, Run>,
    expected: IfMatch,
    IdempotentWith(request, new): IdempotentWith<Run, StudyChange>,
) -> Result<Response, Refusal> {
    let mut writer = match request.begin(&app).await? {
        Ok(writer) => writer,
        Err(before) => return Ok(before),
    };
    expected.check(studies::get(&mut writer, id).await?.revision)?;
    let study = study_change::change(&mut writer, &request.actor, request.caller.reach(), id, &new).await?;
    let revision = study.revision;
    let view = StudyWithCommands::of(&mut writer, study).await?;
    Ok(tagged(request.done(&app, writer, &view).await?, revision))
}

/// Extend a study
///
/// If the study has ended, it resumes.
#[utoipa::path(
    post,
    path = "/studies/{id}/extend",
    operation_id = "extend_study",
    tag = "studies",
    params(("id" = StudyId, Path, description = "Identifier of the study"), IfMatch),
    request_body = StudyExtension,
    responses((status = 200, description = "Extended study", body = StudyWithCommands)),
    security(("token" = ["run"]), ("session" = ["run"])),
)]
pub(super) async fn extend(
    State(app): State<AppState>,
    Id(id, _): Id<StudyId, Run>,
    expected: IfMatch,
    IdempotentWith(request, more): IdempotentWith<Run, StudyExtension>,
) -> Result<Response, Refusal> {
    let mut writer = match request.begin(&app).await? {
        Ok(writer) => writer,
        Err(before) => return Ok(before),
    };
    expected.check(studies::get(&mut writer, id).await?.revision)?;
    let study = study_extension::extend(&mut writer, &request.actor, id, &more).await?;
    let revision = study.revision;
    let view = StudyWithCommands::of(&mut writer, study).await?;
    Ok(tagged(request.done(&app, writer, &view).await?, revision))
}

/// Clone a study
///
/// Creates a study with the same set-up, without the trials.
#[utoipa::path(
    post,
    path = "/studies/{id}/clone",
    operation_id = "clone_study",
    tag = "studies",
    params(("id" = StudyId, Path, description = "Identifier of the study")),
    request_body(content = StudyClone, description = "Optional: the fields that differ from the parent"),
    responses((status = 201, description = "New study", body = StudyWithCommands)),
    security(("token" = ["run"]), ("session" = ["run"])),
)]
pub(super) async fn clone_study(
    State(app): State<AppState>,
    Id(id, _): Id<StudyId, Run>,
    IdempotentWith(request, differs): IdempotentWith<Run, StudyClone>,
) -> Result<Response, Refusal> {
    let mut writer = match request.begin(&app).await? {
        Ok(writer) => writer,
        Err(before) => return Ok(before),
    };
    let study = study_clone::clone_study(&mut writer, &request.actor, request.caller.reach(), id, &differs).await?;
    made(&app, &request, writer, study).await
}

async fn made(
    app: &AppState,
    request: &Idempotent<Run>,
    mut writer: BorrowedWriter<'_>,
    study: studies::Study,
) -> Result<Response, Refusal> {
    let (location, revision) = (format!("/api/v1/studies/{}", study.id), study.revision);
    let view = StudyWithCommands::of(&mut writer, study).await?;
    Ok(tagged(request.created(app, writer, location, &view).await?, revision))
}
