//! The list of studies.

use super::error::{Page, page};
use super::format::words;
use crate::access::Read;
use crate::error::Error;
use crate::http::AppState;
use crate::http::may::May;
use crate::store::studies::{FeedbackMode, Study, StudyState};
use crate::store::trials::TrialCounts;
use crate::store::{Connection, studies, subjects, trials};
use askama::Template;
use axum::extract::State;

/// How many studies the page shows.
const PAGE: u32 = 100;

#[derive(Template)]
#[template(path = "home.html")]
struct Home {
    studies: Vec<Row>,
}

struct Row {
    study: Study,
    subject: String,
    counts: TrialCounts,
    state: String,
    best_rmse: Option<String>,
    waits_for_answer: bool,
}

/// `GET /`.
pub(super) async fn get(_: May<Read>, State(app): State<AppState>) -> Page {
    let mut reader = app.read().await?;
    let mut rows = Vec::new();
    for study in studies::page(&mut reader, None, PAGE).await? {
        rows.push(row(&mut reader, study).await?);
    }
    page(&Home { studies: rows })
}

async fn row(db: &mut Connection, study: Study) -> Result<Row, Error> {
    let counts = trials::counts(db, study.id).await?;
    let subject = subjects::get(db, study.plan.subject_id).await?.pseudonym;
    let best_rmse = trials::smallest_rmse(db, study.id).await?.map(|rmse| format!("{rmse:.4}"));
    let waits_for_answer = study.state == StudyState::Waiting && study.plan.feedback_mode == FeedbackMode::Human;
    Ok(Row { state: words(study.state.as_str()), study, subject, counts, best_rmse, waits_for_answer })
}
