//! REST: assessments, which are answers about two gaits that state no preference.

use super::preferences::AnswerRetraction;
use crate::AppState;
use crate::accessible::Id;
use crate::authorization::Authorized;
use crate::idempotent::IdempotentWith;
use crate::paging::{Page, Paging};
use crate::problem_details::Refusal;
use crate::resources::assessments::Assessment;
use crate::visible::Visible;
use axum::Json;
use axum::extract::State;
use axum::response::Response;
use gaitwright_service::access::{self, Read};
use gaitwright_service::studies::assessment_answer::{self, NewAssessment};
use gaitwright_store::{AssessmentId, StudyId, assessments, studies};

/// List assessments of a study
///
/// Answers about two gaits that state no preference, retracted ones included, oldest first.
#[utoipa::path(
    get,
    path = "/studies/{id}/assessments",
    operation_id = "list_assessments",
    tag = "preferences",
    params(("id" = StudyId, Path, description = "Identifier of the study")),
    responses((status = 200, description = "A page, oldest first", body = Page<Assessment>), (status = 409, description = "The subject withdrew consent")),
    security(("token" = ["read"]), ("session" = ["read"])),
)]
pub(super) async fn of_study(
    _: Authorized<Read>,
    State(app): State<AppState>,
    Visible(id, _): Visible<StudyId, Read>,
    paging: Paging<AssessmentId>,
) -> Result<Json<Page<Assessment>>, Refusal> {
    let mut reader = app.read().await?;
    studies::get(&mut reader, id).await?;
    let all = assessments::of_study(&mut reader, id).await?;
    Ok(Json(paging.cut(all, |assessment| assessment.id)?.map(Assessment::from)))
}

/// Create an assessment of two gaits
///
/// States that the author cannot tell which gait is better, or that a gait is unsafe. An unsafe gait is not
/// recommended, compared or planned for lab sessions until staff have cleared the gait.
#[utoipa::path(
    post,
    path = "/studies/{id}/assessments",
    operation_id = "create_assessment",
    tag = "preferences",
    params(("id" = StudyId, Path, description = "Identifier of the study")),
    request_body = NewAssessment,
    responses((status = 201, description = "Assessment", body = Assessment)),
    security(("token" = ["answer"]), ("session" = ["answer"])),
)]
pub(super) async fn create(
    State(app): State<AppState>,
    Id(id, _): Id<StudyId, access::Answer>,
    IdempotentWith(request, new): IdempotentWith<access::Answer, NewAssessment>,
) -> Result<Response, Refusal> {
    let mut writer = match request.begin(&app).await? {
        Ok(writer) => writer,
        Err(before) => return Ok(before),
    };
    let made = assessment_answer::give(&mut writer, &request.caller, id, &new).await?;
    let row = assessments::get(&mut writer, made).await?;
    request.created(&app, writer, format!("/api/v1/assessments/{made}"), &Assessment::from(row)).await
}

/// Get an assessment
///
/// Retracted assessments are returned, too, with their retraction.
#[utoipa::path(
    get,
    path = "/assessments/{id}",
    operation_id = "get_assessment",
    tag = "preferences",
    params(("id" = AssessmentId, Path, description = "Identifier of the assessment")),
    responses((status = 200, description = "Assessment", body = Assessment), (status = 409, description = "The subject withdrew consent")),
    security(("token" = ["read"]), ("session" = ["read"])),
)]
pub(super) async fn get(
    _: Authorized<Read>,
    State(app): State<AppState>,
    Visible(id, _): Visible<AssessmentId, Read>,
) -> Result<Json<Assessment>, Refusal> {
    Ok(Json(assessments::get(&mut *app.read().await?, id).await?.into()))
}

/// Retract an assessment
///
/// The assessment stays on record. The learner no longer uses the preference derived from it.
#[utoipa::path(
    post,
    path = "/assessments/{id}/retract",
    operation_id = "retract_assessment",
    tag = "preferences",
    params(("id" = AssessmentId, Path, description = "Identifier of the assessment")),
    request_body = AnswerRetraction,
    responses((status = 200, description = "Retracted assessment", body = Assessment)),
    security(("token" = ["answer"]), ("session" = ["answer"])),
)]
pub(super) async fn retract(
    State(app): State<AppState>,
    Id(id, _): Id<AssessmentId, access::Answer>,
    IdempotentWith(request, why): IdempotentWith<access::Answer, AnswerRetraction>,
) -> Result<Response, Refusal> {
    let mut writer = match request.begin(&app).await? {
        Ok(writer) => writer,
        Err(before) => return Ok(before),
    };
    let row = assessment_answer::retract(&mut writer, &request.caller, None, id, (why.author.as_deref(), &why.reason))
        .await?;
    request.done(&app, writer, &Assessment::from(row)).await
}
