//! What a study recommends.

use crate::access::Read;
use crate::error::Error;
use crate::http::AppState;
use crate::http::may::May;
use crate::http::negotiate::csv_answer;
use crate::http::shown::Shown;
use crate::store::{StudyId, TrialId, schema, studies};
use crate::studies::choice::best_to_show;
use crate::studies::standing::Standing;
use axum::Json;
use axum::extract::State;
use axum::response::Response;
use gait_optimizer::TunedBounds;
use serde::Serialize;
use utoipa::ToSchema;

/// The best action of a study so far.
#[derive(Debug, Serialize, ToSchema)]
pub(super) struct Recommendation {
    study_id: StudyId,
    study: String,
    /// The trial that tried it.
    trial_id: TrialId,
    /// Its number.
    number: u32,
    /// The bounds.
    #[schema(value_type = schema::Bounds)]
    bounds: TunedBounds,
    /// Its Gait RMSE, rad.
    gait_rmse_rad: Option<f64>,
    /// Its cost of transport.
    cost_of_transport: Option<f64>,
}

/// `GET /studies/{id}/recommendation`: the visited action that the learner believes to be the best.
#[utoipa::path(
    get,
    path = "/studies/{id}/recommendation",
    tag = "studies",
    params(("id" = StudyId, Path, description = "The study")),
    responses(
        (status = 200, description = "The best action so far", body = Recommendation),
        (status = 409, description = "There is none yet")
    ),
    security(("token" = ["read"]), ("session" = ["read"])),
)]
pub(super) async fn of_study(
    _: May<Read>,
    State(app): State<AppState>,
    Shown(id): Shown<StudyId>,
) -> Result<Json<Recommendation>, Error> {
    Ok(Json(read(&app, id).await?))
}

/// `GET /studies/{id}/recommendation.csv`: the bounds alone, each with what it limits and its unit.
#[utoipa::path(
    get,
    path = "/studies/{id}/recommendation.csv",
    tag = "studies",
    params(("id" = StudyId, Path, description = "The study")),
    responses(
        (status = 200, description = "The bounds of the best action so far", body = String, content_type = "text/csv"),
        (status = 409, description = "There is none yet")
    ),
    security(("token" = ["read"]), ("session" = ["read"])),
)]
pub(super) async fn of_study_csv(
    _: May<Read>,
    State(app): State<AppState>,
    Shown(id): Shown<StudyId>,
) -> Result<Response, Error> {
    let best = read(&app, id).await?;
    let bounds = TunedBounds::NAMES.iter().zip(best.bounds.to_array()).zip(TunedBounds::MEANINGS);
    let rows = bounds
        .map(|((name, value), meaning)| {
            let (limited, unit) = meaning.rsplit_once(", ").unwrap_or((meaning, ""));
            vec![(*name).to_owned(), value.to_string(), unit.to_owned(), limited.to_owned()]
        })
        .collect();
    csv_answer(&format!("bounds-trial-{}.csv", best.number), &["bound", "value", "unit", "limits"], rows)
}

async fn read(app: &AppState, id: StudyId) -> Result<Recommendation, Error> {
    let mut reader = app.read().await?;
    let study = studies::get(&mut reader, id).await?;
    let standing = Standing::read(&mut reader, study).await?;
    drop(reader);
    let (standing, best) = tokio::task::spawn_blocking(move || {
        let best = if standing.waits_for_first_answer() { Ok(None) } else { best_to_show(&standing) };
        (standing, best)
    })
    .await
    .map_err(|e| Error::Internal(e.to_string()))?;
    let trial = best.map_err(Error::Learner)?.and_then(|id| standing.trial(id));
    let trial =
        trial.ok_or_else(|| Error::conflict("nothing is recommended yet: no answer says which gait is better"))?;
    Ok(Recommendation {
        study_id: id,
        study: standing.study.plan.name.clone(),
        trial_id: trial.id,
        number: trial.number,
        bounds: trial.action,
        gait_rmse_rad: trial.gait_rmse_rad,
        cost_of_transport: trial.cost_of_transport,
    })
}
