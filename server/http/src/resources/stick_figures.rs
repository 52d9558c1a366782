//! Stick figures of gaits.

use gait_optimizer::gait::stick_figure;
use serde::Serialize;
use utoipa::ToSchema;

/// Points of the body at an instant as forward and upward coordinates, m.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct StickFigure {
    /// Time from the start of the stride, s.
    time_s: f64,
    /// Hip.
    #[schema(value_type = Vec<f64>)]
    hip: [f64; 2],
    /// Shoulder.
    #[schema(value_type = Vec<f64>)]
    shoulder: [f64; 2],
    /// Left (intact) leg.
    left: LegPoints,
    /// Right (prosthetic) leg.
    right: LegPoints,
}

impl From<stick_figure::StickFigure> for StickFigure {
    fn from(figure: stick_figure::StickFigure) -> Self {
        let stick_figure::StickFigure { time_s, hip, shoulder, left, right } = figure;
        Self { time_s, hip, shoulder, left: left.into(), right: right.into() }
    }
}

/// Points of one leg as forward and upward coordinates, m.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct LegPoints {
    /// Knee.
    #[schema(value_type = Vec<f64>)]
    knee: [f64; 2],
    /// Ankle.
    #[schema(value_type = Vec<f64>)]
    ankle: [f64; 2],
    /// Heel.
    #[schema(value_type = Vec<f64>)]
    heel: [f64; 2],
    /// Toe.
    #[schema(value_type = Vec<f64>)]
    toe: [f64; 2],
}

impl From<stick_figure::LegPoints> for LegPoints {
    fn from(points: stick_figure::LegPoints) -> Self {
        let stick_figure::LegPoints { knee, ankle, heel, toe } = points;
        Self { knee, ankle, heel, toe }
    }
}
