//! What a study recommends.

use crate::AppState;
use crate::csv_answer::csv_answer;
use crate::may::May;
use crate::problem::Refusal;
use crate::shown::Shown;
use axum::Json;
use axum::extract::State;
use axum::response::Response;
use gait_optimizer::TunedBounds;
use gaitwright_charts::csv_table::{CsvTable, cells};
use gaitwright_compute::OnPool;
use gaitwright_service::access::Read;
use gaitwright_service::error::Error;
use gaitwright_service::studies::choice::ranking_to_show;
use gaitwright_service::studies::recommended::{self, CertificateState};
use gaitwright_service::studies::snapshot::StudySnapshot;
use gaitwright_service::studies::walkable::Grounds;
use gaitwright_service::studies::walkable::WalkableGait;
use gaitwright_store::trials::Trial;
use gaitwright_store::{StudyId, TrialId, schema, studies};
use serde::Serialize;
use std::sync::Arc;
use utoipa::ToSchema;

/// The best action of a study so far whose gait is certified.
#[derive(Debug, Serialize, ToSchema)]
pub(super) struct Recommendation {
    study_id: StudyId,
    study: String,
    #[serde(flatten)]
    best: Recommended,
    /// What the certificate of its gait says.
    certificate: CertificateState,
    /// Why that failed, in words.
    objections: Vec<String>,
    /// Where it failed: the best action whose gait is known to pass.
    passing: Option<Recommended>,
    /// A better gait, or one that passes, may follow: gaits of the study are being certified. Ask again.
    certifying: bool,
}

/// An action that a trial tried.
#[derive(Debug, Serialize, ToSchema)]
struct Recommended {
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

impl Recommended {
    fn of(gait: &WalkableGait, trial: &Trial) -> Self {
        Self {
            trial_id: gait.trial(),
            number: gait.number(),
            bounds: trial.action,
            gait_rmse_rad: trial.gait_rmse_rad,
            cost_of_transport: trial.cost_of_transport,
        }
    }
}

/// `GET /studies/{id}/recommendation`: the visited action that the learner believes to be the best.
#[utoipa::path(
    get,
    path = "/studies/{id}/recommendation",
    operation_id = "get_recommendation",
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
    State(mut app): State<AppState>,
    Shown(id, _): Shown<StudyId, Read>,
) -> Result<Json<Recommendation>, Refusal> {
    Ok(Json(read(&mut app, id).await?))
}

/// `GET /studies/{id}/recommendation.csv`: the bounds alone, each with what it limits and its unit.
#[utoipa::path(
    get,
    path = "/studies/{id}/recommendation.csv",
    operation_id = "get_recommendation_csv",
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
    State(mut app): State<AppState>,
    Shown(id, _): Shown<StudyId, Read>,
) -> Result<Response, Refusal> {
    let Recommendation { best, certificate, .. } = read(&mut app, id).await?;
    let name = format!("bounds-trial-{}.csv", best.number);
    csv_answer(&mut app, &name, move || written(&best.bounds, certificate)).await
}

fn written(bounds: &TunedBounds, certificate: CertificateState) -> CsvTable {
    let bounds = TunedBounds::NAMES.iter().zip(bounds.to_array()).zip(TunedBounds::MEANINGS);
    let mut table = CsvTable::new(["bound", "value", "unit", "limits", "certificate_of_the_gait"]);
    for ((name, value), meaning) in bounds {
        let (limited, unit) = meaning.rsplit_once(", ").unwrap_or((meaning, ""));
        table.row(cells![*name, value, unit, limited, certificate.as_str()]);
    }
    table
}

async fn read(app: &mut AppState, id: StudyId) -> Result<Recommendation, Refusal> {
    let mut reader = app.read().await?;
    let study = studies::get(&mut reader, id).await?;
    let snapshot = StudySnapshot::read(&mut reader, study).await?;
    drop(reader);
    let beliefs = Arc::clone(&app.beliefs);
    let rank = move |pool: &OnPool| {
        let unanswered = snapshot.waits_for_first_answer();
        let ranking = if unanswered { Ok(Vec::new()) } else { ranking_to_show(pool, &snapshot, &beliefs) };
        (snapshot, ranking)
    };
    let (snapshot, ranking) = app.compute(rank).await?;
    let ranking = ranking.map_err(Error::Learner)?;
    let best = *ranking.first().ok_or_else(|| {
        Error::conflict("nothing is recommended yet: there is no gait, or no answer says which is better")
    })?;
    let mut reader = app.read().await?;
    let without_certificate = recommended::judged(&mut reader, &ranking).await?.without_certificate;
    let certifying = without_certificate.is_some_and(|next| app.scheduler.certify_best_of(id, next));
    // Read after that: once nothing is being certified, every certificate is known here.
    let grounds = Grounds::read(&mut reader, id).await?;
    let walkable = ranking.iter().enumerate().find_map(|(place, id)| {
        let trial = snapshot.trial(*id)?;
        Some((place, trial, grounds.admit(trial).ok()?))
    });
    let Some((place, trial, gait)) = walkable else {
        let why = if certifying {
            "nothing is recommended yet: the best gait is being certified; ask again".to_owned()
        } else {
            format!("nothing is recommended: the best gait has no certificate; POST /api/v1/trials/{best}/certificate")
        };
        return Err(Error::conflict(why).into());
    };
    let judged = recommended::judged(&mut reader, &ranking[place..]).await?;
    drop(reader);
    Ok(Recommendation {
        study_id: id,
        study: snapshot.study.plan.name.clone(),
        best: Recommended::of(&gait, trial),
        certificate: judged.verdict,
        objections: judged.objections,
        certifying,
        passing: judged.passing.and_then(|id| {
            let trial = snapshot.trial(id)?;
            Some(Recommended::of(&grounds.admit(trial).ok()?, trial))
        }),
    })
}
