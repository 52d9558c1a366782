//! REST: the motion of a gait, for animations.

use crate::AppState;
use crate::authorization::Authorized;
use crate::problem_details::Refusal;
use crate::resources::stick_figures::StickFigure;
use crate::visible::Visible;
use axum::Json;
use axum::extract::State;
use gait_optimizer::Gait;
use gait_optimizer::gait::stick_figure::stick_figures;
use gaitwright_charts::gait_series::points;
use gaitwright_service::access::Read;
use gaitwright_service::error::Error;
use gaitwright_store::{TrialId, gaits};
use serde::Serialize;
use utoipa::ToSchema;

/// Motion of a gait over one stride from right heel strike.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct GaitMotion {
    /// Stride time, s.
    stride_time_s: f64,
    /// Stride length, m.
    stride_length_m: f64,
    /// Nodes in order of time. Interpolate linearly between them.
    frames: Vec<MotionFrame>,
}

/// Node of a motion.
#[derive(Debug, Serialize, ToSchema)]
struct MotionFrame {
    #[serde(flatten)]
    figure: StickFigure,
    /// Name of the domain.
    domain: String,
    /// Ground forces on left heel, left toe, right heel and right toe, forward and up, N.
    #[schema(value_type = Vec<Vec<f64>>)]
    forces_n: [[f64; 2]; 4],
    /// Activations of the muscles HAM_L, GLU_L, HFL_L, GAS_L, VAS_L, SOL_L, TA_L, HAM_R, GLU_R, HFL_R. Absent
    /// without muscles.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(value_type = Vec<f64>, required = false)]
    activations: Option<[f64; 10]>,
}

/// Get the motion of a gait
///
/// Stick figures over one stride, for an animation.
#[utoipa::path(
    get,
    path = "/trials/{id}/motion",
    operation_id = "get_stick_figures",
    tag = "trials",
    params(("id" = TrialId, Path, description = "Identifier of the trial")),
    responses((status = 200, description = "Motion", body = GaitMotion), (status = 409, description = "The subject withdrew consent")),
    security(("token" = ["read"]), ("session" = ["read"])),
)]
pub(super) async fn get(
    _: Authorized<Read>,
    State(mut app): State<AppState>,
    Visible(id, _): Visible<TrialId, Read>,
) -> Result<Json<GaitMotion>, Refusal> {
    let gait = gaits::get(&mut *app.read().await?, id).await?;
    Ok(Json(app.compute(move |pool| motion(&gait.unpack(pool)?)).await??))
}

pub(crate) fn motion(gait: &Gait) -> Result<GaitMotion, Error> {
    let frames = stick_figures(gait)?
        .into_iter()
        .zip(points(gait))
        .map(|(figure, point)| {
            let f = point.forces;
            let forces_n = [[f[0], f[1]], [f[2], f[3]], [f[4], f[5]], [f[6], f[7]]];
            MotionFrame {
                figure: figure.into(),
                domain: point.domain.to_owned(),
                forces_n,
                activations: point.activation.copied(),
            }
        })
        .collect();
    Ok(GaitMotion { stride_time_s: gait.stride_time_s, stride_length_m: gait.stride_length_m, frames })
}
