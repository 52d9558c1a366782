//! The page that compares two studies in one chart and one table.

use super::page_chart::Drawn;
use crate::AppState;
use crate::accessible::{Named, accessible};
use crate::authorization::Authorized;
use crate::extract::Params;
use crate::figures::{COURSE, Outcome, StudyResults, course, have_one_reference_gait};
use crate::format::{self, words};
use crate::page_error::{Page, page};
use askama::Template;
use axum::extract::State;
use gait_optimizer::TunedBounds;
use gaitwright_charts::Figure;
use gaitwright_compute::OnPool;
use gaitwright_service::access::Read;
use gaitwright_service::error::Error;
use gaitwright_service::studies::belief::Beliefs;
use gaitwright_store::studies::{Chosen, Study};
use gaitwright_store::{StudyId, studies};
use serde::Deserialize;
use std::sync::Arc;

/// How many of the newest studies are offered.
const OFFERED: u32 = 200;

/// The two studies.
#[derive(Debug, Deserialize)]
pub(super) struct Choice {
    a: Option<Named<StudyId>>,
    b: Option<Named<StudyId>>,
}

#[derive(Template)]
#[template(path = "side_by_side.html")]
struct SideBySide {
    offered: Vec<Study>,
    a: Option<StudyId>,
    b: Option<StudyId>,
    compared: Option<Compared>,
}

impl SideBySide {
    fn is(chosen: Option<&StudyId>, study: &Study) -> bool {
        chosen == Some(&study.id)
    }
}

struct Compared {
    a: Study,
    b: Study,
    /// Whether the studies have the same reference gait; otherwise no Gait RMSE is shown.
    comparable: bool,
    chart: Option<Drawn>,
    /// Names of studies without a best action to draw.
    without_course: Vec<String>,
    /// Property, value of each study, and whether the values differ.
    rows: Vec<(String, String, String, bool)>,
}

/// `GET /studies/compare`.
pub(super) async fn get(
    authorized: Authorized<Read>,
    State(mut app): State<AppState>,
    Params(choice): Params<Choice>,
) -> Page {
    let reach = authorized.caller.reach();
    let mut reader = app.read().await?;
    let offered = studies::page(&mut reader, reach, Chosen::newest(OFFERED)).await?;
    let (a, b) = (accessible(&mut reader, reach, choice.a).await?, accessible(&mut reader, reach, choice.b).await?);
    let compared = match (a, b) {
        (Some(a), Some(b)) if a == b => {
            return Err(Error::invalid("b", b.to_string(), "a study other than study A").into());
        }
        (Some(a), Some(b)) => {
            let (a, b) = (StudyResults::read(&mut reader, a).await?, StudyResults::read(&mut reader, b).await?);
            drop(reader);
            let beliefs = Arc::clone(&app.beliefs);
            Some(app.compute(move |pool| compare(pool, a, b, &beliefs)).await.map_err(Error::from)??)
        }
        _ => {
            drop(reader);
            None
        }
    };
    page(&SideBySide { offered, a, b, compared })
}

/// The properties and results of the study.
/// The properties and results of a study.
fn rows(study: &StudyResults, outcome: &Outcome, comparable: bool) -> Vec<(String, String)> {
    let plan = &study.snapshot.study.plan;
    let best = outcome.best.and_then(|id| study.snapshot.trial(id));
    let seconds: f64 = study.snapshot.trials.iter().filter_map(|trial| trial.seconds_total).sum();
    let mut rows = vec![
        ("State".to_owned(), words(study.snapshot.study.state.as_str())),
        ("Subject".to_owned(), study.subject.clone()),
        ("Reference gait".to_owned(), study.reference_gait.clone()),
        ("Variant".to_owned(), format::variant(plan.muscles).to_owned()),
        ("Answered by".to_owned(), format::answers_by(plan.feedback_mode).to_owned()),
        ("Combinations of bounds".to_owned(), format::count(plan.search_space.len())),
        ("Seed".to_owned(), plan.seed.to_string()),
        ("Trials with a result".to_owned(), format!("{} of {}", study.counts.results(), plan.trial_budget)),
        ("Converged".to_owned(), study.counts.converged.to_string()),
        ("Total solve time, s".to_owned(), format!("{seconds:.0}")),
        ("Best trial".to_owned(), best.map_or_else(|| "–".to_owned(), |trial| trial.number.to_string())),
    ];
    if comparable {
        let rmse = best.and_then(|trial| trial.gait_rmse_rad);
        rows.push(("Gait RMSE of the best trial, rad".to_owned(), format::figure(rmse)));
    }
    let cost = best.and_then(|trial| trial.cost_of_transport);
    rows.push(("Cost of transport of the best trial".to_owned(), format::figure(cost)));
    let bounds = best.map(|trial| trial.action.to_array());
    for (place, name) in TunedBounds::NAMES.iter().enumerate() {
        let value = bounds.map_or_else(|| "–".to_owned(), |bounds| bounds[place].to_string());
        rows.push((format!("{name}: {}", TunedBounds::MEANINGS[place]), value));
    }
    rows
}

fn compare(pool: &OnPool, a: StudyResults, b: StudyResults, beliefs: &Beliefs) -> Result<Compared, Error> {
    let (of_a, of_b) = (a.outcome(pool, beliefs)?, b.outcome(pool, beliefs)?);
    let comparable = have_one_reference_gait(&[&a.snapshot, &b.snapshot]);
    let both = [(&a.snapshot, &of_a), (&b.snapshot, &of_b)];
    let chart = if comparable { course(&both) } else { None };
    let chart = chart.map(|chart| {
        let files = format!("/api/v1/studies/{}/figures", a.snapshot.study.id);
        Drawn::of(&Figure::chart(COURSE, chart), &files, &format!("?other={}", b.snapshot.study.id))
    });
    let properties = rows(&a, &of_a, comparable).into_iter().zip(rows(&b, &of_b, comparable));
    let without_course = [(&a, &of_a), (&b, &of_b)].into_iter().filter(|(_, outcome)| outcome.course().is_empty());
    Ok(Compared {
        rows: properties.map(|((what, a), (_, b))| (what, a.clone(), b.clone(), a != b)).collect(),
        without_course: without_course.map(|(side, _)| side.snapshot.study.plan.name.clone()).collect(),
        comparable,
        chart,
        a: a.snapshot.study,
        b: b.snapshot.study,
    })
}
