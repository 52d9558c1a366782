//! REST: sensitivities of gaits with respect to the tuned bounds.

use crate::AppState;
use crate::authorization::Authorized;
use crate::problem_details::Refusal;
use crate::resources::sensitivities::{ActiveConstraint, ResultDerivatives};
use crate::visible::Visible;
use axum::Json;
use axum::extract::State;
use gait_optimizer::DisplayAngleUnit;
use gait_optimizer::sensitivity::BoundSensitivity;
use gaitwright_service::access::Read;
use gaitwright_service::error::Error;
use gaitwright_service::studies::sensitivities::{self, BoundStep, StudySensitivities};
use gaitwright_store::{TrialId, trials};
use serde::Serialize;
use utoipa::ToSchema;

/// Sensitivities of a gait with respect to the tuned bounds.
#[derive(Debug, Serialize, ToSchema)]
pub(super) struct TrialSensitivities {
    /// Trial of the gait.
    trial_id: TrialId,
    /// The sensitivities in sentences.
    sentences: Vec<String>,
    /// Mechanical cost of transport of the gait.
    cost_of_transport: f64,
    /// One entry for each bound that can be tuned.
    bounds: Vec<SensitivityToBound>,
}

/// Sensitivity with respect to one tuned bound. Derivatives are per unit of the bound.
#[derive(Debug, Serialize, ToSchema)]
struct SensitivityToBound {
    /// Name of the bound.
    bound: &'static str,
    /// Value of the bound, in its unit.
    value: f64,
    /// The active constraints that contain the bound. Empty if small changes of the bound change nothing.
    active: Vec<ActiveConstraint>,
    /// Derivatives of the results of the gait.
    derivatives: ResultDerivatives,
    /// Lowest and highest value of the bound, in its unit: in between, the active constraints stay the same, to first
    /// order. An end is null if there is no limit in that direction.
    #[schema(value_type = Vec<Option<f64>>, min_items = 2, max_items = 2)]
    interval: (Option<f64>, Option<f64>),
    /// Whether a constraint is about to become active or inactive, in which case the derivatives on the two sides
    /// differ.
    is_weakly_active: bool,
    /// One step of the bound in the search space, and its effect. Null if the study does not tune the bound.
    grid_step: Option<GridStep>,
}

/// One step of a bound in the search space, and the first-order changes in the results.
#[derive(Debug, Serialize, ToSchema)]
struct GridStep {
    /// The next stricter value of the search space, in the unit of the bound, or the next looser one if the bound is
    /// already at its strictest value.
    to: f64,
    /// Change in the mechanical cost of transport.
    cost_of_transport: f64,
    /// Change in Gait RMSE, rad.
    gait_rmse_rad: f64,
    /// Whether the same constraints stay active up to this value, to first order.
    keeps_active: bool,
}

impl SensitivityToBound {
    fn new(found: BoundSensitivity, step: Option<BoundStep>) -> Self {
        let BoundSensitivity { bound, value, active, derivatives, interval, is_weakly_active } = found;
        let grid_step = step.map(|BoundStep { to, cost_of_transport, gait_rmse_rad, keeps_active }| GridStep {
            to,
            cost_of_transport,
            gait_rmse_rad,
            keeps_active,
        });
        let active = active.into_iter().map(Into::into).collect();
        Self { bound, value, active, derivatives: derivatives.into(), interval, is_weakly_active, grid_step }
    }
}

/// Get the sensitivities of a trial
///
/// How the results of a gait change, to first order, with each tuned bound. Computed on request from the stored
/// solution, for meshes of up to 80 intervals (the sum of `gait_settings.mesh`).
#[utoipa::path(
    get,
    path = "/trials/{id}/sensitivities",
    operation_id = "get_sensitivities",
    tag = "trials",
    params(("id" = TrialId, Path, description = "Identifier of the trial")),
    responses(
        (status = 200, description = "Sensitivities", body = TrialSensitivities),
        (status = 409, description = "The gait has no sensitivities, or the subject withdrew consent")
    ),
    security(("token" = ["read"]), ("session" = ["read"])),
)]
pub(super) async fn get(
    _: Authorized<Read>,
    State(mut app): State<AppState>,
    Visible(id, _): Visible<TrialId, Read>,
) -> Result<Json<TrialSensitivities>, Refusal> {
    let mut reader = app.read().await?;
    let trial = trials::get(&mut reader, id).await?;
    let solution = sensitivities::solution(&mut reader, &trial).await?;
    drop(reader);
    let computed = app.compute(move |pool| solution.sensitivities(pool)).await.map_err(Error::from)?;
    let StudySensitivities { found, steps } = computed?;
    let (sentences, cost_of_transport) = (found.sentences(DisplayAngleUnit::Radian), found.cost_of_transport);
    let bounds = found.bounds.into_iter().zip(steps).map(|(bound, step)| SensitivityToBound::new(bound, step));
    Ok(Json(TrialSensitivities { trial_id: id, sentences, cost_of_transport, bounds: bounds.collect() }))
}
