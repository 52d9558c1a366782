//! REST: subjects, with consents, corrections and muscle measurements.

use crate::AppState;
use crate::accessible::{DespiteWithdrawal, Id};
use crate::authorization::Authorized;
use crate::idempotent::IdempotentWith;
use crate::paging::{Page, Paging};
use crate::problem_details::Refusal;
use crate::resources::document_schemas;
use crate::resources::subjects::{Consent, Correction, Subject};
use crate::visible::Visible;
use axum::Json;
use axum::extract::State;
use axum::response::Response;
use gait_optimizer::muscle::MuscleParameters;
use gaitwright_service::access::{Read, Run};
use gaitwright_service::studies::consent::{self, ConsentWithdrawal, NewConsent};
use gaitwright_service::studies::subject::{self, NewCorrection, NewSubject};
use gaitwright_store::{SubjectId, consents, subjects};

/// List subjects
///
/// Newest first.
#[utoipa::path(
    get,
    path = "/subjects",
    operation_id = "list_subjects",
    tag = "subjects",
    responses((status = 200, description = "A page", body = Page<Subject>)),
    security(("token" = ["read"]), ("session" = ["read"])),
)]
pub(super) async fn list(
    _: Authorized<Read>,
    State(app): State<AppState>,
    paging: Paging<SubjectId>,
) -> Result<Json<Page<Subject>>, Refusal> {
    let found = subjects::page(&mut *app.read().await?, paging.after, paging.to_read()).await?;
    Ok(Json(paging.page(found, |subject| subject.id)?.map(Subject::from)))
}

/// Get a subject
///
/// Height and mass are the corrected ones; `list_subject_corrections` has the earlier ones.
#[utoipa::path(
    get,
    path = "/subjects/{id}",
    operation_id = "get_subject",
    tag = "subjects",
    params(("id" = SubjectId, Path, description = "Identifier of the subject")),
    responses((status = 200, description = "Subject", body = Subject)),
    security(("token" = ["read"]), ("session" = ["read"])),
)]
pub(super) async fn get(
    _: Authorized<Read>,
    State(app): State<AppState>,
    Id(id, _): Id<SubjectId, Read>,
) -> Result<Json<Subject>, Refusal> {
    Ok(Json(subjects::get(&mut *app.read().await?, id).await?.into()))
}

/// Create a subject
///
/// A pseudonym belongs to one subject. `create_consent` then records the consent of the subject.
#[utoipa::path(
    post,
    path = "/subjects",
    operation_id = "create_subject",
    tag = "subjects",
    request_body = NewSubject,
    responses((status = 201, description = "Subject", body = Subject)),
    security(("token" = ["run"]), ("session" = ["run"])),
)]
pub(super) async fn create(
    State(app): State<AppState>,
    IdempotentWith(request, new): IdempotentWith<Run, NewSubject>,
) -> Result<Response, Refusal> {
    let mut writer = match request.begin(&app).await? {
        Ok(writer) => writer,
        Err(before) => return Ok(before),
    };
    let subject = subject::add(&mut writer, &request.actor, &new).await?;
    let location = format!("/api/v1/subjects/{}", subject.id);
    request.created(&app, writer, location, &Subject::from(subject)).await
}

/// List consents of a subject
///
/// Consents and withdrawals, oldest first. The last entry applies.
#[utoipa::path(
    get,
    path = "/subjects/{id}/consents",
    operation_id = "list_consents",
    tag = "subjects",
    params(("id" = SubjectId, Path, description = "Identifier of the subject")),
    responses((status = 200, description = "A page, oldest first", body = Page<Consent>)),
    security(("token" = ["read"]), ("session" = ["read"])),
)]
pub(super) async fn consents(
    _: Authorized<Read>,
    State(app): State<AppState>,
    Id(id, _): Id<SubjectId, Read>,
    paging: Paging<i64>,
) -> Result<Json<Page<Consent>>, Refusal> {
    let mut reader = app.read().await?;
    subjects::get(&mut reader, id).await?;
    let all = consents::of_subject(&mut reader, id).await?;
    Ok(Json(paging.cut(all, |consent| consent.seq)?.map(Consent::from)))
}

/// Create a consent
///
/// Records that the subject consented.
#[utoipa::path(
    post,
    path = "/subjects/{id}/consents",
    operation_id = "create_consent",
    tag = "subjects",
    params(("id" = SubjectId, Path, description = "Identifier of the subject")),
    request_body = NewConsent,
    responses((status = 201, description = "Consent", body = Consent)),
    security(("token" = ["run"]), ("session" = ["run"])),
)]
pub(super) async fn consent(
    State(app): State<AppState>,
    DespiteWithdrawal(id, _): DespiteWithdrawal<SubjectId, Run>,
    IdempotentWith(request, new): IdempotentWith<Run, NewConsent>,
) -> Result<Response, Refusal> {
    let mut writer = match request.begin(&app).await? {
        Ok(writer) => writer,
        Err(before) => return Ok(before),
    };
    let row = consent::give(&mut writer, &request.actor, id, &new).await?;
    request.created(&app, writer, format!("/api/v1/subjects/{id}/consents"), &Consent::from(row)).await
}

/// Withdraw consent
///
/// Stops every study of the subject. The subject's data are kept, but they can no longer be extended, shown or
/// exported.
#[utoipa::path(
    post,
    path = "/subjects/{id}/withdraw",
    operation_id = "withdraw_consent",
    tag = "subjects",
    params(("id" = SubjectId, Path, description = "Identifier of the subject")),
    request_body = ConsentWithdrawal,
    responses((status = 200, description = "Withdrawal", body = Consent)),
    security(("token" = ["run"]), ("session" = ["run"])),
)]
pub(super) async fn withdraw(
    State(app): State<AppState>,
    DespiteWithdrawal(id, _): DespiteWithdrawal<SubjectId, Run>,
    IdempotentWith(request, why): IdempotentWith<Run, ConsentWithdrawal>,
) -> Result<Response, Refusal> {
    let mut writer = match request.begin(&app).await? {
        Ok(writer) => writer,
        Err(before) => return Ok(before),
    };
    let (row, cancelled) = consent::withdraw(&mut writer, &request.actor, id, &why).await?;
    let answer = request.done(&app, writer, &Consent::from(row)).await?;
    for trial in cancelled {
        app.scheduler.cancel_solve(trial).await;
    }
    Ok(answer)
}

/// List corrections of a subject's height and mass
///
/// Corrections of height and mass, oldest first. The last entry applies.
#[utoipa::path(
    get,
    path = "/subjects/{id}/corrections",
    operation_id = "list_subject_corrections",
    tag = "subjects",
    params(("id" = SubjectId, Path, description = "Identifier of the subject")),
    responses((status = 200, description = "A page, oldest first", body = Page<Correction>), (status = 409, description = "The subject withdrew consent")),
    security(("token" = ["read"]), ("session" = ["read"])),
)]
pub(super) async fn corrections(
    _: Authorized<Read>,
    State(app): State<AppState>,
    Visible(id, _): Visible<SubjectId, Read>,
    paging: Paging<i64>,
) -> Result<Json<Page<Correction>>, Refusal> {
    let mut reader = app.read().await?;
    subjects::get(&mut reader, id).await?;
    let all = subjects::corrections(&mut reader, id).await?;
    Ok(Json(paging.cut(all, |correction| correction.seq)?.map(Correction::from)))
}

/// Create a correction of a subject's height and mass
///
/// Corrects height and mass. New studies use the corrected values. Existing studies keep theirs.
#[utoipa::path(
    post,
    path = "/subjects/{id}/corrections",
    operation_id = "create_subject_correction",
    tag = "subjects",
    params(("id" = SubjectId, Path, description = "Identifier of the subject")),
    request_body = NewCorrection,
    responses((status = 201, description = "Correction", body = Correction)),
    security(("token" = ["run"]), ("session" = ["run"])),
)]
pub(super) async fn correct(
    State(app): State<AppState>,
    Id(id, _): Id<SubjectId, Run>,
    IdempotentWith(request, new): IdempotentWith<Run, NewCorrection>,
) -> Result<Response, Refusal> {
    let mut writer = match request.begin(&app).await? {
        Ok(writer) => writer,
        Err(before) => return Ok(before),
    };
    let row = subject::correct(&mut writer, &request.actor, id, &new).await?;
    request.created(&app, writer, format!("/api/v1/subjects/{id}/corrections"), &Correction::from(row)).await
}

/// Get measured muscle values of a subject
///
/// Values that override the default muscle values.
#[utoipa::path(
    get,
    path = "/subjects/{id}/muscles",
    operation_id = "get_subject_muscles",
    tag = "subjects",
    params(("id" = SubjectId, Path, description = "Identifier of the subject")),
    responses((status = 200, description = "Measured values, in the format of `gait_settings.muscles` of a study", body = document_schemas::MuscleParameters), (status = 409, description = "The subject withdrew consent")),
    security(("token" = ["read"]), ("session" = ["read"])),
)]
pub(super) async fn muscles(
    _: Authorized<Read>,
    State(app): State<AppState>,
    Visible(id, _): Visible<SubjectId, Read>,
) -> Result<Json<MuscleParameters>, Refusal> {
    let mut reader = app.read().await?;
    subjects::get(&mut reader, id).await?;
    Ok(Json(subjects::muscles(&mut reader, id).await?))
}

/// Set measured muscle values of a subject
///
/// New studies use these values.
#[utoipa::path(
    put,
    path = "/subjects/{id}/muscles",
    operation_id = "set_subject_muscles",
    tag = "subjects",
    params(("id" = SubjectId, Path, description = "Identifier of the subject")),
    request_body(content = document_schemas::MuscleParameters, description = "Measured values, in the format of `gait_settings.muscles` of a study. An empty object means the default values"),
    responses((status = 200, description = "Muscle values", body = document_schemas::MuscleParameters)),
    security(("token" = ["run"]), ("session" = ["run"])),
)]
pub(super) async fn set_muscles(
    State(app): State<AppState>,
    Id(id, _): Id<SubjectId, Run>,
    IdempotentWith(request, muscles): IdempotentWith<Run, MuscleParameters>,
) -> Result<Response, Refusal> {
    let mut writer = match request.begin(&app).await? {
        Ok(writer) => writer,
        Err(before) => return Ok(before),
    };
    subject::set_muscles(&mut writer, &request.actor, id, &muscles).await?;
    request.done(&app, writer, &muscles).await
}
