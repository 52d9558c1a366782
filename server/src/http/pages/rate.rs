//! The pages of a rater: what is open, and one blind pair. Nothing here can name a trial.

use super::error::{Page, PageError, page};
use super::format::words;
use crate::access::{Rate, sign_in};
use crate::error::Error;
use crate::http::AppState;
use crate::http::extract::{Form, Id, Params};
use crate::http::may::May;
use crate::plots::gait_tiles;
use crate::store::presentations::{Presentation, Said};
use crate::store::studies::{FeedbackMode, StudyState};
use crate::store::{Connection, StudyId, commit, gaits, studies};
use crate::studies::blind::{self, RaterAnswer};
use askama::Template;
use axum::extract::{Path, State};
use axum::response::Redirect;
use gait_optimizer::Gait;
use gait_optimizer::walking::stick_figure::stick_figures;
use serde::Deserialize;

#[derive(Template)]
#[template(path = "rate.html")]
struct RatePage {
    studies: Vec<(StudyId, String)>,
    nothing: bool,
    saved: Option<Saved>,
    /// Whoever asks came by a link that works once, and has no other way in.
    no_password: bool,
}

/// An answer as read back from the record.
struct Saved {
    token: String,
    number: u32,
    words: String,
    at: String,
    can_be_taken_back: bool,
}

#[derive(Template)]
#[template(path = "rate_pair.html")]
struct PairPage {
    token: String,
    number: u32,
    answered: bool,
    /// Both strides as pictures, for those without scripts.
    pictures: Option<[String; 2]>,
}

/// What was done before this page.
#[derive(Debug, Deserialize)]
pub(super) struct Before {
    #[serde(default)]
    nothing: bool,
    /// The pair that was just answered.
    saved: Option<String>,
}

/// `GET /rate`: the studies that may ask for a comparison.
pub(super) async fn list(may: May<Rate>, State(app): State<AppState>, Params(before): Params<Before>) -> Page {
    let mut reader = app.read().await?;
    let saved = match before.saved {
        Some(token) => {
            let shown = blind::own(&mut reader, &may.caller, &token).await?;
            read_back(&mut reader, shown).await?
        }
        None => None,
    };
    let active = studies::active(&mut reader).await?;
    let studies = active
        .into_iter()
        .filter(|study| {
            study.plan.feedback_mode != FeedbackMode::Automatic
                && matches!(study.state, StudyState::Running | StudyState::Waiting)
        })
        // Names can say what is tuned: a rater sees the end of the identifier.
        .map(|study| (study.id, study.id.short()))
        .collect();
    let no_password = sign_in::has_no_password(&mut reader, &may.caller).await?;
    page(&RatePage { studies, nothing: before.nothing, saved, no_password })
}

async fn read_back(db: &mut Connection, shown: Presentation) -> Result<Option<Saved>, Error> {
    let can_be_taken_back = blind::can_be_taken_back(db, &shown).await?;
    Ok(shown.answer.zip(shown.answered_at).map(|(said, at)| Saved {
        words: words(said.as_str()),
        at: at.minute(),
        number: shown.number,
        token: shown.token,
        can_be_taken_back,
    }))
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
    let mut reader = app.read().await?;
    let shown = blind::own(&mut reader, &may.caller, &token).await?;
    let mut pair = Vec::new();
    for trial in [shown.shown_first, shown.shown_second] {
        // What is missing here is said by the animation, without a word that could tell which gait it was.
        pair.extend(gaits::get(&mut reader, trial).await.ok());
    }
    drop(reader);
    let pictures = tokio::task::spawn_blocking(move || {
        let tiles = |gait: &Gait| stick_figures(gait).ok().map(|figures| gait_tiles(&figures));
        match &pair[..] {
            [first, second] => tiles(first).zip(tiles(second)).map(|(first, second)| [first, second]),
            _ => None,
        }
    })
    .await
    .map_err(|e| Error::Internal(e.to_string()))?;
    page(&PairPage { token: shown.token, number: shown.number, answered: shown.answer.is_some(), pictures })
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
    // The same form sent twice, by a double click or after a lost answer, is one answer.
    let before = blind::own(&mut writer, &may.caller, &token).await?.answer;
    if before != Some(form.answer) {
        blind::answer(&mut writer, &may.caller, &token, &given).await?;
        commit(writer).await?;
        app.director.changed();
    }
    Ok(Redirect::to(&format!("/rate?saved={token}")))
}

/// `POST /rate/pair/{token}/take-back`.
pub(super) async fn take_back(
    may: May<Rate>,
    State(app): State<AppState>,
    Path(token): Path<String>,
) -> Result<Redirect, PageError> {
    let mut writer = app.write().await?;
    blind::take_back(&mut writer, &may.caller, &token).await?;
    commit(writer).await?;
    app.director.changed();
    Ok(Redirect::to(&format!("/rate?saved={token}")))
}
