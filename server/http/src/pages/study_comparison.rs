//! The page that compares two studies in one chart and one table.

use super::page_chart::PageChart;
use super::study::preferred;
use super::walking_pair::{WalkingGait, walking_pair};
use crate::AppState;
use crate::accessible::{Named, accessible};
use crate::authorization::Authorized;
use crate::bound_units;
use crate::extractors::Params;
use crate::figures::{COURSE, StudyOutcome, StudyResults, course, have_one_reference_gait};
use crate::format;
use crate::page_error::{PageError, page};
use crate::refused_fields::RefusedFields;
use askama::Template;
use axum::extract::State;
use axum::response::{IntoResponse, Response};
use gait_optimizer::TunedBounds;
use gaitwright_charts::Figure;
use gaitwright_compute::OnPool;
use gaitwright_service::access::Read;
use gaitwright_service::error::{Error, FieldError};
use gaitwright_service::studies::analysis::Analyses;
use gaitwright_service::studies::lifecycle;
use gaitwright_service::studies::snapshot::StudySnapshot;
use gaitwright_store::studies::{AnswerSource, Study, StudyFilter};
use gaitwright_store::{StudyId, SubjectId, TrialId, gaits, studies, subjects, trials};
use serde::Deserialize;
use std::collections::BTreeSet;
use std::sync::Arc;

/// How many of the newest studies are offered.
const OFFERED: u32 = 200;

/// The two studies.
#[derive(Debug, Deserialize)]
pub(super) struct StudiesQuery {
    a: Option<Named<StudyId>>,
    b: Option<Named<StudyId>>,
}

#[derive(Template)]
#[template(path = "study_comparison.html")]
struct SideBySide {
    offered: Vec<Study>,
    a: Option<StudyId>,
    b: Option<StudyId>,
    compared: Option<Compared>,
    refused: RefusedFields,
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
    /// What the answers of people say of the recommended gait of each study: its name, and a sentence. Empty if people answer
    /// in neither, because Gait RMSE alone then ranks the gaits.
    answers: Vec<(String, String)>,
    /// The utility of the recommended gait of each study in which people answer.
    utilities: Vec<PageChart>,
    /// Gait RMSE of the best actions.
    chart: Option<PageChart>,
    /// Names of studies without a best action to draw.
    without_course: Vec<String>,
    /// The best gaits of both studies; empty if one has none.
    walking: Vec<WalkingGait>,
    /// Property, value of each study, and whether the values differ.
    rows: Vec<(String, String, String, bool)>,
}

/// `GET /studies/compare`.
pub(super) async fn get(
    authorized: Authorized<Read>,
    State(mut app): State<AppState>,
    Params(choice): Params<StudiesQuery>,
) -> Result<Response, PageError> {
    let reach = authorized.caller.reach();
    let mut reader = app.read().await?;
    let shown: BTreeSet<SubjectId> =
        subjects::consenting(&mut reader).await?.into_iter().map(|subject| subject.id).collect();
    let mut offered = studies::page(&mut reader, reach, &StudyFilter::newest(OFFERED)).await?;
    offered.retain(|study| shown.contains(&study.plan.subject_id));
    let (a, b) = (accessible(&mut reader, reach, choice.a).await?, accessible(&mut reader, reach, choice.b).await?);
    let mut refused = RefusedFields::default();
    let compared = match (a, b) {
        (Some(a), Some(b)) if a == b => {
            let message = "\u{201c}Study B\u{201d} is the same study as study A. Choose another one.";
            refused = RefusedFields::of(FieldError::in_words("b", message).into(), &[])?;
            None
        }
        (Some(a), Some(b)) => {
            let (a, b) = (StudyResults::read(&mut reader, a).await?, StudyResults::read(&mut reader, b).await?);
            drop(reader);
            let analyses = Arc::clone(&app.analyses);
            let compared = app.compute(move |pool| compare(pool, a, b, &analyses)).await.map_err(Error::from)??;
            Some(with_best_gaits(&mut app, compared).await?)
        }
        _ => {
            drop(reader);
            None
        }
    };
    // The form proposes two different studies: the newest ones besides the chosen one.
    let other_than = |taken: Option<StudyId>| offered.iter().map(|study| study.id).find(|id| Some(*id) != taken);
    let a = a.or_else(|| other_than(b));
    let b = b.filter(|b| Some(*b) != a).or_else(|| other_than(a));
    Ok((refused.status(), page(&SideBySide { offered, a, b, compared, refused })?).into_response())
}

/// Adds the best gaits.
async fn with_best_gaits(
    app: &mut AppState,
    (mut compared, best): (Compared, [Option<TrialId>; 2]),
) -> Result<Compared, Error> {
    let [Some(a), Some(b)] = best else { return Ok(compared) };
    let mut reader = app.read().await?;
    let numbers = [trials::get(&mut reader, a).await?.number, trials::get(&mut reader, b).await?.number];
    let gaits = gaits::find(&mut reader, a).await?.zip(gaits::find(&mut reader, b).await?);
    drop(reader);
    let Some((gait_a, gait_b)) = gaits else { return Ok(compared) };
    let names = [&compared.a, &compared.b].map(|study| study.plan.name.clone());
    let draw = move |pool: &OnPool| {
        let (gait_a, gait_b) = (gait_a.unpack(pool)?, gait_b.unpack(pool)?);
        let [name_a, name_b] = names;
        Ok::<_, Error>(
            walking_pair([(a, numbers[0], name_a, &gait_a), (b, numbers[1], name_b, &gait_b)]).into_iter().flatten(),
        )
    };
    compared.walking = app.compute(draw).await??.collect();
    Ok(compared)
}

/// Whether people answer the comparisons of a study, alone or beside Gait RMSE.
fn people_answer(study: &Study) -> bool {
    study.plan.answer_source != AnswerSource::GaitRmse
}

/// What the answers of people say of the recommended gait, as the end of a sentence about the study.
fn answers(snapshot: &StudySnapshot, outcome: &StudyOutcome) -> String {
    let best = outcome.best.and_then(|id| snapshot.trial(id));
    match best.map(|trial| preferred(trial, snapshot)) {
        _ if !people_answer(&snapshot.study) => "Gait RMSE answers every comparison".to_owned(),
        None => "no gait is recommended yet".to_owned(),
        Some(words) if words.is_empty() => "people have not compared the recommended gait yet".to_owned(),
        Some(words) => words,
    }
}

/// The properties and results of a study.
fn rows(study: &StudyResults, outcome: &StudyOutcome, comparable: bool) -> Vec<(String, String)> {
    let plan = &study.snapshot.study.plan;
    let best = outcome.best.and_then(|id| study.snapshot.trial(id));
    let seconds: f64 = study.snapshot.trials.iter().filter_map(|trial| trial.seconds_total).sum();
    let mut rows = vec![
        ("State".to_owned(), lifecycle::in_words(study.snapshot.study.state).to_owned()),
        ("Subject".to_owned(), study.subject.clone()),
        ("Reference gait".to_owned(), study.reference_gait.clone()),
        ("Variant".to_owned(), format::variant(plan.muscles).to_owned()),
        ("Device".to_owned(), study.device.clone()),
        ("Source of answers".to_owned(), format::answer_source(plan.answer_source).to_owned()),
        (
            "Simulated walks".to_owned(),
            format::simulated_walks(&plan.simulated_walks).unwrap_or_else(|| "only on request".to_owned()),
        ),
        ("Combinations of bounds".to_owned(), format::count(plan.search_space.len())),
        ("Seed".to_owned(), plan.seed.to_string()),
        ("Trials with a result".to_owned(), format!("{} of {}", study.counts.results(), plan.number_of_trials)),
        ("Converged".to_owned(), study.counts.converged.to_string()),
        ("Total solve time, s".to_owned(), format!("{seconds:.0}")),
        ("Recommended trial".to_owned(), best.map_or_else(|| "–".to_owned(), |trial| trial.number.to_string())),
    ];
    if comparable {
        let rmse = best.and_then(|trial| trial.gait_rmse_rad);
        rows.push(("Gait RMSE of the recommended trial, rad".to_owned(), format::decimal(rmse)));
    }
    let cost = best.and_then(|trial| trial.cost_of_transport);
    rows.push(("Cost of transport of the recommended trial".to_owned(), format::decimal(cost)));
    let bounds = best.map(|trial| bound_units::bounds(&trial.action));
    for (place, name) in TunedBounds::NAMES.into_iter().enumerate() {
        let value = bounds.as_ref().map_or_else(|| "–".to_owned(), |bounds| bounds[place].value.clone());
        rows.push((format!("{name}: {}", bound_units::meaning(name)), value));
    }
    rows
}

fn compare(
    pool: &OnPool,
    a: StudyResults,
    b: StudyResults,
    analyses: &Analyses,
) -> Result<(Compared, [Option<TrialId>; 2]), Error> {
    let (of_a, of_b) = (a.outcome(pool, analyses)?, b.outcome(pool, analyses)?);
    let comparable = have_one_reference_gait(&[&a.snapshot, &b.snapshot]);
    let both = [(&a.snapshot, &of_a), (&b.snapshot, &of_b)];
    let asks_people = both.iter().any(|(snapshot, _)| people_answer(&snapshot.study));
    let named = |(snapshot, outcome): &(&StudySnapshot, &StudyOutcome)| {
        (snapshot.study.plan.name.clone(), answers(snapshot, outcome))
    };
    let mut utilities = Vec::new();
    for study in [&a, &b] {
        let files = format!("/api/v1/studies/{}/figures", study.snapshot.study.id);
        let title = format!("{}: utility of the recommended gait", study.snapshot.study.plan.name);
        let chart = study.utility(pool, analyses)?.map(|figure| PageChart::of(&figure, &files, ""));
        utilities.extend(chart.map(|chart| PageChart { title, ..chart }));
    }
    let chart = if comparable { course(&both) } else { None };
    let chart = chart.map(|chart| {
        let files = format!("/api/v1/studies/{}/figures", a.snapshot.study.id);
        PageChart::of(&Figure::chart(COURSE, chart), &files, &format!("?other={}", b.snapshot.study.id))
    });
    let properties = rows(&a, &of_a, comparable).into_iter().zip(rows(&b, &of_b, comparable));
    let without_course = [(&a, &of_a), (&b, &of_b)].into_iter().filter(|(_, outcome)| outcome.course().is_empty());
    let best = [of_a.best, of_b.best];
    let compared = Compared {
        walking: Vec::new(),
        rows: properties.map(|((what, a), (_, b))| (what, a.clone(), b.clone(), a != b)).collect(),
        without_course: without_course.map(|(side, _)| side.snapshot.study.plan.name.clone()).collect(),
        comparable,
        answers: both.iter().filter(|_| asks_people).map(named).collect(),
        utilities,
        chart,
        a: a.snapshot.study,
        b: b.snapshot.study,
    };
    Ok((compared, best))
}
