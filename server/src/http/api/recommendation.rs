//! What a study recommends.

use crate::access::Read;
use crate::error::Error;
use crate::http::AppState;
use crate::http::may::May;
use crate::http::shown::Shown;
use crate::store::{StudyId, TrialId, schema, studies};
use crate::studies::choice::best_to_show;
use crate::studies::standing::Standing;
use axum::Json;
use axum::extract::State;
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
    Ok(Json(Recommendation {
        study_id: id,
        study: standing.study.plan.name.clone(),
        trial_id: trial.id,
        number: trial.number,
        bounds: trial.action,
        gait_rmse_rad: trial.gait_rmse_rad,
        cost_of_transport: trial.cost_of_transport,
    }))
}
