//! The results of a solve report that the gait determines.

use super::solve_report::SolveReport;
use crate::body::WalkerModel;
use crate::cost_of_transport::cost_of_transport;
use crate::gait::Gait;
use crate::gait_rmse::gait_rmse;
use crate::model_error::ModelError;
use crate::reference::ReferenceGait;

/// Relative tolerance between two computations of a result, which may run on different processors.
const ROUNDING: f64 = 1e-9;

/// The results of a report that follow from the gait and the reference gait.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GaitResults {
    /// Mechanical cost of transport, from absolute joint powers; dimensionless.
    pub cost_of_transport: f64,
    /// Gait RMSE, rad.
    pub gait_rmse_rad: f64,
    /// Parts of the Gait RMSE: torso, hip_L, knee_L, ankle_L, hip_R, rad.
    pub gait_rmse_parts_rad: [f64; 5],
    /// Mean walking speed, m/s.
    pub speed_m_s: f64,
    /// Stride length, m.
    pub stride_length_m: f64,
    /// Durations of the eight domains, s.
    pub durations_s: [f64; 8],
    /// v_hip of the four sequences of domains without impact, m/s.
    pub vhip_m_s: [f64; 4],
}

impl GaitResults {
    /// The results of a gait from a file.
    ///
    /// # Errors
    /// [`ModelError`] if the gait is malformed.
    pub fn of(gait: &Gait, reference: &ReferenceGait) -> Result<Self, ModelError> {
        gait.validate()?;
        Ok(Self::of_well_formed(gait, &WalkerModel::new(&gait.subject, &gait.device)?, reference))
    }

    /// The results of a well-formed gait of this walker.
    pub(crate) fn of_well_formed(gait: &Gait, model: &WalkerModel, reference: &ReferenceGait) -> Self {
        let rmse = gait_rmse(gait, reference);
        Self {
            cost_of_transport: cost_of_transport(gait, model.total_mass),
            gait_rmse_rad: rmse.total,
            gait_rmse_parts_rad: rmse.parts,
            speed_m_s: gait.speed_m_s,
            stride_length_m: gait.stride_length_m,
            durations_s: std::array::from_fn(|d| gait.domains[d].duration_s),
            vhip_m_s: gait.hip_velocity_m_s,
        }
    }

    /// The results that a report states.
    pub fn of_report(report: &SolveReport) -> Self {
        Self {
            cost_of_transport: report.cost_of_transport,
            gait_rmse_rad: report.gait_rmse_rad,
            gait_rmse_parts_rad: report.gait_rmse_parts_rad,
            speed_m_s: report.speed_m_s,
            stride_length_m: report.stride_length_m,
            durations_s: report.durations_s,
            vhip_m_s: report.vhip_m_s,
        }
    }

    /// The first result that differs from that of `other` by more than rounding: its name, and both values.
    pub fn difference(&self, other: &Self) -> Option<(&'static str, f64, f64)> {
        let pairs = self.named().into_iter().zip(other.named());
        let mut pairs = pairs.flat_map(|((name, one), (_, other))| {
            one.into_iter().zip(other).map(move |(one, other)| (name, one, other))
        });
        let agree = |one: f64, other: f64| (one - other).abs() <= ROUNDING * (1.0 + other.abs());
        pairs.find(|&(_, one, other)| !agree(one, other))
    }

    fn named(&self) -> [(&'static str, Vec<f64>); 7] {
        [
            ("gait_rmse_rad", vec![self.gait_rmse_rad]),
            ("gait_rmse_parts_rad", self.gait_rmse_parts_rad.to_vec()),
            ("cost_of_transport", vec![self.cost_of_transport]),
            ("speed_m_s", vec![self.speed_m_s]),
            ("stride_length_m", vec![self.stride_length_m]),
            ("durations_s", self.durations_s.to_vec()),
            ("vhip_m_s", self.vhip_m_s.to_vec()),
        ]
    }
}
