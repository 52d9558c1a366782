//! REST: comparison of several studies.

use crate::AppState;
use crate::accessible::Named;
use crate::authorization::Authorized;
use crate::paging::{Page, Paging};
use crate::problem_details::Refusal;
use crate::resources::trials::TrialCounts;
use axum::Json;
use axum::extract::State;
use gait_optimizer::TunedBounds;
use gaitwright_compute::OnPool;
use gaitwright_service::access::Read;
use gaitwright_service::error::Error;
use gaitwright_service::studies::recommended_trial::ranking_to_show;
use gaitwright_service::studies::snapshot::StudySnapshot;
use gaitwright_service::studies::study_plan_schemas;
use gaitwright_store::studies::{self, Study, StudyState};
use gaitwright_store::{ReferenceGaitId, StudyId, consents, trials};
use serde::{Deserialize, Serialize};
use std::sync::Arc;
use utoipa::ToSchema;

/// Maximum number of compared studies.
const MAX_STUDIES: usize = 20;
/// Maximum number on a page, whatever its `limit`: a request waits for the posterior of each.
const MAX_ON_A_PAGE: u32 = 5;

/// Studies to compare.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ComparisonQuery {
    ids: DifferentStudies,
}

/// Comma-separated identifiers of several different studies.
#[derive(Debug, Deserialize)]
#[serde(try_from = "String")]
struct DifferentStudies(Vec<Named<StudyId>>);

impl TryFrom<String> for DifferentStudies {
    type Error = String;

    fn try_from(ids: String) -> Result<Self, String> {
        let refused = || format!("2 to {MAX_STUDIES} comma-separated identifiers of different studies");
        let ids: Result<Vec<Named<StudyId>>, _> =
            ids.split(',').map(str::trim).filter(|id| !id.is_empty()).map(str::parse).collect();
        let ids = ids.map_err(|_| refused())?;
        let is_repeated = |(place, id): (usize, &Named<StudyId>)| ids[..place].contains(id);
        if !(2..=MAX_STUDIES).contains(&ids.len()) || ids.iter().enumerate().any(is_repeated) {
            return Err(refused());
        }
        Ok(Self(ids))
    }
}

/// Study in a comparison.
#[derive(Debug, Serialize, ToSchema)]
pub(super) struct StudyComparison {
    /// Identifier of the study.
    id: StudyId,
    /// Name of the study.
    name: String,
    /// Whether gaits are computed with muscles.
    muscles: bool,
    /// Seed of the random draws of the study.
    seed: u64,
    /// Reference gait for Gait RMSE.
    reference_gait_id: ReferenceGaitId,
    /// State of the study.
    state: StudyState,
    /// Numbers of trials by state.
    trials: TrialCounts,
    /// Number of the recommended trial. Null if there is no recommendation.
    best_trial: Option<u32>,
    /// Action of the recommended trial. Null if there is no recommendation.
    #[schema(value_type = Option<study_plan_schemas::BoundsSchema>)]
    best_action: Option<TunedBounds>,
    /// Gait RMSE of the recommended trial, rad. Null if there is no recommendation, or if the script that evaluated the
    /// trial did not report it. Null in every row if the compared studies have different reference gaits, because
    /// values against different reference gaits cannot be compared.
    best_gait_rmse_rad: Option<f64>,
    /// Cost of transport of the recommended trial. Null if there is no recommendation, or if the script that evaluated
    /// the trial did not report it.
    best_cost_of_transport: Option<f64>,
    /// Total time of all solves, s.
    solve_seconds: f64,
}

/// List studies for comparison
///
/// Properties and results of several studies. A page has at most 5 studies, because each needs a posterior. Sorted as in
/// `ids`.
#[utoipa::path(
    get,
    path = "/study-comparison",
    operation_id = "list_compared_studies",
    tag = "studies",
    params(("ids" = String, Query, description = "2 to 20 comma-separated identifiers of different studies")),
    responses((status = 200, description = "A page", body = Page<StudyComparison>), (status = 404, description = "A study does not exist"), (status = 409, description = "The subject of a study withdrew consent")),
    security(("token" = ["read"]), ("session" = ["read"])),
)]
pub(super) async fn get(
    authorized: Authorized<Read>,
    State(mut app): State<AppState>,
    paging: Paging<u32, ComparisonQuery>,
) -> Result<Json<Page<StudyComparison>>, Refusal> {
    let paging = paging.at_most(MAX_ON_A_PAGE);
    // The place in `ids` identifies a study: a cursor belongs to one value of `ids`.
    let mut compared: Vec<(u32, Study)> = Vec::new();
    for (place, id) in (0..).zip(&paging.filter.ids.0) {
        let mut reader = app.read().await?;
        let id = id.accessible(&mut reader, authorized.caller.reach()).await?;
        consents::may_be_shown(&mut reader, id).await?;
        compared.push((place, studies::get(&mut reader, id).await?));
    }
    let reference = |(_, study): &(u32, Study)| study.plan.reference_gait_id;
    let one_reference = compared.windows(2).all(|pair| reference(&pair[0]) == reference(&pair[1]));
    let (asked, next) = paging.cut(compared, |(place, _)| *place)?.into_parts();
    let mut rows = Vec::with_capacity(asked.len());
    for (_, study) in asked {
        let mut row = row(&mut app, study).await?;
        row.best_gait_rmse_rad = row.best_gait_rmse_rad.filter(|_| one_reference);
        rows.push(row);
    }
    Ok(Json(Page::of_parts(rows, next)))
}

async fn row(app: &mut AppState, study: Study) -> Result<StudyComparison, Refusal> {
    let id = study.id;
    let mut reader = app.read().await?;
    let counts = trials::counts(&mut reader, id).await?;
    let snapshot = StudySnapshot::read(&mut reader, study).await?;
    drop(reader);
    let analyses = Arc::clone(&app.analyses);
    let rank = move |pool: &OnPool| {
        let best = ranking_to_show(pool, &snapshot, &analyses);
        (snapshot, best)
    };
    let (snapshot, best) = app.compute(rank).await?;
    let best = best.map_err(Error::Learner)?.first().and_then(|id| snapshot.trial(*id));
    Ok(StudyComparison {
        id,
        name: snapshot.study.plan.name.clone(),
        muscles: snapshot.study.plan.muscles,
        seed: snapshot.study.plan.seed,
        reference_gait_id: snapshot.study.plan.reference_gait_id,
        state: snapshot.study.state,
        trials: counts.into(),
        best_trial: best.map(|trial| trial.number),
        best_action: best.map(|trial| trial.action),
        best_gait_rmse_rad: best.and_then(|trial| trial.gait_rmse_rad),
        best_cost_of_transport: best.and_then(|trial| trial.cost_of_transport),
        // `sum` of nothing is -0.0.
        solve_seconds: snapshot.trials.iter().filter_map(|trial| trial.seconds_total).fold(0.0, |all, own| all + own),
    })
}
