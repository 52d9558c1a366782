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
use gaitwright_service::studies::snapshot::StudySnapshot;
use gaitwright_service::studies::study_plan_schemas;
use gaitwright_service::studies::trial_choice::ranking_to_show;
use gaitwright_store::studies::{self, StudyState};
use gaitwright_store::{ReferenceGaitId, StudyId, consents, trials};
use serde::{Deserialize, Serialize};
use std::sync::Arc;
use utoipa::ToSchema;

/// Maximum number of compared studies.
const MOST: usize = 20;

/// Studies to compare.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ComparisonQuery {
    ids: String,
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

/// Compare several studies
///
/// Results keep the order of `ids`.
#[utoipa::path(
    get,
    path = "/study-comparison",
    operation_id = "list_study_comparisons",
    tag = "studies",
    params(("ids" = String, Query, description = "2 to 20 comma-separated identifiers of different studies")),
    responses((status = 200, description = "One row for each study", body = Page<StudyComparison>), (status = 404, description = "A study does not exist"), (status = 409, description = "The subject of a study withdrew consent")),
    security(("token" = ["read"]), ("session" = ["read"])),
)]
pub(super) async fn get(
    authorized: Authorized<Read>,
    State(mut app): State<AppState>,
    paging: Paging<usize, ComparisonQuery>,
) -> Result<Json<Page<StudyComparison>>, Refusal> {
    let which = &paging.filter;
    let named: Vec<&str> = which.ids.split(',').map(str::trim).filter(|id| !id.is_empty()).collect();
    if !(2..=MOST).contains(&named.len()) {
        return Err(
            Error::invalid("ids", which.ids.as_str(), &format!("2 to {MOST} comma-separated identifiers")).into()
        );
    }
    let mut rows: Vec<StudyComparison> = Vec::with_capacity(named.len());
    for id in named {
        let id: Named<StudyId> = id.parse().map_err(|_| Error::invalid("ids", id, "the identifier of a study"))?;
        let id = id.accessible(&mut *app.read().await?, authorized.caller.reach()).await?;
        if rows.iter().any(|row| row.id == id) {
            return Err(Error::invalid("ids", which.ids.as_str(), "identifiers of different studies").into());
        }
        rows.push(row(&mut app, id).await?);
    }
    if rows.windows(2).any(|pair| pair[0].reference_gait_id != pair[1].reference_gait_id) {
        for row in &mut rows {
            row.best_gait_rmse_rad = None;
        }
    }
    Ok(Json(paging.cut_by_place(rows)?))
}

async fn row(app: &mut AppState, id: StudyId) -> Result<StudyComparison, Refusal> {
    let mut reader = app.read().await?;
    let study = studies::get(&mut reader, id).await?;
    consents::may_be_shown(&mut reader, id).await?;
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
