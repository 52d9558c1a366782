//! The page with the figures of a study, or of two.

use super::page_chart::{PageChart, shared_legend};
use crate::AppState;
use crate::accessible::{Named, accessible};
use crate::authorization::Authorized;
use crate::extractors::Params;
use crate::figures::study::{FigureSection, StudyFigures, of_study};
use crate::page_error::{PageResult, page};
use crate::visible::Visible;
use askama::Template;
use axum::extract::State;
use gaitwright_service::access::Read;
use gaitwright_service::error::Error;
use gaitwright_store::studies::{Study, StudyFilter};
use gaitwright_store::{LabSessionId, StudyId, TrialId, lab_sessions, studies};
use serde::Deserialize;

/// How many of the newest studies the form offers for comparison.
const OFFERED: u32 = 200;

#[derive(Template)]
#[template(path = "study_figures.html")]
struct FiguresPage {
    study: Study,
    best: Option<(TrialId, u32)>,
    without_gait: Vec<String>,
    other: Option<StudyId>,
    offered: Vec<Study>,
    sessions: Vec<(LabSessionId, u32)>,
    sections: Vec<DrawnSection>,
}

/// A section as the page shows it.
struct DrawnSection {
    section: FigureSection,
    /// The legend that the charts share; empty if each has its own.
    legend: Vec<(String, String)>,
    charts: Vec<PageChart>,
}

impl FiguresPage {
    fn is(chosen: Option<&StudyId>, study: &Study) -> bool {
        chosen == Some(&study.id)
    }
}

/// The second study.
#[derive(Debug, Deserialize)]
pub(super) struct ComparedWith {
    /// The form sends an empty value if no study is chosen.
    other: Option<String>,
}

/// `GET /studies/{id}/figures`.
pub(super) async fn get(
    authorized: Authorized<Read>,
    State(mut app): State<AppState>,
    Visible(id, _): Visible<StudyId, Read>,
    Params(compared): Params<ComparedWith>,
) -> PageResult {
    let other = match compared.other.as_deref() {
        None | Some("") => None,
        Some(text) => {
            Some(text.parse::<Named<StudyId>>().map_err(|_| Error::invalid("other", text, "a study from the list"))?)
        }
    };
    let reach = authorized.caller.reach();
    let other = accessible(&mut *app.read().await?, reach, other).await?;
    let StudyFigures { study, best, without_gait, sections, .. } = of_study(&mut app, id, other.as_slice()).await?;
    let mut reader = app.read().await?;
    let mut offered = studies::page(&mut reader, reach, &StudyFilter::newest(OFFERED)).await?;
    offered.retain(|offered| offered.id != id);
    let sessions = lab_sessions::of_study(&mut reader, id).await?;
    drop(reader);
    let query = other.map_or_else(String::new, |other| format!("?other={other}"));
    let files = format!("/api/v1/studies/{id}/figures");
    let drawn = |section: FigureSection| {
        let mut charts: Vec<PageChart> = section.figures.iter().map(|f| PageChart::of(f, &files, &query)).collect();
        DrawnSection { legend: shared_legend(&mut charts), charts, section }
    };
    page(&FiguresPage {
        study,
        best,
        without_gait,
        other,
        offered,
        sessions: sessions.iter().map(|session| (session.id, session.number)).collect(),
        sections: sections.into_iter().map(drawn).collect(),
    })
}
