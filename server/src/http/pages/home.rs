//! The list of studies.

use super::error::{Page, page};
use crate::http::AppState;
use crate::store::studies::Study;
use crate::store::trials::TrialCounts;
use crate::store::{studies, trials};
use askama::Template;
use axum::extract::State;

/// How many studies a page shows.
const PAGE: u32 = 50;

#[derive(Template)]
#[template(path = "home.html")]
struct Home {
    studies: Vec<(Study, TrialCounts)>,
}

/// `GET /`.
pub async fn get(State(app): State<AppState>) -> Page {
    let mut reader = app.read().await?;
    let mut rows = Vec::new();
    for study in studies::page(&mut reader, None, PAGE).await? {
        let counts = trials::counts(&mut reader, study.id).await?;
        rows.push((study, counts));
    }
    page(&Home { studies: rows })
}
