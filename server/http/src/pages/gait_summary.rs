//! The first values on the page of a gait: spatiotemporal parameters, and the distances from reference gaits.

use crate::format;
use gait_optimizer::reference_comparison::{ReferenceComparison, compare_with_references};
use gait_optimizer::spatiotemporal::Spatiotemporal;
use gait_optimizer::{Gait, ModelError, ReferenceGait};

/// The tables.
pub(super) struct GaitSummary {
    /// Parameter, left leg, right leg, and ratio of left to right.
    pub(super) legs: Vec<[String; 4]>,
    /// Parameter and value of the whole stride.
    pub(super) stride: Vec<(&'static str, String)>,
    pub(super) references: Vec<ReferenceRow>,
}

/// The distances from a reference gait.
pub(super) struct ReferenceRow {
    pub(super) name: String,
    /// Whether the study has this reference gait.
    pub(super) of_the_study: bool,
    pub(super) rmse: String,
    /// Gait RMSE after the best shift in time, and the shift.
    pub(super) aligned: String,
    /// Torso, left hip, left knee, left ankle, right hip, degrees.
    pub(super) parts: Vec<String>,
}

impl GaitSummary {
    pub(super) fn new(gait: &Gait, reference: &ReferenceGait) -> Result<Self, ModelError> {
        let found = Spatiotemporal::of(gait)?;
        let row = |name: &str, left: f64, right: f64, digits: usize| {
            [name.to_owned(), format!("{left:.digits$}"), format!("{right:.digits$}"), format!("{:.2}", left / right)]
        };
        let (left, right) = (found.left, found.right);
        Ok(Self {
            legs: vec![
                row("Step length, m", left.step_length_m, right.step_length_m, 3),
                row("Step time, s", left.step_time_s, right.step_time_s, 3),
                row("Stance, % of the stride", left.stance_percent, right.stance_percent, 1),
            ],
            stride: vec![
                ("Walking speed, m/s", format!("{:.2}", found.speed_m_s)),
                ("Cadence, steps/min", format!("{:.0}", found.cadence_per_min)),
                ("Stride length, m", format!("{:.3}", found.stride_length_m)),
                ("Stride time, s", format!("{:.3}", found.stride_time_s)),
                ("Double support, % of the stride", format!("{:.1}", found.double_support_percent)),
            ],
            references: compare_with_references(gait, reference)?.into_iter().map(ReferenceRow::new).collect(),
        })
    }
}

impl ReferenceRow {
    fn new(comparison: ReferenceComparison) -> Self {
        Self {
            of_the_study: comparison.of_the_problem,
            rmse: format::decimal(Some(comparison.gait_rmse_rad)),
            aligned: format!(
                "{} ({} %)",
                format::decimal(Some(comparison.aligned_gait_rmse_rad)),
                format::number(comparison.shift_percent)
            ),
            parts: comparison.parts_deg.iter().map(|part| format!("{part:.1}")).collect(),
            name: comparison.reference_gait,
        }
    }
}
