//! The pages of a rater: the studies, and one blinded pair. They never name a trial.

use super::undo::undo_seconds;
use crate::AppState;
use crate::accessible::Id;
use crate::authorization::Authorized;
use crate::blind_motion::{blind_stride, phase};
use crate::extractors::{Form, Params};
use crate::page_error::{PageError, PageResult, page};
use crate::refused_fields::{FieldLabels, RefusedFields};
use askama::Template;
use axum::extract::{Path, State};
use axum::response::{IntoResponse, Redirect, Response};
use gait_optimizer::Gait;
use gait_optimizer::gait::stick_figure::StickFigure;
use gaitwright_charts::stride_pictures;
use gaitwright_service::access::{Caller, Rate, sign_in};
use gaitwright_service::error::Error;
use gaitwright_service::studies::blind::{self, RaterAnswer};
use gaitwright_store::allocations::PairWithSides;
use gaitwright_store::blind_pairs::{self, BlindPair, OrderedAnswer};
use gaitwright_store::studies::{AnswerSource, StudyFilter};
use gaitwright_store::{Connection, Instant, Packed, StudyId, accessible_studies, commit, consents, gaits, studies};
use serde::Deserialize;

/// In how many of the newest studies a rater's newest answer is searched.
const SEARCHED: u32 = 200;

#[derive(Template)]
#[template(path = "rate.html")]
struct RatePage {
    studies: Vec<(StudyId, String)>,
    /// The study whose next pair appears automatically.
    next: Option<StudyId>,
    /// Whether the caller can see any study.
    assigned: bool,
    nothing: bool,
    /// Whether a safety report about an answered pair was just given.
    reported: bool,
    /// The answer just given, or else the newest one that can be retracted.
    saved: Option<SavedBlindAnswer>,
    /// Seconds that are left to undo the answer just given.
    undo: Option<f64>,
    /// Whether the caller may read the study, and so could know which gait is which.
    not_blind: bool,
    /// The caller signed in with a one-time link, and has no password.
    no_password: bool,
    /// Whether the caller signed in, and so can sign out.
    signed_in: bool,
}

impl RatePage {
    fn is_next(&self, study: &StudyId) -> bool {
        self.next.as_ref() == Some(study)
    }

    /// Seconds until the next pair appears automatically, after the time to undo an answer.
    fn pause(&self) -> u32 {
        match (self.nothing, self.undo) {
            (true, _) => POLL_INTERVAL_S,
            (false, Some(_)) => 0,
            (false, None) => CONFIRMATION_S,
        }
    }
}

/// Time between two requests for the next pair while there is none, s.
const POLL_INTERVAL_S: u32 = 1;
/// Time to read a confirmation that cannot be undone, s.
const CONFIRMATION_S: u32 = 2;

/// An answer, read from the record.
struct SavedBlindAnswer {
    study: StudyId,
    code: String,
    number: u32,
    answer: OrderedAnswer,
    at: Instant,
    can_be_retracted: bool,
}

impl SavedBlindAnswer {
    /// Whether it was retracted.
    fn is_retracted(&self) -> bool {
        self.answer == OrderedAnswer::Retracted
    }

    fn words(&self) -> &'static str {
        blind::sides_in_words(self.answer)
    }
}

#[derive(Template)]
#[template(path = "rate_pair.html")]
struct PairPage {
    code: String,
    number: u32,
    /// Whether the caller may read the study, and so could know which gait is which.
    not_blind: bool,
    /// The answer, if there is one.
    saved: Option<SavedBlindAnswer>,
    /// Why the form was refused.
    refused: RefusedFields,
    /// Both strides; `None` if they cannot be drawn.
    strides: Option<[ShownStride; 2]>,
}

impl PairPage {
    /// Duration of the stride of a side, s; empty if unknown.
    fn seconds(&self, side: usize) -> &str {
        self.strides.as_ref().and_then(|strides| strides.get(side)).map_or("", |stride| stride.seconds.as_str())
    }
}

/// One of the two gaits.
struct ShownStride {
    /// Duration of the stride, s, rounded to 0.01 s, because more digits would identify the gait.
    seconds: String,
    /// The stride as pictures, for readers without scripts.
    picture: String,
}

impl ShownStride {
    fn of(figures: &[StickFigure]) -> Option<Self> {
        let seconds = figures.last()?.time_s - figures.first()?.time_s;
        Some(Self { seconds: format!("{seconds:.2}"), picture: stride_pictures(figures) })
    }
}

/// The action that led to this page.
#[derive(Debug, Deserialize)]
pub(super) struct PrecedingAction {
    #[serde(default)]
    nothing: bool,
    /// The study that had no next pair.
    study: Option<StudyId>,
    /// The pair that was just answered.
    saved: Option<String>,
    #[serde(default)]
    reported: bool,
}

/// `GET /rate`: the studies that may ask for a comparison.
pub(super) async fn list(
    authorized: Authorized<Rate>,
    State(app): State<AppState>,
    Params(before): Params<PrecedingAction>,
) -> PageResult {
    let mut reader = app.read().await?;
    let is_answer = before.saved.is_some();
    let saved = match before.saved {
        Some(code) => {
            let shown = blind::own(&mut reader, &authorized.caller, &code).await?;
            read_back(&mut reader, shown).await?
        }
        None => newest(&mut reader, &authorized.caller).await?,
    };
    let reach = authorized.caller.reach();
    let studies: Vec<_> = studies::awaiting_raters(&mut reader, reach)
        .await?
        .into_iter()
        // Names of studies can reveal what is tuned, so raters see the end of the identifier.
        .map(|study| (study.id, study.id.short()))
        .collect();
    // After an answer, and while there is no next pair, the page continues with the same study.
    let answered = saved.as_ref().filter(|_| is_answer);
    let undo = answered.and_then(|saved| undo_seconds(saved.at));
    let next = before.study.or(answered.filter(|_| undo.is_some()).map(|saved| saved.study));
    let undo = undo.filter(|_| answered.is_some_and(|saved| saved.can_be_retracted));
    let next = next.filter(|next| studies.iter().any(|(study, _)| study == next));
    let no_password = sign_in::has_no_password(&mut reader, &authorized.caller).await?;
    let assigned = accessible_studies::reaches_any(&mut reader, reach).await?;
    let not_blind = blind::is_never_blind(&mut reader, &authorized.caller).await?;
    page(&RatePage {
        studies,
        next,
        assigned,
        nothing: before.nothing,
        reported: before.reported,
        undo,
        saved,
        not_blind,
        no_password,
        signed_in: authorized.caller.user.is_some(),
    })
}

/// A rater's newest answer, if it can be retracted.
async fn newest(db: &mut Connection, caller: &Caller) -> Result<Option<SavedBlindAnswer>, Error> {
    let mut newest: Option<BlindPair> = None;
    for study in studies::page(db, caller.reach(), &StudyFilter::newest(SEARCHED)).await? {
        if study.plan.answer_source == AnswerSource::GaitRmse || consents::is_withdrawn(db, study.id).await? {
            continue;
        }
        let own = blind_pairs::of_study(db, study.id).await?.into_iter().filter(|shown| shown.rater == caller.name);
        newest = newest.into_iter().chain(own).max_by_key(|shown| shown.answered_at);
    }
    let Some(shown) = newest else { return Ok(None) };
    let shown = match blind::own(db, caller, &shown.code).await {
        // The record does not have the sides of an imported pair.
        Err(Error::NotFound { .. }) => return Ok(None),
        shown => shown?,
    };
    Ok(read_back(db, shown).await?.filter(|saved| saved.can_be_retracted))
}

async fn read_back(db: &mut Connection, shown: PairWithSides) -> Result<Option<SavedBlindAnswer>, Error> {
    let can_be_retracted = blind::can_be_retracted(db, &shown.pair).await?;
    Ok(shown.answer().zip(shown.pair.answered_at).map(|(answer, at)| SavedBlindAnswer {
        study: shown.pair.study_id,
        answer,
        at,
        number: shown.pair.number,
        code: shown.pair.code,
        can_be_retracted,
    }))
}

/// `POST /rate/{id}`: takes the next pair.
pub(super) async fn next(
    authorized: Authorized<Rate>,
    State(mut app): State<AppState>,
    Id(id, _): Id<StudyId, Rate>,
) -> Result<Redirect, PageError> {
    let (writer, next) = blind::next(app.store_mut(), &authorized.caller, id).await?;
    commit(writer).await?;
    Ok(match next {
        Some(next) => Redirect::to(&format!("/rate/pair/{}", next.shown.pair.code)),
        None => Redirect::to(&format!("/rate?nothing=true&study={id}")),
    })
}

/// `GET /rate/pair/{code}`.
pub(super) async fn pair(
    authorized: Authorized<Rate>,
    State(mut app): State<AppState>,
    Path(code): Path<String>,
) -> PageResult {
    show(&mut app, &authorized.caller, &code, RefusedFields::default()).await
}

async fn show(app: &mut AppState, caller: &Caller, code: &str, refused: RefusedFields) -> PageResult {
    let mut reader = app.read().await?;
    let shown = blind::own(&mut reader, caller, code).await?;
    let (code, number) = (shown.pair.code.clone(), shown.pair.number);
    let not_blind =
        shown.pair.could_have_known || blind::could_have_known(&mut reader, caller, shown.pair.study_id).await?;
    if shown.pair.answer.is_some() {
        let saved = read_back(&mut reader, shown).await?;
        return page(&PairPage { code, number, not_blind, saved, refused, strides: None });
    }
    blind::own_showable_pair(&mut reader, caller, &code).await?;
    let mut pair = Vec::new();
    let (first, second) = shown.shown();
    for trial in [first, second] {
        // Without pictures the animation reports the problem, without naming the gait.
        pair.extend(gaits::get(&mut reader, trial).await.ok());
    }
    drop(reader);
    let phase = phase(&code);
    let strides = app.compute(move |pool| {
        let stride = |gait: &Packed<Gait>| {
            let figures = blind_stride(&gait.unpack(pool).ok()?, phase).ok()?;
            ShownStride::of(&figures)
        };
        match &pair[..] {
            [first, second] => stride(first).zip(stride(second)).map(|(first, second)| [first, second]),
            _ => None,
        }
    });
    let strides = strides.await.map_err(Error::from)?;
    page(&PairPage { code, number, not_blind, saved: None, refused, strides })
}

/// The fields of the form of a pair.
const FIELDS: FieldLabels = &[("note", "Note")];

/// The form of a pair.
#[derive(Debug, Deserialize)]
pub(super) struct PairForm {
    answer: OrderedAnswer,
    #[serde(default)]
    note: String,
    #[serde(default)]
    response_ms: String,
}

/// `POST /rate/pair/{code}`.
pub(super) async fn answer(
    authorized: Authorized<Rate>,
    State(mut app): State<AppState>,
    Path(code): Path<String>,
    Form(form): Form<PairForm>,
) -> Result<Response, PageError> {
    let given = RaterAnswer { answer: form.answer, response_ms: form.response_ms.trim().parse().ok(), note: form.note };
    let answered = async {
        let mut writer = app.write().await?;
        // A form that is sent twice (double click, lost response) counts as one answer.
        let before = blind::own(&mut writer, &authorized.caller, &code).await?.answer();
        if before != Some(given.answer) || given.answer.is_about_safety() {
            blind::answer(&mut writer, &authorized.caller, &code, &given).await?;
            commit(writer).await?;
            app.scheduler.changed();
        }
        Ok(before.is_some() && given.answer.is_about_safety())
    };
    let answered = answered.await;
    redirected(&mut app, &authorized.caller, &code, answered).await
}

/// `POST /rate/pair/{code}/retract`.
pub(super) async fn retract(
    authorized: Authorized<Rate>,
    State(mut app): State<AppState>,
    Path(code): Path<String>,
) -> Result<Response, PageError> {
    let retracted = async {
        let mut writer = app.write().await?;
        blind::retract(&mut writer, &authorized.caller, &code).await?;
        commit(writer).await?;
        app.scheduler.changed();
        Ok(false)
    };
    let retracted = retracted.await;
    redirected(&mut app, &authorized.caller, &code, retracted).await
}

/// Redirects after an action, which may be a safety report about an answered pair; a conflict is shown on the page of
/// the pair.
async fn redirected(
    app: &mut AppState,
    caller: &Caller,
    code: &str,
    done: Result<bool, Error>,
) -> Result<Response, PageError> {
    match done {
        Ok(reported) => {
            let reported = if reported { "&reported=true" } else { "" };
            Ok(Redirect::to(&format!("/rate?saved={code}{reported}")).into_response())
        }
        Err(error) => {
            let refused = RefusedFields::of(error, FIELDS)?;
            Ok((refused.status(), show(app, caller, code, refused).await?).into_response())
        }
    }
}
