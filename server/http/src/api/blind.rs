//! Blind comparisons: what a rater may see, and what is known of raters.

use crate::AppState;
use crate::blind_motion::{Figure, blind_motion, phase};
use crate::may::May;
use crate::once::{Once, OnceWith};
use crate::problem::Refusal;
use crate::reached::Id;
use crate::shown::Shown;
use axum::Json;
use axum::extract::{Path, State};
use axum::http::StatusCode;
use axum::response::Response;
use gaitwright_service::access::{Administer, Rate, Read};
use gaitwright_service::error::Error;
use gaitwright_service::studies::blind::{self, Answered, RaterAnswer, RaterFigures, UnblindedPair};
use gaitwright_store::{StudyId, TrialId, allocations, gaits, presentations, studies};
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// A pair to compare, as a rater sees it.
#[derive(Debug, Serialize, ToSchema)]
pub(super) struct Pair {
    /// What the pair is known by.
    token: String,
    /// Number of the pair for this rater.
    number: u32,
    /// Where the motion that is shown first is.
    first: String,
    /// Where the motion that is shown second is.
    second: String,
}

/// The next pair, or none.
#[derive(Debug, Serialize, ToSchema)]
pub(super) struct NextPair {
    /// None: the study asks for nothing now.
    pair: Option<Pair>,
}

/// `POST /studies/{id}/blind/next`: the pair that this rater should compare. Asking again before answering gives the
/// same one.
#[utoipa::path(
    post,
    path = "/studies/{id}/blind/next",
    operation_id = "draw_blind_pair",
    tag = "blind",
    params(("id" = StudyId, Path, description = "The study")),
    responses((status = 200, description = "The pair, or none", body = NextPair)),
    security(("token" = ["rate"]), ("session" = ["rate"])),
)]
pub(super) async fn next(
    State(mut app): State<AppState>,
    Id(id, _): Id<StudyId, Rate>,
    once: Once<Rate>,
) -> Result<Response, Refusal> {
    if let Some(before) = once.answered_before(&app).await? {
        return Ok(before);
    }
    let answering = app.clone();
    let (writer, shown) = blind::next(app.store_mut(), &once.caller, id).await?;
    let pair = shown.map(|shown| Pair {
        first: format!("/api/v1/blind/{}/first", shown.presentation.token),
        second: format!("/api/v1/blind/{}/second", shown.presentation.token),
        token: shown.presentation.token,
        number: shown.presentation.number,
    });
    once.finish(&answering, writer, StatusCode::OK, None, &NextPair { pair }).await
}

/// `GET /blind/{token}/first`: 101 figures over one stride, each ten places: hip, shoulder, then knee, ankle, heel, toe
/// of the left and of the right leg; forward and up, m. Where in the stride they begin differs from pair to pair, and is the
/// same for both motions of a pair.
#[utoipa::path(
    get,
    path = "/blind/{token}/first",
    operation_id = "get_first_blind_motion",
    tag = "blind",
    params(("token" = String, Path, description = "The pair")),
    responses((status = 200, description = "The motion", body = Vec<Vec<Vec<f64>>>)),
    security(("token" = ["rate"]), ("session" = ["rate"])),
)]
pub(super) async fn first(
    may: May<Rate>,
    State(mut app): State<AppState>,
    Path(token): Path<String>,
) -> Result<Json<Vec<Figure>>, Refusal> {
    motion(&mut app, &may, &token, |(first, _)| first).await
}

/// `GET /blind/{token}/second`: as the first one.
#[utoipa::path(
    get,
    path = "/blind/{token}/second",
    operation_id = "get_second_blind_motion",
    tag = "blind",
    params(("token" = String, Path, description = "The pair")),
    responses((status = 200, description = "The motion", body = Vec<Vec<Vec<f64>>>)),
    security(("token" = ["rate"]), ("session" = ["rate"])),
)]
pub(super) async fn second(
    may: May<Rate>,
    State(mut app): State<AppState>,
    Path(token): Path<String>,
) -> Result<Json<Vec<Figure>>, Refusal> {
    motion(&mut app, &may, &token, |(_, second)| second).await
}

async fn motion(
    app: &mut AppState,
    may: &May<Rate>,
    token: &str,
    side: impl Fn((TrialId, TrialId)) -> TrialId,
) -> Result<Json<Vec<Figure>>, Refusal> {
    let mut reader = app.read().await?;
    let shown = blind::own(&mut reader, &may.caller, token).await?;
    let gait = gaits::get(&mut reader, side(shown.shown())).await;
    drop(reader);
    let phase = phase(token);
    let motion = match gait {
        Ok(gait) => app.compute(move |pool| blind_motion(&gait.unpack(pool)?, phase)).await.map_err(Error::from),
        Err(error) => Err(error.into()),
    };
    let motion = motion.flatten();
    // An error here must not say which trial it was, nor of which person or device.
    motion
        .map(Json)
        .map_err(|error| {
            tracing::error!(%error, "a gait cannot be shown to a rater");
            Error::NotFound { what: "the motion of the comparison".to_owned(), id: "with this token".to_owned() }
        })
        .map_err(Refusal)
}

/// `POST /blind/{token}/answer`.
#[utoipa::path(
    post,
    path = "/blind/{token}/answer",
    operation_id = "answer_blind_pair",
    tag = "blind",
    params(("token" = String, Path, description = "The pair")),
    request_body = RaterAnswer,
    responses((status = 201, description = "Recorded", body = Answered)),
    security(("token" = ["rate"]), ("session" = ["rate"])),
)]
pub(super) async fn answer(
    State(app): State<AppState>,
    Path(token): Path<String>,
    OnceWith(once, given): OnceWith<Rate, RaterAnswer>,
) -> Result<Response, Refusal> {
    let mut writer = match once.begin(&app).await? {
        Ok(writer) => writer,
        Err(before) => return Ok(before),
    };
    let (_, answered) = blind::answer(&mut writer, &once.caller, &token, &given).await?;
    once.finish(&app, writer, StatusCode::CREATED, None, &answered).await
}

/// `GET /studies/{id}/raters`: agreement with themselves, position bias of those who were unblinded, answers that were
/// not blind.
#[utoipa::path(
    get,
    path = "/studies/{id}/raters",
    operation_id = "get_rater_agreement",
    tag = "blind",
    params(("id" = StudyId, Path, description = "The study")),
    responses((status = 200, description = "One row per rater", body = Vec<RaterFigures>)),
    security(("token" = ["read"]), ("session" = ["read"])),
)]
pub(super) async fn raters(
    _: May<Read>,
    State(app): State<AppState>,
    Shown(id, _): Shown<StudyId, Read>,
) -> Result<Json<Vec<RaterFigures>>, Refusal> {
    let mut reader = app.read().await?;
    studies::get(&mut reader, id).await?;
    let shown = presentations::of_study(&mut reader, id).await?;
    let sides = allocations::of_unblinded_raters(&mut reader, id).await?;
    Ok(Json(blind::figures(&shown, &sides)))
}

/// Who is unblinded, and why.
#[derive(Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct Unblind {
    /// The rater.
    rater: String,
    /// Why: 1 to 2000 characters.
    #[schema(min_length = 1, max_length = 2000)]
    reason: String,
}

/// `POST /studies/{id}/unblind`: shows which gait a rater saw on which side. It is in the audit trail, and what the rater is
/// shown from now on is marked.
#[utoipa::path(
    post,
    path = "/studies/{id}/unblind",
    operation_id = "unblind_rater",
    tag = "blind",
    params(("id" = StudyId, Path, description = "The study")),
    request_body = Unblind,
    responses((status = 200, description = "Every pair of the rater, in order", body = Vec<UnblindedPair>)),
    security(("token" = ["administer"]), ("session" = ["administer"])),
)]
pub(super) async fn unblind(
    State(app): State<AppState>,
    Id(id, _): Id<StudyId, Administer>,
    OnceWith(once, whose): OnceWith<Administer, Unblind>,
) -> Result<Response, Refusal> {
    let mut writer = match once.begin(&app).await? {
        Ok(writer) => writer,
        Err(before) => return Ok(before),
    };
    let shown = blind::unblind(&mut writer, &once.caller, id, &whose.rater, &whose.reason).await?;
    once.finish(&app, writer, StatusCode::OK, None, &shown).await
}
