//! The pages in the lab: the next walk, and the answer of the subject. They never name a gait.

use crate::AppState;
use crate::accessible::Id;
use crate::authorization::Authorized;
use crate::extractors::Form;
use crate::format::walks_in_words;
use crate::page_error::{PageError, PageResult, page};
use crate::refused_fields::{FieldLabels, RefusedFields, refused_once};
use askama::Template;
use axum::extract::State;
use axum::response::{IntoResponse, Redirect, Response};
use gaitwright_service::access::{Rate, Read, RequiredRight};
use gaitwright_service::error::Error;
use gaitwright_service::studies::lab::{self, LabSessionProgress, NewAnswer, RecordedWalk};
use gaitwright_store::{Instant, LabSessionId, accessible_studies, commit, lab_sessions, now};
use serde::Deserialize;

/// How many of the newest open sessions are listed.
const MAX_LISTED_SESSIONS: u32 = 100;
/// How long a closed session stays in the list, s: a fall may be reported late.
const LISTED_SECONDS: i64 = 7 * 86_400;

#[derive(Template)]
#[template(path = "lab.html")]
struct LabPage {
    /// Open sessions with name, time of planning and next step, without the study's name, which could reveal what is tuned.
    sessions: Vec<(LabSessionId, String, Instant, String)>,
    /// Whether the caller can see any study.
    assigned: bool,
    /// Whether the caller may see studies, so that the page has the navigation.
    staff: bool,
}

#[derive(Template)]
#[template(path = "lab_walk.html")]
struct WalkPage {
    name: String,
    /// The answer in force.
    answer_in_words: &'static str,
    seen: LabSessionProgress,
    refused: RefusedFields,
    /// The note of a refused form.
    typed: String,
}

impl WalkPage {
    /// Whether the second walk with the device may have begun.
    fn second_may_have_begun(&self) -> bool {
        self.seen.walk.is_none_or(|walk| walk == 3)
    }
}

/// The fields of the form of a walk.
const WALK: FieldLabels = &[("note", "Note")];
/// The fields of the form of an answer.
const ANSWER: FieldLabels = &[("note", "What the subject noticed")];

/// The form of a walk.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct WalkForm {
    walk: u8,
    #[serde(default)]
    note: String,
    /// `yes` if the box is ticked.
    complete: Option<String>,
}

/// `GET /lab`.
pub(super) async fn list(authorized: Authorized<Rate>, State(app): State<AppState>) -> PageResult {
    let mut reader = app.read().await?;
    let mut sessions = Vec::new();
    let since = now().plus_seconds(-LISTED_SECONDS);
    for session in lab_sessions::open_since(&mut reader, authorized.caller.reach(), MAX_LISTED_SESSIONS, since).await? {
        let seen = lab::session_progress(&mut reader, session.id).await?;
        let next = match (seen.walk, seen.answer_number) {
            _ if seen.closed => "closed; a walk can still be reported as unsafe".to_owned(),
            _ if seen.was_unsafe() => "a walk was reported as unsafe".to_owned(),
            (Some(walk), _) => format!("walk {walk} is next"),
            (None, Some(_)) => "all walks recorded, answer pending".to_owned(),
            (None, None) => "all walks recorded, answer saved".to_owned(),
        };
        sessions.push((session.id, lab::name_in_lab(session.id), session.created_at, next));
    }
    let assigned = accessible_studies::reaches_any(&mut reader, authorized.caller.reach()).await?;
    let staff = authorized.caller.may(Read::NEEDED);
    page(&LabPage { sessions, assigned, staff })
}

/// `GET /lab/{id}`.
pub(super) async fn get(
    _: Authorized<Rate>,
    State(app): State<AppState>,
    Id(id, _): Id<LabSessionId, Rate>,
) -> PageResult {
    show(&app, id, RefusedFields::default(), String::new()).await
}

async fn show(app: &AppState, id: LabSessionId, refused: RefusedFields, typed: String) -> PageResult {
    let seen = lab::session_progress(&mut *app.read().await?, id).await?;
    let answer_in_words = seen.answer.as_ref().map_or("", |answer| walks_in_words(answer.answer));
    page(&WalkPage { name: lab::name_in_lab(id), answer_in_words, seen, refused, typed })
}

/// `POST /lab/{id}`.
pub(super) async fn record(
    authorized: Authorized<Rate>,
    State(app): State<AppState>,
    Id(id, _): Id<LabSessionId, Rate>,
    Form(WalkForm { walk, note, complete }): Form<WalkForm>,
) -> Result<Response, PageError> {
    let walked = RecordedWalk { walk, note };
    let recorded = async {
        let mut writer = app.write().await?;
        if !lab::was_recorded(&mut writer, id, &walked).await? {
            if complete.as_deref() != Some("yes") {
                return Err(Error::conflict(format!(
                    "Walk {walk} was not recorded. First tick the box to confirm that it is complete and \
                     measured: recording a walk cannot be undone."
                )));
            }
            lab::record_walk(&mut writer, &authorized.caller.actor, id, &walked).await?;
            commit(writer).await?;
        }
        Ok(())
    };
    read_back(&app, id, (recorded.await, WALK), walked.note).await
}

/// `POST /lab/{id}/answer`.
pub(super) async fn answer(
    authorized: Authorized<Rate>,
    State(app): State<AppState>,
    Id(id, _): Id<LabSessionId, Rate>,
    Form(new): Form<NewAnswer>,
) -> Result<Response, PageError> {
    let answered = async {
        let mut writer = app.write().await?;
        lab::answer(&mut writer, &authorized.caller, id, &new).await?;
        commit(writer).await?;
        app.scheduler.changed();
        Ok(())
    };
    read_back(&app, id, (answered.await, ANSWER), new.note).await
}

/// `POST /lab/{id}/retract`.
pub(super) async fn retract(
    authorized: Authorized<Rate>,
    State(app): State<AppState>,
    Id(id, _): Id<LabSessionId, Rate>,
) -> Result<Response, PageError> {
    let retracted = async {
        let mut writer = app.write().await?;
        lab::retract(&mut writer, &authorized.caller, id).await?;
        Ok(commit(writer).await?)
    };
    read_back(&app, id, (retracted.await, &[]), String::new()).await
}

/// Shows the present state, with the reason and the typed note if a form was refused.
async fn read_back(
    app: &AppState,
    id: LabSessionId,
    (done, labels): (Result<(), Error>, FieldLabels),
    typed: String,
) -> Result<Response, PageError> {
    let refused = refused_once(done, labels)?;
    if refused.is_empty() {
        return Ok(Redirect::to(&format!("/lab/{id}")).into_response());
    }
    Ok((refused.status(), show(app, id, refused, typed).await?).into_response())
}
