//! Studies.

use crate::error::Error;
use crate::http::AppState;
use crate::http::extract::{Id, Params};
use crate::http::once::{Once, OnceWith};
use crate::store::studies::{self, Study};
use crate::store::trials::{self, TrialCounts};
use crate::store::{Connection, StudyId};
use crate::studies::command;
use crate::studies::lifecycle::{Act, acts_of_people};
use crate::studies::plan::{self, NewStudy};
use axum::Json;
use axum::extract::State;
use axum::http::StatusCode;
use axum::response::Response;
use serde::{Deserialize, Serialize};

/// A study as answered.
#[derive(Debug, Serialize)]
pub(super) struct StudyView {
    #[serde(flatten)]
    study: Study,
    trials: TrialCounts,
    /// What can be done to it where it stands.
    possible: Vec<&'static str>,
}

impl StudyView {
    async fn of(db: &mut Connection, study: Study) -> Result<Self, Error> {
        let trials = trials::counts(db, study.id).await?;
        let possible = acts_of_people(study.state).into_iter().map(Act::as_str).collect();
        Ok(Self { study, trials, possible })
    }
}

/// A page of studies.
#[derive(Debug, Serialize)]
pub(super) struct StudyPage {
    studies: Vec<StudyView>,
    /// Give it as `before` to get the next page; absent on the last one.
    #[serde(skip_serializing_if = "Option::is_none")]
    next: Option<StudyId>,
}

/// Which page.
#[derive(Debug, Deserialize)]
pub(super) struct PageParams {
    before: Option<StudyId>,
    limit: Option<u32>,
}

/// `GET`: newest first, by pages.
pub(super) async fn list(
    State(app): State<AppState>,
    Params(page): Params<PageParams>,
) -> Result<Json<StudyPage>, Error> {
    let limit = page.limit.unwrap_or(50);
    if !(1..=200).contains(&limit) {
        return Err(Error::invalid("limit", limit, "1 to 200"));
    }
    let mut reader = app.read().await?;
    let mut found = studies::page(&mut reader, page.before, limit + 1).await?;
    let more = found.len() > limit as usize;
    found.truncate(limit as usize);
    let next = if more { found.last().map(|study| study.id) } else { None };
    let mut views = Vec::with_capacity(found.len());
    for study in found {
        views.push(StudyView::of(&mut reader, study).await?);
    }
    Ok(Json(StudyPage { studies: views, next }))
}

/// `GET {id}`.
pub(super) async fn get(State(app): State<AppState>, Id(id): Id<StudyId>) -> Result<Json<StudyView>, Error> {
    let mut reader = app.read().await?;
    let study = studies::get(&mut reader, id).await?;
    Ok(Json(StudyView::of(&mut reader, study).await?))
}

/// `POST`: makes one, and starts it unless `start` is false.
pub(super) async fn create(
    State(app): State<AppState>,
    OnceWith(once, new): OnceWith<NewStudy>,
) -> Result<Response, Error> {
    let mut writer = match once.begin(&app).await? {
        Ok(writer) => writer,
        Err(before) => return Ok(before),
    };
    let study = plan::create(&mut writer, &once.actor, new).await?;
    let view = StudyView::of(&mut writer, study).await?;
    let location = format!("/api/v1/studies/{}", view.study.id);
    once.finish(&app, writer, StatusCode::CREATED, Some(location), &view).await
}

/// `POST {id}/start`.
pub(super) async fn start(State(app): State<AppState>, Id(id): Id<StudyId>, once: Once) -> Result<Response, Error> {
    act(&app, id, &once, Act::Start).await
}

/// `POST {id}/pause`.
pub(super) async fn pause(State(app): State<AppState>, Id(id): Id<StudyId>, once: Once) -> Result<Response, Error> {
    act(&app, id, &once, Act::Pause).await
}

/// `POST {id}/resume`.
pub(super) async fn resume(State(app): State<AppState>, Id(id): Id<StudyId>, once: Once) -> Result<Response, Error> {
    act(&app, id, &once, Act::Resume).await
}

/// `POST {id}/stop`.
pub(super) async fn stop(State(app): State<AppState>, Id(id): Id<StudyId>, once: Once) -> Result<Response, Error> {
    act(&app, id, &once, Act::Stop).await
}

async fn act(app: &AppState, id: StudyId, once: &Once, act: Act) -> Result<Response, Error> {
    let mut writer = match once.begin(app).await? {
        Ok(writer) => writer,
        Err(before) => return Ok(before),
    };
    let done = command::act(&mut writer, &once.actor, id, act, "").await?;
    let view = StudyView::of(&mut writer, done.study).await?;
    let answer = once.finish(app, writer, StatusCode::OK, None, &view).await?;
    done.cancelled.into_iter().for_each(|trial| app.director.cancel_solve(trial));
    Ok(answer)
}
