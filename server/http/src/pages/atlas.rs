//! The page *Atlas*: the gait of every action of a study that makes one, and the button that begins one.

use super::page_chart::PageChart;
use crate::AppState;
use crate::accessible::Id;
use crate::authorization::Authorized;
use crate::bound_units::in_unit;
use crate::extractors::Params;
use crate::figures::atlas_maps::{chosen, dimensions, maps};
use crate::figures::maps_over_two_bounds::{AxisChoice, DimensionChoice};
use crate::format::{self, decimal};
use crate::page_error::{PageError, PageResult, page};
use crate::visible::Visible;
use askama::Template;
use axum::extract::State;
use axum::response::Redirect;
use gaitwright_compute::OnPool;
use gaitwright_service::access::{Read, RequiredRight, Run};
use gaitwright_service::error::Error;
use gaitwright_service::studies::atlas::{AtlasProgress, AtlasResult, StudyAtlas};
use gaitwright_service::studies::lifecycle;
use gaitwright_service::studies::study_clone::{self, StudyClone};
use gaitwright_store::certificates::CertificateOnRecord;
use gaitwright_store::studies::{AtlasRole, Evaluation, Study, StudyState};
use gaitwright_store::trials::Trial;
use gaitwright_store::{StudyId, TrialId, certificates, commit, studies, trials};
use std::collections::HashMap;

#[derive(Template)]
#[template(path = "atlas.html")]
struct AtlasPage {
    study: Study,
    /// `None` if the study makes no atlas.
    shown: Option<ShownAtlas>,
    /// Whether an atlas of the problem of the study can be made.
    may_make: bool,
}

struct ShownAtlas {
    progress: AtlasProgress,
    state: &'static str,
    /// A sentence about the time left; may be empty.
    time_left: String,
    best: Option<BestRow>,
    best_certified: Option<BestRow>,
    dimensions: Vec<DimensionChoice>,
    /// The trial whose bounds the maps hold.
    held: Option<(TrialId, u32)>,
    maps: Vec<PageChart>,
}

struct BestRow {
    trial: (TrialId, u32),
    rmse: String,
    cost: String,
    bounds: String,
}

impl BestRow {
    fn of(study: &Study, result: AtlasResult<'_>) -> Self {
        let trial = result.trial;
        let space = &study.plan.search_space;
        let bounds = space.dimensions().iter().zip(space.values(result.action));
        let bounds: Vec<String> = bounds
            .map(|(dimension, value)| format!("{} = {}", dimension.name, in_unit(&dimension.name, value)))
            .collect();
        Self {
            trial: (trial.id, trial.number),
            rmse: decimal(trial.gait_rmse_rad),
            cost: decimal(trial.cost_of_transport),
            bounds: bounds.join(", "),
        }
    }
}

/// `GET /studies/{id}/atlas`.
pub(super) async fn get(
    authorized: Authorized<Read>,
    State(mut app): State<AppState>,
    Visible(id, _): Visible<StudyId, Read>,
    Params(choice): Params<AxisChoice>,
) -> PageResult {
    let mut reader = app.read().await?;
    let study = studies::get(&mut reader, id).await?;
    if study.plan.atlas != AtlasRole::Make {
        let may_make = study.plan.evaluation == Evaluation::Optimizer && authorized.caller.may(Run::NEEDED);
        return page(&AtlasPage { study, shown: None, may_make });
    }
    let trials = trials::of_study(&mut reader, id).await?;
    let certified = certificates::of_study(&mut reader, id).await?;
    drop(reader);
    let workers = app.scheduler.workers();
    let draw = move |pool: &OnPool| {
        let shown = show(pool, &study, &trials, &certified, &choice, workers);
        shown.map(|shown| AtlasPage { study, shown: Some(shown), may_make: false })
    };
    page(&app.compute(draw).await.map_err(Error::from)??)
}

/// `POST /studies/{id}/atlas`: makes the atlas of the problem of a study, as a study of its own.
pub(super) async fn post(
    authorized: Authorized<Run>,
    State(app): State<AppState>,
    Id(id, _): Id<StudyId, Run>,
) -> Result<Redirect, PageError> {
    let clone = StudyClone { atlas: Some(AtlasRole::Make), start: true, ..StudyClone::default() };
    let mut writer = app.write().await?;
    let (actor, reach) = (&authorized.caller.actor, authorized.caller.reach());
    let made = study_clone::clone_study(&mut writer, actor, reach, id, &clone).await?;
    commit(writer).await?;
    app.scheduler.changed();
    Ok(Redirect::to(&format!("/studies/{}/atlas", made.id)))
}

fn show(
    pool: &OnPool,
    study: &Study,
    trials: &[Trial],
    certified: &HashMap<TrialId, CertificateOnRecord>,
    choice: &AxisChoice,
    workers: usize,
) -> Result<ShownAtlas, Error> {
    let space = &study.plan.search_space;
    let atlas = StudyAtlas::of(pool, &study.plan, trials)?;
    let best = atlas.by_gait_rmse().first().copied();
    let pair = chosen(&atlas, space, choice)?;
    let drawn = match (pair, best) {
        (Some(pair), Some(best)) => maps(&atlas, space, pair, best.action).map_err(Error::Learner)?,
        _ => Vec::new(),
    };
    let chart = |(map, [with_lines, without_lines]): (&gaitwright_charts::HeatMap, [&'static str; 2])| PageChart {
        title: map.title.clone(),
        note: if map.draws_contours() { with_lines } else { without_lines },
        svg: map.svg(),
        is_wide: true,
        legend: Vec::new(),
        files: Vec::new(),
    };
    Ok(ShownAtlas {
        progress: atlas.progress,
        state: lifecycle::in_words(study.state),
        time_left: time_left(study, trials, &atlas.progress, workers),
        best: best.map(|best| BestRow::of(study, best)),
        best_certified: atlas.best_certified(certified).map(|best| BestRow::of(study, best)),
        dimensions: pair.map_or_else(Vec::new, |pair| dimensions(space, pair)),
        held: best.map(|best| (best.trial.id, best.trial.number)),
        maps: drawn.iter().zip(NOTES).map(chart).collect(),
    })
}

/// The text below each map, with contour lines and without.
const NOTES: [[&str; 2]; 3] = [
    [
        "Contour lines connect equal values. The frame marks the gait with the lowest Gait RMSE; – means that the action has no result yet.",
        "The frame marks the gait with the lowest Gait RMSE; – means that the action has no result yet.",
    ],
    ["Contour lines connect equal values.", ""],
    ["The number of bounds that cannot move without changing the gait, and their names."; 2],
];

/// About how long an atlas that runs still takes; empty if that is unknown.
fn time_left(study: &Study, trials: &[Trial], progress: &AtlasProgress, workers: usize) -> String {
    // The root starts cold and takes longer than the others.
    let mut solves: Vec<f64> = trials.iter().skip(1).filter_map(|trial| trial.seconds_total).collect();
    solves.sort_by(f64::total_cmp);
    let median = solves.get(solves.len() / 2);
    let (StudyState::Running, Some(median)) = (study.state, median) else { return String::new() };
    let parallel = (study.plan.parallel_trials as usize).min(workers).max(1);
    let seconds = median * progress.solves_left as f64 / parallel as f64;
    format!("About {} left, for about {} more solves.", format::duration(seconds), format::count(progress.solves_left))
}
