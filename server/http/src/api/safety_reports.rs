//! REST: safety reports and their reviews.

use crate::AppState;
use crate::accessible::Id;
use crate::authorization::Authorized;
use crate::idempotent::IdempotentWith;
use crate::paging::{Page, Paging};
use crate::problem_details::Refusal;
use crate::resources::safety_reviews::SafetyReview;
use crate::visible::Visible;
use axum::Json;
use axum::extract::State;
use axum::response::Response;
use gaitwright_service::access::{self, Read};
use gaitwright_service::error::Error;
use gaitwright_service::studies::new_safety_report::{self, NewSafetyReport};
use gaitwright_service::studies::reported_gait::ReportedGait;
use gaitwright_service::studies::safety_reports::SafetyReports;
use gaitwright_service::studies::safety_review::{self, Decision};
use gaitwright_store::safety_reviews::SafetyDecision;
use gaitwright_store::{Instant, SafetyReportId, StudyId, TrialId, studies, trials};
use serde::Serialize;
use utoipa::ToSchema;

/// Safety report about a gait.
#[derive(Debug, Serialize, ToSchema)]
pub(super) struct SafetyReport {
    /// Identifier of the report. A report from a blind pair, an assessment or a lab session has the identifier of that
    /// object, so reports about both of its gaits share one identifier.
    id: SafetyReportId,
    /// Trial of the gait.
    trial_id: TrialId,
    /// Author of the report.
    author: String,
    /// Time of the report.
    created_at: Instant,
    /// Text of the report. Empty for reports of raters and of subjects in blinded lab sessions, whose notes could tell which
    /// gait was shown first.
    note: String,
    /// Whether the report is in force: it awaits a review, or a review confirmed that the gait is unsafe. If so, the
    /// gait must not be used for walking.
    in_force: bool,
    /// Newest review. Null while the report awaits review.
    review: Option<SafetyReview>,
}

impl From<ReportedGait> for SafetyReport {
    fn from(report: ReportedGait) -> Self {
        let id = report.id();
        let ReportedGait { trial, by, at, note, review, source: _ } = report;
        let in_force = review.as_ref().is_none_or(|review| review.decision == SafetyDecision::Unsafe);
        Self { id, trial_id: trial, author: by, created_at: at, note, in_force, review: review.map(Into::into) }
    }
}

/// List safety reports of a study
///
/// Includes safety reports from raters, assessments and lab sessions, and reports about a single gait. A report stays
/// in the list after its gait is cleared for walking. A report from a blinded lab session
/// is listed for both of its gaits. Oldest first.
#[utoipa::path(
    get,
    path = "/studies/{id}/safety-reports",
    operation_id = "list_safety_reports",
    tag = "preferences",
    params(("id" = StudyId, Path, description = "Identifier of the study")),
    responses((status = 200, description = "Safety reports, oldest first", body = Page<SafetyReport>), (status = 409, description = "The subject withdrew consent")),
    security(("token" = ["read"]), ("session" = ["read"])),
)]
pub(super) async fn of_study(
    _: Authorized<Read>,
    State(app): State<AppState>,
    Visible(id, _): Visible<StudyId, Read>,
    paging: Paging<(Instant, TrialId, String)>,
) -> Result<Json<Page<SafetyReport>>, Refusal> {
    let mut reader = app.read().await?;
    studies::get(&mut reader, id).await?;
    let SafetyReports { in_force, cleared, .. } = SafetyReports::read(&mut reader, id).await?;
    let mut all: Vec<SafetyReport> = in_force.into_iter().chain(cleared).map(Into::into).collect();
    let at = |report: &SafetyReport| (report.created_at, report.trial_id, report.author.clone());
    all.sort_by_key(at);
    Ok(Json(paging.cut(all, at)?))
}

/// Create a safety report
///
/// Until staff have cleared the gait, neither the gait nor any other trial of the subject with the same motion is
/// recommended, compared or used for walking. The report does not reach the learner.
#[utoipa::path(
    post,
    path = "/trials/{id}/safety-reports",
    operation_id = "create_safety_report",
    tag = "preferences",
    params(("id" = TrialId, Path, description = "Identifier of the trial")),
    request_body = NewSafetyReport,
    responses((status = 201, description = "Report", body = SafetyReport)),
    security(("token" = ["answer"]), ("session" = ["answer"])),
)]
pub(super) async fn report(
    State(app): State<AppState>,
    Id(id, _): Id<TrialId, access::Answer>,
    IdempotentWith(request, report): IdempotentWith<access::Answer, NewSafetyReport>,
) -> Result<Response, Refusal> {
    let mut writer = match request.begin(&app).await? {
        Ok(writer) => writer,
        Err(before) => return Ok(before),
    };
    let made = new_safety_report::give(&mut writer, &request.caller, id, &report).await?;
    let study = trials::get(&mut writer, id).await?.study_id;
    let made = SafetyReports::read(&mut writer, study)
        .await?
        .in_force_about(id)
        .into_iter()
        .find(|report| report.id() == made);
    let made = made.ok_or_else(|| Error::Internal("a safety report did not take effect".to_owned()))?;
    let location = format!("/api/v1/studies/{study}/safety-reports");
    request.created(&app, writer, location, &SafetyReport::from(made)).await
}

/// Create a review of safety reports
///
/// If the gait is cleared, it can again be recommended, compared and used in lab sessions, and the preferences derived
/// from the reports are retracted. If a lab session with a report about the gait is unblinded later, that report makes
/// the gait unsafe again.
#[utoipa::path(
    post,
    path = "/trials/{id}/safety-reviews",
    operation_id = "create_safety_review",
    tag = "preferences",
    params(("id" = TrialId, Path, description = "Identifier of the trial")),
    request_body = Decision,
    responses((status = 201, description = "Review", body = SafetyReview)),
    security(("token" = ["answer"]), ("session" = ["answer"])),
)]
pub(super) async fn review(
    State(app): State<AppState>,
    Id(id, _): Id<TrialId, access::Answer>,
    IdempotentWith(request, decision): IdempotentWith<access::Answer, Decision>,
) -> Result<Response, Refusal> {
    let mut writer = match request.begin(&app).await? {
        Ok(writer) => writer,
        Err(before) => return Ok(before),
    };
    let row = safety_review::give(&mut writer, &request.caller, id, &decision).await?;
    let study = trials::get(&mut writer, id).await?.study_id;
    let location = format!("/api/v1/studies/{study}/safety-reports");
    request.created(&app, writer, location, &SafetyReview::from(row)).await
}
