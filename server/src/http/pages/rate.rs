//! The pages of a rater: what is open, and one blind pair. Nothing here can name a trial.

use super::error::{Page, PageError, page};
use crate::access::Rate;
use crate::http::AppState;
use crate::http::extract::{Form, Id, Params};
use crate::http::may::May;
use crate::store::presentations::Said;
use crate::store::studies::{FeedbackMode, StudyState};
use crate::store::{StudyId, commit, studies};
use crate::studies::blind::{self, RaterAnswer};
use askama::Template;
use axum::extract::{Path, State};
use axum::response::Redirect;
use serde::Deserialize;

#[derive(Template)]
#[template(path = "rate.html")]
struct RatePage {
    studies: Vec<(StudyId, String)>,
    nothing: bool,
    saved: Option<u32>,
    others: bool,
}

#[derive(Template)]
#[template(path = "rate_pair.html")]
struct PairPage {
    token: String,
    number: u32,
    answered: bool,
}

/// What was done before this page.
#[derive(Debug, Deserialize)]
pub(super) struct Before {
    #[serde(default)]
    nothing: bool,
    saved: Option<u32>,
    #[serde(default)]
    others: bool,
}

/// `GET /rate`: the studies that may ask for a comparison.
pub(super) async fn list(_: May<Rate>, State(app): State<AppState>, Params(before): Params<Before>) -> Page {
    let active = studies::active(&mut *app.read().await?).await?;
    let studies = active
        .into_iter()
        .filter(|study| {
            study.plan.feedback_mode != FeedbackMode::Automatic
                && matches!(study.state, StudyState::Running | StudyState::Waiting)
        })
        // Names can say what is tuned: a rater sees the end of the identifier.
        .map(|study| (study.id, study.id.short()))
        .collect();
    page(&RatePage { studies, nothing: before.nothing, saved: before.saved, others: before.others })
}

/// `POST /rate/{id}`: takes the next pair.
pub(super) async fn next(
    may: May<Rate>,
    State(app): State<AppState>,
    Id(id): Id<StudyId>,
) -> Result<Redirect, PageError> {
    let (writer, shown) = blind::next(&mut *app.read().await?, app.store(), &may.caller, id).await?;
    commit(writer).await?;
    Ok(match shown {
        Some(shown) => Redirect::to(&format!("/rate/pair/{}", shown.token)),
        None => Redirect::to("/rate?nothing=true"),
    })
}

/// `GET /rate/pair/{token}`.
pub(super) async fn pair(may: May<Rate>, State(app): State<AppState>, Path(token): Path<String>) -> Page {
    let shown = blind::own(&mut *app.read().await?, &may.caller, &token).await?;
    page(&PairPage { token: shown.token, number: shown.number, answered: shown.answer.is_some() })
}

/// The form of a pair.
#[derive(Debug, Deserialize)]
pub(super) struct Submitted {
    answer: Said,
    #[serde(default)]
    note: String,
    #[serde(default)]
    response_ms: String,
}

/// `POST /rate/pair/{token}`.
pub(super) async fn answer(
    may: May<Rate>,
    State(app): State<AppState>,
    Path(token): Path<String>,
    Form(form): Form<Submitted>,
) -> Result<Redirect, PageError> {
    let given = RaterAnswer { answer: form.answer, response_ms: form.response_ms.trim().parse().ok(), note: form.note };
    let mut writer = app.write().await?;
    let (_, answered) = blind::answer(&mut writer, &may.caller, &token, &given).await?;
    commit(writer).await?;
    app.director.changed();
    let others = if answered.answered_by_others { "&others=true" } else { "" };
    Ok(Redirect::to(&format!("/rate?saved={}{others}", answered.number)))
}
