//! REST: blind comparisons for raters, reliability of raters, and unblinding.

use crate::AppState;
use crate::accessible::Id;
use crate::authorization::Authorized;
use crate::blind_motion::{BlindStickFigure, blind_motion, phase};
use crate::idempotent::{Idempotent, IdempotentWith};
use crate::paging::{Page, Paging};
use crate::problem_details::Refusal;
use crate::visible::Visible;
use axum::Json;
use axum::extract::{Path, State};
use axum::response::Response;
use gaitwright_service::access::{Administer, Rate, Read};
use gaitwright_service::error::Error;
use gaitwright_service::studies::blind::{
    self, AnswerReceipt, HandedOut, RaterAnswer, RaterReliability, UnblindedPair,
};
use gaitwright_store::allocations::PairWithSides;
use gaitwright_store::{BlindPairId, StudyId, gaits, studies};
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// Pair to compare, as shown to a rater.
#[derive(Debug, Serialize, ToSchema)]
pub(super) struct BlindPair {
    /// Code of the pair.
    code: String,
    /// Number of the pair for this rater.
    number: u32,
    /// URL of the motion that is shown first.
    first: String,
    /// URL of the motion that is shown second.
    second: String,
}

/// Next pair for a rater.
#[derive(Debug, Serialize, ToSchema)]
pub(super) struct NextBlindPair {
    /// The pair. Null if no comparison is pending.
    pair: Option<BlindPair>,
}

/// Draw the next pair for a rater
///
/// Returns the same pair until it is answered.
#[utoipa::path(
    post,
    path = "/studies/{id}/blind-pairs/next",
    operation_id = "draw_blind_pair",
    tag = "blind",
    params(("id" = StudyId, Path, description = "Identifier of the study")),
    responses((status = 200, description = "Pair that was drawn earlier, or null if no comparison is pending", body = NextBlindPair), (status = 201, description = "New pair. `Location` points to its first motion", body = NextBlindPair)),
    security(("token" = ["rate"]), ("session" = ["rate"])),
)]
pub(super) async fn next(
    State(mut app): State<AppState>,
    Id(id, _): Id<StudyId, Rate>,
    request: Idempotent<Rate>,
) -> Result<Response, Refusal> {
    if let Some(before) = request.earlier_response(&app).await? {
        return Ok(before);
    }
    let answering = app.clone();
    let (writer, next) = blind::next(app.store_mut(), &request.caller, id).await?;
    let Some(HandedOut { shown: PairWithSides { pair, .. }, is_new }) = next else {
        return request.done(&answering, writer, &NextBlindPair { pair: None }).await;
    };
    let motion = |side: &str| format!("/api/v1/blind-pairs/{}/motions/{side}", pair.code);
    let (first, second) = (motion("first"), motion("second"));
    let pair = BlindPair { first: first.clone(), second, code: pair.code, number: pair.number };
    let next = NextBlindPair { pair: Some(pair) };
    if is_new {
        request.created(&answering, writer, first, &next).await
    } else {
        request.done(&answering, writer, &next).await
    }
}

/// Motion to compare.
#[derive(Debug, Serialize, ToSchema)]
pub(super) struct BlindMotion {
    /// 101 stick figures over one stride. Each has ten points (hip, shoulder, then knee, ankle, heel and toe of the left
    /// and of the right leg) as forward and upward coordinates, m.
    #[schema(value_type = Vec<Vec<Vec<f64>>>)]
    stick_figures: Vec<BlindStickFigure>,
}

/// Motion of a pair.
#[derive(Debug, Clone, Copy, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub(super) enum PairSide {
    First,
    Second,
}

/// Get a motion of a blind pair
///
/// The phase at which motions start differs between pairs, and is the same for both motions of a pair.
#[utoipa::path(
    get,
    path = "/blind-pairs/{code}/motions/{side}",
    operation_id = "get_blind_motion",
    tag = "blind",
    params(
        ("code" = String, Path, description = "Code of the pair"),
        ("side" = inline(PairSide), Path, description = "Which motion of the pair")
    ),
    responses((status = 200, description = "Motion", body = BlindMotion), (status = 409, description = "The subject withdrew consent")),
    security(("token" = ["rate"]), ("session" = ["rate"])),
)]
pub(super) async fn motion(
    authorized: Authorized<Rate>,
    State(mut app): State<AppState>,
    Path((code, side)): Path<(String, PairSide)>,
) -> Result<Json<BlindMotion>, Refusal> {
    let mut reader = app.read().await?;
    let shown = blind::own_showable_pair(&mut reader, &authorized.caller, &code).await?;
    let (first, second) = shown.shown();
    let trial = match side {
        PairSide::First => first,
        PairSide::Second => second,
    };
    let gait = gaits::get(&mut reader, trial).await;
    drop(reader);
    let phase = phase(&code);
    let motion = match gait {
        Ok(gait) => app.compute(move |pool| blind_motion(&gait.unpack(pool)?, phase)).await.map_err(Error::from),
        Err(error) => Err(error.into()),
    };
    let motion = motion.flatten();
    // The error must not reveal the trial, the subject or the device.
    motion.map(|stick_figures| Json(BlindMotion { stick_figures })).map_err(|error| {
        tracing::error!(%error, "cannot show a gait to a rater");
        Refusal(Error::NotFound { what: "motion of the blind pair".to_owned(), id: "with this code".to_owned() })
    })
}

/// Answer a blind pair
///
/// The first answer to a pair counts. A safety report takes effect at once.
#[utoipa::path(
    post,
    path = "/blind-pairs/{code}/answer",
    operation_id = "answer_blind_pair",
    tag = "blind",
    params(("code" = String, Path, description = "Code of the pair")),
    request_body = RaterAnswer,
    responses((status = 200, description = "Confirmation", body = AnswerReceipt)),
    security(("token" = ["rate"]), ("session" = ["rate"])),
)]
pub(super) async fn answer(
    State(app): State<AppState>,
    Path(code): Path<String>,
    IdempotentWith(request, given): IdempotentWith<Rate, RaterAnswer>,
) -> Result<Response, Refusal> {
    let mut writer = match request.begin(&app).await? {
        Ok(writer) => writer,
        Err(before) => return Ok(before),
    };
    let (_, answered) = blind::answer(&mut writer, &request.caller, &code, &given).await?;
    request.done(&app, writer, &answered).await
}

/// List raters with their reliability
///
/// Agreement of raters with their own earlier answers, position bias of unblinded raters, and the number of answers
/// that are not blind. Sorted by name.
#[utoipa::path(
    get,
    path = "/studies/{id}/raters",
    operation_id = "list_raters",
    tag = "blind",
    params(("id" = StudyId, Path, description = "Identifier of the study")),
    responses((status = 200, description = "One row for each rater", body = Page<RaterReliability>), (status = 409, description = "The subject withdrew consent")),
    security(("token" = ["read"]), ("session" = ["read"])),
)]
pub(super) async fn raters(
    _: Authorized<Read>,
    State(app): State<AppState>,
    Visible(id, _): Visible<StudyId, Read>,
    paging: Paging<String>,
) -> Result<Json<Page<RaterReliability>>, Refusal> {
    let mut reader = app.read().await?;
    studies::get(&mut reader, id).await?;
    Ok(Json(paging.cut(blind::reliability(&mut reader, id).await?, |row| row.rater.clone())?))
}

/// Rater to unblind, with the reason.
#[derive(Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct RaterUnblinding {
    /// Name of the rater.
    rater: String,
    /// Reason, 1 to 2000 characters.
    #[schema(min_length = 1, max_length = 2000)]
    reason: String,
}

/// Unblinded rater.
#[derive(Debug, Serialize, ToSchema)]
pub(super) struct UnblindedRater {
    /// Identifier of the study.
    study_id: StudyId,
    /// Name of the rater.
    rater: String,
}

/// Unblind a rater
///
/// Reveals which gait the rater saw on which side: `GET /studies/{id}/unblinded-pairs` lists it from now on. The audit
/// trail records the unblinding, and later answers of the rater do not count as blind.
#[utoipa::path(
    post,
    path = "/studies/{id}/raters/unblind",
    operation_id = "unblind_rater",
    tag = "blind",
    params(("id" = StudyId, Path, description = "Identifier of the study")),
    request_body = RaterUnblinding,
    responses((status = 200, description = "Unblinded rater", body = UnblindedRater)),
    security(("token" = ["administer"]), ("session" = ["administer"])),
)]
pub(super) async fn unblind(
    State(app): State<AppState>,
    Id(id, _): Id<StudyId, Administer>,
    IdempotentWith(request, whose): IdempotentWith<Administer, RaterUnblinding>,
) -> Result<Response, Refusal> {
    let mut writer = match request.begin(&app).await? {
        Ok(writer) => writer,
        Err(before) => return Ok(before),
    };
    blind::unblind(&mut writer, &request.caller, id, &whose.rater, &whose.reason).await?;
    request.done(&app, writer, &UnblindedRater { study_id: id, rater: whose.rater }).await
}

/// Whose pairs a list has.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct PairFilter {
    rater: Option<String>,
}

/// List the pairs of unblinded raters
///
/// Which gait an unblinded rater saw on which side, and the answer. Oldest first.
#[utoipa::path(
    get,
    path = "/studies/{id}/unblinded-pairs",
    operation_id = "list_unblinded_pairs",
    tag = "blind",
    params(("id" = StudyId, Path, description = "Identifier of the study"), ("rater" = Option<String>, Query, description = "Only the pairs of this rater. Default: those of all unblinded raters")),
    responses((status = 200, description = "A page, oldest first", body = Page<UnblindedPair>), (status = 409, description = "The subject withdrew consent")),
    security(("token" = ["administer"]), ("session" = ["administer"])),
)]
pub(super) async fn unblinded_pairs(
    _: Authorized<Administer>,
    State(app): State<AppState>,
    Visible(id, _): Visible<StudyId, Administer>,
    paging: Paging<BlindPairId, PairFilter>,
) -> Result<Json<Page<UnblindedPair>>, Refusal> {
    let mut reader = app.read().await?;
    let rater = paging.filter.rater.as_deref();
    let pairs = blind::unblinded_pairs(&mut reader, id, rater, paging.after, paging.to_read()).await?;
    Ok(Json(paging.page(pairs, |pair| pair.id)?))
}
