//! The list of studies.

use super::error::{Page, page};
use super::format::words;
use crate::access::Read;
use crate::error::Error;
use crate::http::AppState;
use crate::http::extract::Params;
use crate::http::may::May;
use crate::store::studies::{FeedbackMode, Study, StudyState};
use crate::store::trials::TrialCounts;
use crate::store::{Connection, StudyId, consents, studies, subjects, trials};
use askama::Template;
use axum::extract::State;
use serde::Deserialize;

/// How many studies the page shows.
const PAGE: u32 = 100;

#[derive(Template)]
#[template(path = "home.html")]
struct Home {
    studies: Vec<Row>,
    /// Whether newer studies come before these.
    later: bool,
    /// The last study of this page, when older ones follow.
    next: Option<StudyId>,
}

/// Which studies to show.
#[derive(Debug, Deserialize)]
pub(super) struct Before {
    before: Option<StudyId>,
}

struct Row {
    study: Study,
    subject: String,
    counts: TrialCounts,
    state: String,
    best_rmse: Option<String>,
    waits_for_answer: bool,
    withdrawn: bool,
}

/// `GET /`.
pub(super) async fn get(_: May<Read>, State(app): State<AppState>, Params(Before { before }): Params<Before>) -> Page {
    let mut reader = app.read().await?;
    let mut found = studies::page(&mut reader, before, PAGE + 1).await?;
    let more = found.len() > PAGE as usize;
    found.truncate(PAGE as usize);
    let next = found.last().filter(|_| more).map(|study| study.id);
    let mut rows = Vec::new();
    for study in found {
        rows.push(row(&mut reader, study).await?);
    }
    page(&Home { studies: rows, later: before.is_some(), next })
}

async fn row(db: &mut Connection, study: Study) -> Result<Row, Error> {
    let counts = trials::counts(db, study.id).await?;
    let subject = subjects::get(db, study.plan.subject_id).await?.pseudonym;
    let withdrawn = consents::is_withdrawn(db, study.id).await?;
    let best_rmse = if withdrawn { None } else { trials::smallest_rmse(db, study.id).await? };
    let best_rmse = best_rmse.map(|rmse| format!("{rmse:.4}"));
    let waits_for_answer = study.state == StudyState::Waiting && study.plan.feedback_mode == FeedbackMode::Human;
    Ok(Row { state: words(study.state.as_str()), study, subject, counts, best_rmse, waits_for_answer, withdrawn })
}
