//! The values that the atlas keeps of a gait.

use gait_optimizer::reference_comparison::compare_with_references;
use gait_optimizer::spatiotemporal::Spatiotemporal;
use gait_optimizer::{Gait, ModelError, ReferenceGait, SolveReport, UnchangedBound};
use serde::{Deserialize, Serialize};

/// Number of times of the stride at which the joint angles are kept.
const TIMES: usize = 10;

/// The values of a gait.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct GaitValues {
    /// Objective.
    pub objective: f64,
    /// Mechanical cost of transport, dimensionless.
    pub cost_of_transport: f64,
    /// Gait RMSE against the reference gait of the problem, rad.
    pub gait_rmse_rad: f64,
    /// Lowest Gait RMSE against a built-in reference gait other than that of the problem, rad.
    pub gait_rmse_other_rad: Option<f64>,
    /// Mean walking speed, m/s.
    pub speed_m_s: f64,
    /// Stride length, m.
    pub stride_length_m: f64,
    /// Share of the stride in double support, percent.
    pub double_support_percent: f64,
    /// Difference of the step times of the two legs, as a share of their mean.
    pub step_time_asymmetry: f64,
    /// Largest torque of either hip per body mass, N m/kg.
    pub peak_hip_torque_nm_kg: f64,
    /// Torso, hip, knee and ankle of the left leg, then of the right one, rad, at 0, 10, ..., 90 % of the stride.
    pub joint_angles_rad: Vec<[f64; 7]>,
    /// Values of each tuned bound that leave the gait as it is.
    pub unchanged_bounds: Vec<UnchangedBound>,
}

impl GaitValues {
    /// Names of [`Self::numbers`], as columns of a table. Scripts rely on them.
    pub const COLUMNS: [&'static str; 9] = [
        "objective",
        "cost_of_transport",
        "gait_rmse_rad",
        "gait_rmse_other_rad",
        "speed_m_s",
        "stride_length_m",
        "double_support_percent",
        "step_time_asymmetry",
        "peak_hip_torque_nm_kg",
    ];

    /// The values of a gait, its report and the reference gait of its problem.
    ///
    /// # Errors
    /// [`ModelError`] if the gait is malformed.
    pub fn of(report: &SolveReport, gait: &Gait, reference: &ReferenceGait) -> Result<Self, ModelError> {
        let compared = compare_with_references(gait, reference)?;
        let others = compared.iter().filter(|comparison| !comparison.of_the_problem);
        let spatiotemporal = Spatiotemporal::of(gait)?;
        let (left, right) = (spatiotemporal.left.step_time_s, spatiotemporal.right.step_time_s);
        Ok(Self {
            objective: report.objective,
            cost_of_transport: report.cost_of_transport,
            gait_rmse_rad: report.gait_rmse_rad,
            gait_rmse_other_rad: others.map(|comparison| comparison.gait_rmse_rad).min_by(f64::total_cmp),
            speed_m_s: spatiotemporal.speed_m_s,
            stride_length_m: spatiotemporal.stride_length_m,
            double_support_percent: spatiotemporal.double_support_percent,
            step_time_asymmetry: 2.0 * (left - right).abs() / (left + right),
            peak_hip_torque_nm_kg: peak_hip_torque(gait) / gait.subject.body_mass_kg,
            joint_angles_rad: joint_angles(gait),
            unchanged_bounds: report.unchanged_bounds.clone(),
        })
    }

    /// The numbers, in the order of [`Self::COLUMNS`].
    pub fn numbers(&self) -> [Option<f64>; 9] {
        [
            Some(self.objective),
            Some(self.cost_of_transport),
            Some(self.gait_rmse_rad),
            self.gait_rmse_other_rad,
            Some(self.speed_m_s),
            Some(self.stride_length_m),
            Some(self.double_support_percent),
            Some(self.step_time_asymmetry),
            Some(self.peak_hip_torque_nm_kg),
        ]
    }

    /// The bounds that cannot move without changing the gait.
    pub fn active_bounds(&self) -> Vec<&str> {
        active_bounds(&self.unchanged_bounds)
    }
}

/// The bounds that cannot move without changing the gait.
pub(super) fn active_bounds(unchanged: &[UnchangedBound]) -> Vec<&str> {
    let active = unchanged.iter().filter(|bound| bound.least.is_some() && bound.least == bound.most);
    active.map(|bound| bound.bound.as_str()).collect()
}

fn joint_angles(gait: &Gait) -> Vec<[f64; 7]> {
    let angles = |[_, _, angles @ ..]: [f64; 9]| angles;
    (0..TIMES).map(|time| angles(gait.coordinates_at(time as f64 / TIMES as f64 * gait.stride_time_s))).collect()
}

/// Largest torque of either hip at the nodes, N m.
fn peak_hip_torque(gait: &Gait) -> f64 {
    const HIPS: [usize; 2] = [0, 3];
    let torques = gait.domains.iter().flat_map(|domain| &domain.u);
    torques.flat_map(|u| HIPS.map(|hip| u[hip].abs())).fold(0.0, f64::max)
}
