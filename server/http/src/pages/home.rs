//! The home page: pending tasks and the list of studies.

use super::waiting_for_you::{WaitingStudy, waiting_studies};
use crate::AppState;
use crate::authorization::SignedIn;
use crate::authorization::{Authorized, RefusedRequest};
use crate::extractors::Params;
use crate::format::variant;
use crate::page_error::{PageResult, page};
use askama::Template;
use axum::extract::State;
use axum::response::{IntoResponse, Redirect, Response};
use gaitwright_charts::sparkline;
use gaitwright_service::access::{Rate, Read, RequiredRight, Run, sign_in};
use gaitwright_service::error::Error;
use gaitwright_service::studies::lifecycle;
use gaitwright_store::studies::{AnswerSource, Study, StudyColumn, StudyFilter, StudyState};
use gaitwright_store::trials::TrialCounts;
use gaitwright_store::{Connection, StudyId, consents, reference_gaits, studies, subjects, trials};
use serde::Deserialize;

const DESCENDING: &str = "descending";
/// How many studies the page shows.
const PAGE: u32 = 100;

#[derive(Template)]
#[template(path = "home.html")]
struct Home {
    /// Whether the user has no password and came with a one-time link.
    no_password: bool,
    /// Studies that wait for an action of a user.
    waiting: Vec<WaitingStudy>,
    studies: Vec<HomeRow>,
    /// Whether there are newer studies than these.
    later: bool,
    /// The address of the next page, if older studies follow.
    next: Option<String>,
    /// The filter as typed.
    filter: ListQuery,
    /// Every tag of the accessible studies.
    tags: Vec<String>,
    states: [StudyState; 6],
    /// Whether studies can be created.
    may_run: bool,
}

impl Home {
    #[allow(clippy::trivially_copy_pass_by_ref)] // templates pass references
    fn in_words(state: &StudyState) -> &'static str {
        lifecycle::in_words(*state)
    }
}

/// Which studies to show.
#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub(super) struct ListQuery {
    /// Text in name, pseudonym, tags or notes.
    text: String,
    tag: String,
    /// The name of a state; empty for every state.
    state: String,
    /// Present for archived studies.
    archived: Option<String>,
    /// The name of the column to sort by; empty for the newest first.
    sort: String,
    /// `descending`, or ascending.
    order: String,
    after: Option<StudyId>,
}

impl ListQuery {
    /// Whether studies are left out.
    fn is_set(&self) -> bool {
        !self.text.is_empty() || !self.tag.is_empty() || !self.state.is_empty() || self.archived.is_some()
    }

    #[allow(clippy::trivially_copy_pass_by_ref)] // templates pass references
    fn is_state(&self, state: &StudyState) -> bool {
        self.state == state.as_str()
    }

    fn filter(&self, limit: u32) -> Result<StudyFilter, Error> {
        let state = match self.state.as_str() {
            "" => None,
            text => {
                let known = STATES.into_iter().find(|state| state.as_str() == text);
                Some(known.ok_or_else(|| Error::invalid("state", text, "a state from the list"))?)
            }
        };
        let sort = StudyColumn::ALL.into_iter().find(|column| column.as_str() == self.sort);
        let (sort, ascending) = match sort {
            Some(sort) => (sort, self.order != DESCENDING),
            None if self.sort.is_empty() => (StudyColumn::CreatedAt, false),
            None => return Err(Error::invalid("sort", self.sort.as_str(), "a column from the list")),
        };
        let (text, tag) = (self.text.trim().to_owned(), self.tag.clone());
        let archived = Some(self.archived.is_some());
        Ok(StudyFilter { subject: None, text, tag, state, archived, sort, ascending, after: self.after, limit })
    }

    /// The address of the studies after this one, with the same filter and order.
    fn address_after(&self, study: StudyId) -> String {
        self.address(&self.sort, &self.order, &study.to_string())
    }

    /// The address of the list sorted by a column: in ascending order, or in descending order if it is in ascending order already.
    #[allow(clippy::trivially_copy_pass_by_ref)] // templates pass references
    fn sorted_by(&self, column: &StudyColumn) -> String {
        let order = if self.direction(column) == "ascending" { DESCENDING } else { "ascending" };
        self.address(column.as_str(), order, "")
    }

    /// The direction in which the list is sorted by a column; empty if it is sorted by another one.
    #[allow(clippy::trivially_copy_pass_by_ref)] // templates pass references
    fn direction(&self, column: &StudyColumn) -> &'static str {
        match (self.sort.as_str(), column) {
            ("", StudyColumn::CreatedAt) => DESCENDING,
            (sort, column) if sort == column.as_str() && self.order == DESCENDING => DESCENDING,
            (sort, column) if sort == column.as_str() => "ascending",
            _ => "",
        }
    }

    fn address(&self, sort: &str, order: &str, after: &str) -> String {
        let archived = self.archived.as_deref().unwrap_or_default();
        let mut pairs = vec![("text", self.text.as_str()), ("tag", &self.tag), ("state", &self.state)];
        pairs.extend([("archived", archived), ("sort", sort), ("order", order), ("after", after)]);
        pairs.retain(|(_, value)| !value.is_empty());
        serde_urlencoded::to_string(pairs).map_or_else(|_| "/".to_owned(), |query| format!("/?{query}"))
    }
}

/// Every state, in the order of a study.
const STATES: [StudyState; 6] = [
    StudyState::NotStarted,
    StudyState::Running,
    StudyState::Waiting,
    StudyState::Paused,
    StudyState::Finished,
    StudyState::Stopped,
];

struct HomeRow {
    study: Study,
    subject: String,
    /// Name of the reference gait.
    reference: String,
    variant: &'static str,
    counts: TrialCounts,
    state: String,
    best_rmse: Option<String>,
    /// The lowest Gait RMSE so far by trial.
    progress: Option<String>,
    withdrawn: bool,
}

impl HomeRow {
    /// Whether people choose the gait, so that the lowest Gait RMSE may belong to another one.
    fn people_decide(&self) -> bool {
        self.study.plan.answer_source != AnswerSource::GaitRmse
    }

    /// The class of the state: a study that finished without a gait does not look like a success.
    fn state_class(&self) -> &'static str {
        if is_without_gait(self.study.state, self.counts) { "without_gait" } else { self.study.state.as_str() }
    }
}

/// Whether a study finished, and no trial has a gait.
fn is_without_gait(state: StudyState, counts: TrialCounts) -> bool {
    state == StudyState::Finished && counts.converged == 0
}

fn state_in_words(state: StudyState, counts: TrialCounts) -> String {
    if is_without_gait(state, counts) { "finished, no gait".to_owned() } else { lifecycle::in_words(state).to_owned() }
}

/// `GET /`: the studies; for raters, their page.
pub(super) async fn get(
    SignedIn(caller): SignedIn,
    authorized: Result<Authorized<Read>, RefusedRequest>,
    State(app): State<AppState>,
    Params(filter): Params<ListQuery>,
) -> Result<Response, RefusedRequest> {
    match authorized {
        Ok(authorized) => Ok(show(&app, &authorized, filter).await.into_response()),
        Err(_) if caller.is_some_and(|caller| caller.may(Rate::NEEDED)) => Ok(Redirect::to("/rate").into_response()),
        Err(refused) => Err(refused),
    }
}

async fn show(app: &AppState, authorized: &Authorized<Read>, filter: ListQuery) -> PageResult {
    let reach = authorized.caller.reach();
    let mut reader = app.read().await?;
    let mut found = studies::page(&mut reader, reach, &filter.filter(PAGE + 1)?).await?;
    let more = found.len() > PAGE as usize;
    found.truncate(PAGE as usize);
    let next = found.last().filter(|_| more).map(|study| filter.address_after(study.id));
    let mut rows = Vec::new();
    for study in found {
        rows.push(row(&mut reader, study).await?);
    }
    let waiting = waiting_studies(&mut reader, reach, PAGE).await?;
    let no_password = sign_in::has_no_password(&mut reader, &authorized.caller).await?;
    let tags = studies::tags(&mut reader, reach).await?;
    let (later, may_run) = (filter.after.is_some(), authorized.caller.may(Run::NEEDED));
    page(&Home { no_password, waiting, studies: rows, later, next, filter, tags, states: STATES, may_run })
}

async fn row(db: &mut Connection, study: Study) -> Result<HomeRow, Error> {
    let counts = trials::counts(db, study.id).await?;
    let subject = subjects::get(db, study.plan.subject_id).await?.pseudonym;
    let reference = reference_gaits::get(db, study.plan.reference_gait_id).await?.name;
    let withdrawn = consents::is_withdrawn(db, study.id).await?;
    let improvements = if withdrawn { Vec::new() } else { trials::improvements(db, study.id).await? };
    let progress: Vec<(f64, f64)> = improvements.iter().map(|(number, rmse)| (f64::from(*number), *rmse)).collect();
    Ok(HomeRow {
        state: state_in_words(study.state, counts),
        variant: variant(study.plan.muscles),
        best_rmse: improvements.last().map(|(_, rmse)| format!("{rmse:.4}")),
        progress: sparkline("Lowest Gait RMSE by trial", &progress, f64::from(counts.total)),
        study,
        subject,
        reference,
        counts,
        withdrawn,
    })
}
