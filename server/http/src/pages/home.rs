//! The home page: pending tasks and the list of studies.

use crate::AppState;
use crate::authorization::SignedIn;
use crate::authorization::{Authorized, Refused};
use crate::extractors::Params;
use crate::format::{variant, words};
use crate::page_error::{Page, page};
use askama::Template;
use axum::extract::State;
use axum::response::{IntoResponse, Redirect, Response};
use gaitwright_charts::sparkline;
use gaitwright_service::access::{Permission, Rate, Read, sign_in};
use gaitwright_service::error::Error;
use gaitwright_service::studies::safety_reports;
use gaitwright_store::studies::{Chosen, Study, StudyState};
use gaitwright_store::trials::TrialCounts;
use gaitwright_store::{Connection, StudyId, consents, studies, subjects, trials};
use serde::Deserialize;

/// How many studies the page shows.
const PAGE: u32 = 100;

#[derive(Template)]
#[template(path = "home.html")]
struct Home {
    /// Whether the user has no password and came with a one-time link.
    no_password: bool,
    /// Studies that wait for an action of a user.
    waiting: Vec<Waiting>,
    studies: Vec<Row>,
    /// Whether there are newer studies than these.
    later: bool,
    /// The last study of this page, if older ones follow.
    next: Option<StudyId>,
}

/// Which studies to show.
#[derive(Debug, Deserialize)]
pub(super) struct StudyFilter {
    before: Option<StudyId>,
}

struct Row {
    study: Study,
    subject: String,
    variant: &'static str,
    counts: TrialCounts,
    state: String,
    best_rmse: Option<String>,
    /// The lowest Gait RMSE so far by trial.
    course: Option<String>,
    withdrawn: bool,
}

struct Waiting {
    study: Study,
    what: String,
    /// The page of the action.
    link: String,
}

/// `GET /`: the studies; for raters, their page.
pub(super) async fn get(
    SignedIn(caller): SignedIn,
    authorized: Result<Authorized<Read>, Refused>,
    State(app): State<AppState>,
    Params(StudyFilter { before }): Params<StudyFilter>,
) -> Result<Response, Refused> {
    match authorized {
        Ok(authorized) => Ok(show(&app, &authorized, before).await.into_response()),
        Err(_) if caller.is_some_and(|caller| caller.may(Rate::NEEDED)) => Ok(Redirect::to("/rate").into_response()),
        Err(refused) => Err(refused),
    }
}

async fn show(app: &AppState, authorized: &Authorized<Read>, before: Option<StudyId>) -> Page {
    let reach = authorized.caller.reach();
    let mut reader = app.read().await?;
    let mut found = studies::page(&mut reader, reach, Chosen { before, ..Chosen::newest(PAGE + 1) }).await?;
    let more = found.len() > PAGE as usize;
    found.truncate(PAGE as usize);
    let next = found.last().filter(|_| more).map(|study| study.id);
    let mut rows = Vec::new();
    for study in found {
        rows.push(row(&mut reader, study).await?);
    }
    let unsafe_gaits = safety_reports::undecided(&mut reader, reach, PAGE).await?.into_iter().map(unsafe_gaits);
    let held = studies::waiting_for_people(&mut reader, reach, PAGE).await?.into_iter().map(waiting);
    let waiting = unsafe_gaits.chain(held).collect();
    let no_password = sign_in::has_no_password(&mut reader, &authorized.caller).await?;
    page(&Home { no_password, waiting, studies: rows, later: before.is_some(), next })
}

/// Safety reports that staff have to review.
fn unsafe_gaits((study, count): (Study, usize)) -> Waiting {
    let what = match count {
        1 => "1 gait reported as unsafe needs a safety review".to_owned(),
        _ => format!("{count} gaits reported as unsafe need a safety review"),
    };
    Waiting { link: format!("/studies/{}", study.id), what, study }
}

fn waiting(study: Study) -> Waiting {
    let (what, place) = match study.state {
        StudyState::Waiting => ("a comparison needs your answer".to_owned(), "/compare"),
        // A pause by a user has no reason; a pause by the service has one.
        StudyState::Paused if study.state_reason.is_empty() => ("paused: resume it to continue".to_owned(), ""),
        StudyState::Paused => (format!("paused: {}", study.state_reason), ""),
        _ => ("not started yet".to_owned(), ""),
    };
    Waiting { link: format!("/studies/{}{place}", study.id), what, study }
}

async fn row(db: &mut Connection, study: Study) -> Result<Row, Error> {
    let counts = trials::counts(db, study.id).await?;
    let subject = subjects::get(db, study.plan.subject_id).await?.pseudonym;
    let withdrawn = consents::is_withdrawn(db, study.id).await?;
    let improvements = if withdrawn { Vec::new() } else { trials::improvements(db, study.id).await? };
    let course: Vec<(f64, f64)> = improvements.iter().map(|(number, rmse)| (f64::from(*number), *rmse)).collect();
    Ok(Row {
        state: words(study.state.as_str()),
        variant: variant(study.plan.muscles),
        best_rmse: improvements.last().map(|(_, rmse)| format!("{rmse:.4}")),
        course: sparkline("Lowest Gait RMSE by trial", &course, f64::from(counts.total)),
        study,
        subject,
        counts,
        withdrawn,
    })
}
