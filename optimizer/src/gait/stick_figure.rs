//! Joint positions, for drawings of a gait.

use super::Gait;
use crate::body::{FootPoint, PointState, Side, WalkerModel};
use crate::model_error::ModelError;
use serde::{Deserialize, Serialize};

/// Joint positions (x forward, z up, m) at one instant.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct StickFigure {
    /// Time from the start of the stride, s.
    pub time_s: f64,
    /// Hip.
    pub hip: [f64; 2],
    /// Shoulder.
    pub shoulder: [f64; 2],
    /// Left (intact) leg.
    pub left: LegPoints,
    /// Right (prosthetic) leg.
    pub right: LegPoints,
}

/// Joint positions of one leg, m.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct LegPoints {
    /// Knee.
    pub knee: [f64; 2],
    /// Ankle.
    pub ankle: [f64; 2],
    /// Heel.
    pub heel: [f64; 2],
    /// Toe.
    pub toe: [f64; 2],
}

/// Stick figures of a gait at its nodes, in order of time.
///
/// # Errors
/// [`ModelError`] if subject or device of the gait is invalid.
pub fn stick_figures(gait: &Gait) -> Result<Vec<StickFigure>, ModelError> {
    let model = WalkerModel::new(&gait.subject, &gait.device)?;
    Ok(gait
        .domains
        .iter()
        .flat_map(|domain| domain.time_s.iter().zip(&domain.q))
        .map(|(&time_s, q)| stick_figure(&model, time_s, q))
        .collect())
}

/// The stick figure of one instant.
pub fn stick_figure(model: &WalkerModel, time_s: f64, q: &[f64; 9]) -> StickFigure {
    let state = PointState::new(q, &[0.0; 9], &[0.0; 9]);
    let leg = |side: Side| {
        let heel = model.contact_point(FootPoint::Heel, side);
        let mut position = state.base;
        let mut joints = [[0.0; 2]; 2];
        for k in 0..2 {
            let offset = state.rotated(heel.first_link + k, &heel.vectors[k]);
            position = [position[0] + offset[0], position[1] + offset[1]];
            joints[k] = position;
        }
        LegPoints {
            knee: joints[0],
            ankle: joints[1],
            heel: state.contact_position(&heel),
            toe: state.contact_position(&model.contact_point(FootPoint::Toe, side)),
        }
    };
    let torso = state.rotated(crate::body::coordinates::TORSO, &[0.0, model.torso_length_m]);
    StickFigure {
        time_s,
        hip: state.base,
        shoulder: [state.base[0] + torso[0], state.base[1] + torso[1]],
        left: leg(Side::Left),
        right: leg(Side::Right),
    }
}
