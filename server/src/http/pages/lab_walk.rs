//! The pages in the lab: which walk is next. Nothing here can name a gait.

use super::error::{Page, PageError, page};
use crate::access::Rate;
use crate::http::AppState;
use crate::http::extract::{Form, Id};
use crate::http::may::May;
use crate::store::{LabSessionId, commit, lab_sessions};
use crate::studies::lab::{self, InTheLab, RecordedWalk};
use askama::Template;
use axum::extract::State;
use axum::response::Redirect;

/// So many of the newest open sessions are listed.
const LISTED: u32 = 100;

#[derive(Template)]
#[template(path = "lab.html")]
struct LabPage {
    /// What each open session is known by: names of studies can say what is tuned.
    sessions: Vec<(LabSessionId, String)>,
}

#[derive(Template)]
#[template(path = "lab_walk.html")]
struct WalkPage {
    name: String,
    seen: InTheLab,
}

/// `GET /lab`.
pub(super) async fn list(_: May<Rate>, State(app): State<AppState>) -> Page {
    let open = lab_sessions::open(&mut *app.read().await?, LISTED).await?;
    page(&LabPage { sessions: open.iter().map(|session| (session.id, session.id.short())).collect() })
}

/// `GET /lab/{id}`.
pub(super) async fn get(_: May<Rate>, State(app): State<AppState>, Id(id): Id<LabSessionId>) -> Page {
    let seen = lab::in_the_lab(&mut *app.read().await?, id).await?;
    page(&WalkPage { name: id.short(), seen })
}

/// `POST /lab/{id}`.
pub(super) async fn record(
    may: May<Rate>,
    State(app): State<AppState>,
    Id(id): Id<LabSessionId>,
    Form(walked): Form<RecordedWalk>,
) -> Result<Redirect, PageError> {
    let mut writer = app.write().await?;
    lab::record_walk(&mut writer, &may.caller.actor, id, &walked).await?;
    commit(writer).await?;
    Ok(Redirect::to(&format!("/lab/{id}")))
}
