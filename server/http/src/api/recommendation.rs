//! REST: the recommendation of a study.

use crate::AppState;
use crate::authorization::Authorized;
use crate::csv_response::csv_response;
use crate::problem_details::Refusal;
use crate::resources::execution_reports::ExecutionReport;
use crate::visible::Visible;
use axum::Json;
use axum::extract::State;
use axum::response::Response;
use gait_optimizer::TunedBounds;
use gaitwright_charts::csv_table::{CsvTable, cells};
use gaitwright_compute::OnPool;
use gaitwright_service::access::Read;
use gaitwright_service::error::Error;
use gaitwright_service::studies::actions_with_known_gait::never_active;
use gaitwright_service::studies::certified_best::{self, CertificateState};
use gaitwright_service::studies::execution;
use gaitwright_service::studies::recommended_trial::ranking_to_show;
use gaitwright_service::studies::snapshot::StudySnapshot;
use gaitwright_service::studies::study_plan_schemas;
use gaitwright_service::studies::walkable::Grounds;
use gaitwright_service::studies::walkable::WalkableGait;
use gaitwright_store::trials::Trial;
use gaitwright_store::{StudyId, TrialId, studies};
use serde::Serialize;
use std::sync::Arc;
use utoipa::ToSchema;

/// Best action of a study.
#[derive(Debug, Serialize, ToSchema)]
pub(super) struct Recommendation {
    /// Identifier of the study.
    study_id: StudyId,
    /// Name of the study.
    study: String,
    #[serde(flatten)]
    best: Recommended,
    /// State of the certificate of its gait.
    certificate: CertificateState,
    /// Reasons if the certificate failed.
    failures: Vec<String>,
    /// If the certificate failed, the best action whose gait passed certification. Null if there is none.
    passing: Option<Recommended>,
    /// Tuned bounds that have not been active in any gait of the study so far.
    never_active: Vec<String>,
    /// The newest execution report of its gait. Null if there is none.
    execution_report: Option<ExecutionReport>,
    /// Whether gaits of the study are being certified. If so, the recommendation may change.
    certifying: bool,
}

/// Recommended action.
#[derive(Debug, Serialize, ToSchema)]
struct Recommended {
    /// Trial of the action.
    trial_id: TrialId,
    /// Number of the trial.
    number: u32,
    /// The action: the values of all bounds, tuned or fixed.
    #[schema(value_type = study_plan_schemas::BoundsSchema)]
    bounds: TunedBounds,
    /// Gait RMSE of the trial, rad. Null if the script that evaluated the trial did not report it.
    gait_rmse_rad: Option<f64>,
    /// Cost of transport of the trial. Null if the script that evaluated the trial did not report it.
    cost_of_transport: Option<f64>,
    /// Mean strides of the simulated walks on which the result of the trial depends. Null if it depends on none.
    mean_strides: Option<f64>,
}

impl Recommended {
    fn of(gait: &WalkableGait, trial: &Trial) -> Self {
        Self {
            trial_id: gait.trial(),
            number: gait.number(),
            bounds: trial.action,
            gait_rmse_rad: trial.gait_rmse_rad,
            cost_of_transport: trial.cost_of_transport,
            mean_strides: trial.mean_strides,
        }
    }
}

/// Get the recommendation of a study
///
/// Of the actions tried, the one with the highest utility.
#[utoipa::path(
    get,
    path = "/studies/{id}/recommendation",
    operation_id = "get_recommendation",
    tag = "studies",
    params(("id" = StudyId, Path, description = "Identifier of the study")),
    responses(
        (status = 200, description = "Best action", body = Recommendation),
        (status = 409, description = "No recommendation yet")
    ),
    security(("token" = ["read"]), ("session" = ["read"])),
)]
pub(super) async fn of_study(
    _: Authorized<Read>,
    State(mut app): State<AppState>,
    Visible(id, _): Visible<StudyId, Read>,
) -> Result<Json<Recommendation>, Refusal> {
    Ok(Json(read(&mut app, id).await?))
}

/// Download the recommended bounds as CSV
///
/// Each bound with its side (`at least` or `at most`), its unit and what it limits.
#[utoipa::path(
    get,
    path = "/studies/{id}/recommendation.csv",
    operation_id = "get_recommendation_csv",
    tag = "studies",
    params(("id" = StudyId, Path, description = "Identifier of the study")),
    responses(
        (status = 200, description = "Recommended bounds", body = String, content_type = "text/csv"),
        (status = 409, description = "No recommendation yet")
    ),
    security(("token" = ["read"]), ("session" = ["read"])),
)]
pub(super) async fn of_study_csv(
    _: Authorized<Read>,
    State(mut app): State<AppState>,
    Visible(id, _): Visible<StudyId, Read>,
) -> Result<Response, Refusal> {
    let Recommendation { best, certificate, .. } = read(&mut app, id).await?;
    let name = format!("bounds-trial-{}.csv", best.number);
    csv_response(&mut app, &name, move || written(&best.bounds, certificate)).await
}

fn written(bounds: &TunedBounds, certificate: CertificateState) -> CsvTable {
    let mut table = CsvTable::new(["bound", "side", "value", "unit", "limits", "certificate_of_the_gait"]);
    for (place, value) in bounds.to_array().into_iter().enumerate() {
        let (name, unit) = (TunedBounds::NAMES[place], TunedBounds::UNITS[place]);
        let side = if TunedBounds::IS_LOWER[place] { "at least" } else { "at most" };
        table.row(cells![name, side, value, unit, TunedBounds::QUANTITIES[place], certificate.as_str()]);
    }
    table
}

async fn read(app: &mut AppState, id: StudyId) -> Result<Recommendation, Refusal> {
    let mut reader = app.read().await?;
    let study = studies::get(&mut reader, id).await?;
    let snapshot = StudySnapshot::read(&mut reader, study).await?;
    drop(reader);
    let analyses = Arc::clone(&app.analyses);
    let rank = move |pool: &OnPool| {
        let unanswered = snapshot.waits_for_first_answer();
        let ranking = if unanswered { Ok(Vec::new()) } else { ranking_to_show(pool, &snapshot, &analyses) };
        (snapshot, ranking)
    };
    let (snapshot, ranking) = app.compute(rank).await?;
    let ranking = ranking.map_err(Error::Learner)?;
    let best = *ranking.first().ok_or_else(|| {
        Error::conflict(
            "The study has no recommendation yet, because it has no preference, or no gait without a safety report.",
        )
    })?;
    let mut reader = app.read().await?;
    let without_certificate = certified_best::of_ranking(&mut reader, &ranking).await?.without_certificate;
    let certifying = without_certificate.is_some_and(|next| app.scheduler.certify_best_of(id, next));
    // Read last, so that it includes every certificate if none is being made.
    let grounds = Grounds::read(&mut reader, id).await?;
    let walkable = ranking.iter().enumerate().find_map(|(place, id)| {
        let trial = snapshot.trial(*id)?;
        Some((place, trial, grounds.admit(trial).ok()?))
    });
    let Some((place, trial, gait)) = walkable else {
        let why = if certifying {
            "The study has no recommendation yet, because its best gait is being certified. Try again later.".to_owned()
        } else {
            format!(
                "The study has no recommendation, because none of its gaits is walkable. If its best gait has no certificate, request one with POST /api/v1/trials/{best}/certificate."
            )
        };
        return Err(Error::conflict(why).into());
    };
    let certification = certified_best::of_ranking(&mut reader, &ranking[place..]).await?;
    let execution_report = execution::newest(&mut reader, trial.id).await?.map(|kept| kept.reported.report);
    drop(reader);
    Ok(Recommendation {
        study_id: id,
        study: snapshot.study.plan.name.clone(),
        best: Recommended::of(&gait, trial),
        certificate: certification.certificate,
        failures: certification.failures,
        never_active: never_active(&snapshot),
        execution_report: execution_report.map(Into::into),
        certifying,
        passing: certification.passing.and_then(|id| {
            let trial = snapshot.trial(id)?;
            Some(Recommended::of(&grounds.admit(trial).ok()?, trial))
        }),
    })
}
