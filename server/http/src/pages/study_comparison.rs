//! The page that compares studies in one chart and one table.

use super::page_chart::PageChart;
use super::study::preferred;
use super::walking_pair::{WalkingGait, walking_pair};
use crate::AppState;
use crate::accessible::{Named, all_accessible};
use crate::authorization::Authorized;
use crate::bound_units;
use crate::extractors::Params;
use crate::figures::{MAX_IN_A_CHART, PROGRESS, StudyOutcome, StudyResults, have_one_reference_gait, progress_chart};
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
use gaitwright_store::trials::Trial;
use gaitwright_store::{StudyId, SubjectId, TrialId, gaits, studies, subjects};
use serde::Deserialize;
use std::collections::BTreeSet;
use std::sync::Arc;

/// How many of the newest studies are offered.
const OFFERED: u32 = 200;

/// The chosen studies.
#[derive(Debug, Deserialize)]
pub(super) struct StudiesQuery {
    #[serde(default)]
    study: Vec<Named<StudyId>>,
}

#[derive(Template)]
#[template(path = "study_comparison.html")]
struct StudyComparisonPage {
    /// Studies that can be compared, and whether each is chosen.
    offered: Vec<(Study, bool)>,
    /// Maximum number of chosen studies.
    most: usize,
    compared: Option<Compared>,
    refused: RefusedFields,
}

/// The recommended gait of a study, or why there is none.
struct BestOfStudy {
    study: StudyId,
    name: String,
    /// The trial and its number.
    trial: Option<(TrialId, u32)>,
    gait_rmse_rad: Option<f64>,
    /// Answers of people about the gait, and its values, in words.
    words: String,
}

struct Compared {
    /// Whether the studies have the same reference gait; otherwise no Gait RMSE is shown.
    comparable: bool,
    /// Whether Gait RMSE alone ranks the gaits of every study, so that the recommended gaits are sorted by it.
    ranked: bool,
    recommended: Vec<BestOfStudy>,
    /// The utility of the recommended gait of each study in which people answer.
    utilities: Vec<PageChart>,
    /// Gait RMSE of the best actions.
    chart: Option<PageChart>,
    /// Names of studies without a best action to draw.
    without_progress: Vec<String>,
    /// The best gaits of two studies; empty if one has none, and of more studies.
    walking: Vec<WalkingGait>,
    /// Whether people answer in one of the studies.
    asks_people: bool,
    studies: Vec<(StudyId, String)>,
    /// Property, value of each study, and whether the values differ.
    rows: Vec<(String, Vec<String>, bool)>,
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
    let mut chosen: Vec<StudyId> = Vec::new();
    for id in all_accessible(&mut reader, reach, choice.study).await? {
        if !chosen.contains(&id) {
            chosen.push(id);
        }
    }
    let mut refused = RefusedFields::default();
    let compared = match chosen.len() {
        0 | 1 => {
            drop(reader);
            None
        }
        2..=MAX_IN_A_CHART => {
            let mut read = Vec::new();
            for &id in &chosen {
                read.push(StudyResults::read(&mut reader, id).await?);
            }
            drop(reader);
            let analyses = Arc::clone(&app.analyses);
            let compared = app.compute(move |pool| compare(pool, &read, &analyses)).await.map_err(Error::from)??;
            Some(with_walkers(&mut app, compared).await?)
        }
        more => {
            drop(reader);
            let message = format!("At most {MAX_IN_A_CHART} studies can be compared; {more} are chosen.");
            refused = RefusedFields::of(FieldError::in_words("study", &message).into(), &[])?;
            None
        }
    };
    // The form proposes two different studies: the newest ones besides the chosen one.
    for study in &offered {
        if chosen.len() < 2 && !chosen.contains(&study.id) {
            chosen.push(study.id);
        }
    }
    let offered = offered.into_iter().map(|study| (chosen.contains(&study.id), study));
    let offered = offered.map(|(is_chosen, study)| (study, is_chosen)).collect();
    let status = refused.status();
    Ok((status, page(&StudyComparisonPage { offered, most: MAX_IN_A_CHART, compared, refused })?).into_response())
}

/// Adds the walkers of two recommended gaits.
async fn with_walkers(app: &mut AppState, mut compared: Compared) -> Result<Compared, Error> {
    let [(a, name_a), (b, name_b)] = compared.studies.as_slice() else { return Ok(compared) };
    let of = |study: StudyId| compared.recommended.iter().find(|gait| gait.study == study)?.trial;
    let (Some((a, number_a)), Some((b, number_b))) = (of(*a), of(*b)) else { return Ok(compared) };
    let names = (name_a.clone(), name_b.clone());
    let mut reader = app.read().await?;
    let gaits = gaits::find(&mut reader, a).await?.zip(gaits::find(&mut reader, b).await?);
    drop(reader);
    let Some((gait_a, gait_b)) = gaits else { return Ok(compared) };
    let draw = move |pool: &OnPool| {
        let (gait_a, gait_b) = (gait_a.unpack(pool)?, gait_b.unpack(pool)?);
        let pair = [(a, number_a, names.0, &gait_a), (b, number_b, names.1, &gait_b)];
        Ok::<_, Error>(walking_pair(pair)?.into_iter().collect())
    };
    compared.walking = app.compute(draw).await??;
    Ok(compared)
}

/// Whether people answer the comparisons of a study, alone or beside Gait RMSE.
fn people_answer(study: &Study) -> bool {
    study.plan.answer_source != AnswerSource::GaitRmse
}

impl BestOfStudy {
    fn of(snapshot: &StudySnapshot, outcome: &StudyOutcome, comparable: bool, asks_people: bool) -> Self {
        let best = outcome.best.and_then(|id| snapshot.trial(id));
        let mut words = Vec::new();
        if asks_people {
            words.push(answers(snapshot, best));
        } else if best.is_none() {
            words.push("no gait is recommended yet".to_owned());
        }
        if let Some(trial) = best {
            if let Some(rmse) = trial.gait_rmse_rad.filter(|_| comparable) {
                words.push(format!("Gait RMSE {rmse:.4} rad"));
            }
            if let Some(cost) = trial.cost_of_transport.filter(|_| !asks_people && !comparable) {
                words.push(format!("cost of transport {cost:.4}"));
            }
        }
        Self {
            study: snapshot.study.id,
            name: snapshot.study.plan.name.clone(),
            trial: best.map(|trial| (trial.id, trial.number)),
            gait_rmse_rad: best.and_then(|trial| trial.gait_rmse_rad),
            words: words.join(", "),
        }
    }
}

/// The answers of people about the recommended gait, as the end of a sentence about the study.
fn answers(snapshot: &StudySnapshot, best: Option<&Trial>) -> String {
    match best.map(|trial| preferred(trial, snapshot)) {
        _ if !people_answer(&snapshot.study) => "Gait RMSE answers every comparison".to_owned(),
        None => "no gait is recommended yet".to_owned(),
        Some(words) if words.is_empty() => "people have not compared the recommended gait yet".to_owned(),
        Some(words) => words,
    }
}

/// The properties and results of a study.
fn properties(study: &StudyResults, outcome: &StudyOutcome, comparable: bool) -> Vec<(String, String)> {
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

/// One row for each property, with the values of all studies.
fn rows(of_studies: Vec<Vec<(String, String)>>) -> Vec<(String, Vec<String>, bool)> {
    let mut rows: Vec<(String, Vec<String>, bool)> = Vec::new();
    for (place, properties) in of_studies.into_iter().enumerate() {
        for (at, (what, value)) in properties.into_iter().enumerate() {
            match rows.get_mut(at).filter(|_| place > 0) {
                Some((_, values, differ)) => {
                    *differ |= values.first() != Some(&value);
                    values.push(value);
                }
                None => rows.push((what, vec![value], false)),
            }
        }
    }
    rows
}

fn compare(pool: &OnPool, all: &[StudyResults], analyses: &Analyses) -> Result<Compared, Error> {
    let outcomes: Vec<StudyOutcome> =
        all.iter().map(|study| study.outcome(pool, analyses)).collect::<Result<_, _>>()?;
    let both: Vec<(&StudySnapshot, &StudyOutcome)> = all.iter().map(|study| &study.snapshot).zip(&outcomes).collect();
    let snapshots: Vec<&StudySnapshot> = both.iter().map(|(snapshot, _)| *snapshot).collect();
    let comparable = have_one_reference_gait(&snapshots);
    let asks_people = snapshots.iter().any(|snapshot| people_answer(&snapshot.study));
    let ranked = comparable && !asks_people;
    let recommended =
        both.iter().map(|(snapshot, outcome)| BestOfStudy::of(snapshot, outcome, comparable, asks_people));
    let mut recommended: Vec<BestOfStudy> = recommended.collect();
    if ranked {
        let rmse = |gait: &BestOfStudy| gait.gait_rmse_rad.unwrap_or(f64::INFINITY);
        recommended.sort_by(|a, b| rmse(a).total_cmp(&rmse(b)));
    }
    let mut utilities = Vec::new();
    for study in all {
        let files = format!("/api/v1/studies/{}/figures", study.snapshot.study.id);
        let title = format!("{}: utility of the recommended gait", study.snapshot.study.plan.name);
        let chart = study.utility(pool, analyses)?.map(|figure| PageChart::of(&figure, &files, ""));
        utilities.extend(chart.map(|chart| PageChart { title, ..chart }));
    }
    let identifiers: Vec<String> = snapshots.iter().map(|snapshot| snapshot.study.id.to_string()).collect();
    let chart = if comparable { progress_chart(&both) } else { None };
    let chart = identifiers.split_first().zip(chart).map(|((first, others), chart)| {
        let files = format!("/api/v1/studies/{first}/figures");
        PageChart::of(&Figure::chart(PROGRESS, chart), &files, &format!("?other={}", others.join(",")))
    });
    let without_progress = both.iter().filter(|(_, outcome)| outcome.progress().is_empty());
    let properties = all.iter().zip(&outcomes).map(|(study, outcome)| properties(study, outcome, comparable));
    Ok(Compared {
        comparable,
        ranked,
        recommended,
        utilities,
        chart,
        without_progress: without_progress.map(|(snapshot, _)| snapshot.study.plan.name.clone()).collect(),
        walking: Vec::new(),
        asks_people,
        studies: snapshots.iter().map(|snapshot| (snapshot.study.id, snapshot.study.plan.name.clone())).collect(),
        rows: rows(properties.collect()),
    })
}
