//! Gaits that somebody called unsafe, and what staff decided who looked at them.

use crate::AppState;
use crate::may::May;
use crate::once::OnceWith;
use crate::paging::{Page, Paging};
use crate::problem::Refusal;
use crate::reached::Id;
use crate::shown::Shown;
use axum::Json;
use axum::extract::State;
use axum::response::Response;
use gaitwright_service::access::{self, Read};
use gaitwright_service::studies::safety_reports::{Closed, SafetyReports};
use gaitwright_service::studies::safety_review::{self, Decision};
use gaitwright_store::safety_reviews::{SafetyReview, SafetyVerdict};
use gaitwright_store::{Instant, StudyId, TrialId, studies};
use serde::Serialize;
use utoipa::ToSchema;

/// That somebody called a gait unsafe.
#[derive(Debug, Serialize, ToSchema)]
pub(super) struct SafetyReport {
    /// The trial whose gait it is.
    trial_id: TrialId,
    /// Who said so.
    by: String,
    /// When.
    at: Instant,
    /// Whether the gait must not be walked because of it.
    stands: bool,
    /// What staff decided who looked at it; none: it waits for that.
    review: Option<SafetyReview>,
}

impl From<Closed> for SafetyReport {
    fn from(closed: Closed) -> Self {
        let Closed { trial, by, at, review, .. } = closed;
        let stands = review.as_ref().is_none_or(|review| review.verdict == SafetyVerdict::Unsafe);
        Self { trial_id: trial, by, at, stands, review }
    }
}

/// `GET /studies/{id}/safety-reports`: every time that a gait was called unsafe, also what was lifted since.
///
/// By raters, in assessments and in lab sessions; what its author took back is left out. Before a lab session is unblinded,
/// both of its gaits are named.
#[utoipa::path(
    get,
    path = "/studies/{id}/safety-reports",
    operation_id = "list_safety_reports",
    tag = "preferences",
    params(("id" = StudyId, Path, description = "The study")),
    responses((status = 200, description = "Every time that a gait was called unsafe, by time", body = Page<SafetyReport>), (status = 409, description = "The subject withdrew consent")),
    security(("token" = ["read"]), ("session" = ["read"])),
)]
pub(super) async fn of_study(
    _: May<Read>,
    State(app): State<AppState>,
    Shown(id, _): Shown<StudyId, Read>,
    paging: Paging<(Instant, TrialId, String)>,
) -> Result<Json<Page<SafetyReport>>, Refusal> {
    let mut reader = app.read().await?;
    studies::get(&mut reader, id).await?;
    let SafetyReports { closed, lifted, .. } = SafetyReports::read(&mut reader, id).await?;
    let mut all: Vec<SafetyReport> = closed.into_iter().chain(lifted).map(Into::into).collect();
    let at = |report: &SafetyReport| (report.at, report.trial_id, report.by.clone());
    all.sort_by_key(at);
    Ok(Json(paging.cut(all, at)?))
}

/// `POST /trials/{id}/safety-reviews`: staff looked at a gait that was called unsafe, and decide.
///
/// Where it may be walked with again it can be recommended, asked about and planned; what was said stays in the record, and what
/// the learner heard of it is taken back. When a lab session is unblinded later, a safety report of that session closes its
/// gait again.
#[utoipa::path(
    post,
    path = "/trials/{id}/safety-reviews",
    operation_id = "create_safety_review",
    tag = "preferences",
    params(("id" = TrialId, Path, description = "The trial whose gait it is")),
    request_body = Decision,
    responses((status = 200, description = "Recorded", body = SafetyReview)),
    security(("token" = ["answer"]), ("session" = ["answer"])),
)]
pub(super) async fn review(
    State(app): State<AppState>,
    Id(id, _): Id<TrialId, access::Answer>,
    OnceWith(once, decision): OnceWith<access::Answer, Decision>,
) -> Result<Response, Refusal> {
    let mut writer = match once.begin(&app).await? {
        Ok(writer) => writer,
        Err(before) => return Ok(before),
    };
    let row = safety_review::give(&mut writer, &once.caller, id, &decision).await?;
    once.done(&app, writer, &row).await
}
