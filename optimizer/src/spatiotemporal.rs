//! Spatiotemporal parameters of a gait, as a gait laboratory reports them.

use crate::gait::Gait;
use crate::subject::ModelError;
use crate::walking::{CYCLE, DomainKind};
use serde::Serialize;

/// Parameters of one leg.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct LegParameters {
    /// Length of the step that ends with the heel strike of this leg, m.
    pub step_length_m: f64,
    /// Time from the heel strike of the other leg to that of this leg, s.
    pub step_time_s: f64,
    /// Share of the stride during which the foot is on the ground, percent.
    pub stance_percent: f64,
}

/// Spatiotemporal parameters of a stride.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Spatiotemporal {
    /// Mean walking speed, m/s.
    pub speed_m_s: f64,
    /// Number of steps per minute.
    pub cadence_per_min: f64,
    /// Stride length, m.
    pub stride_length_m: f64,
    /// Stride time, s.
    pub stride_time_s: f64,
    /// Share of the stride during which both feet are on the ground, percent.
    pub double_support_percent: f64,
    /// The left leg.
    pub left: LegParameters,
    /// The right leg, with the prosthesis.
    pub right: LegParameters,
}

impl Spatiotemporal {
    /// The parameters of a gait.
    ///
    /// # Errors
    /// [`ModelError`] if the gait is malformed.
    pub fn of(gait: &Gait) -> Result<Self, ModelError> {
        gait.validate()?;
        let duration_s = |included: &dyn Fn(usize) -> bool| -> f64 {
            (0..CYCLE.len()).filter(|d| included(*d)).map(|d| gait.domains[d].duration_s).sum()
        };
        let stride_s = gait.stride_time_s;
        let percent = |time_s: f64| 100.0 * time_s / stride_s;
        let double_support = |d: usize| matches!(CYCLE[d].kind, DomainKind::Ds2 | DomainKind::Ds3);
        // The stride begins with right heel strike, and left heel strike is in its middle. A foot leaves the ground when the
        // double support of the other stance ends.
        let half = CYCLE.len() / 2;
        let leg = |step_length_m: f64, lands_in_second_half: bool| {
            let own_half = |d: usize| (d >= half) == lands_in_second_half;
            LegParameters {
                step_length_m,
                step_time_s: duration_s(&|d| !own_half(d)),
                stance_percent: percent(duration_s(&|d| own_half(d) || double_support(d))),
            }
        };
        Ok(Self {
            speed_m_s: gait.speed_m_s,
            cadence_per_min: 2.0 * 60.0 / stride_s,
            stride_length_m: gait.stride_length_m,
            stride_time_s: stride_s,
            double_support_percent: percent(duration_s(&double_support)),
            left: leg(gait.right_step_length_m, true),
            right: leg(gait.stride_length_m - gait.right_step_length_m, false),
        })
    }
}
