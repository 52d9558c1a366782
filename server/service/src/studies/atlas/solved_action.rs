//! The values of a solve that the atlas keeps.

use super::gait_values::GaitValues;
use crate::error::Error;
use gait_learner::ActionIndex;
use gait_optimizer::{ReferenceGait, SolveOutcome, SolveStatus};
use serde::{Deserialize, Serialize};

/// The solve of one action.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SolvedAction {
    /// The action.
    pub action: ActionIndex,
    /// How the solve ended.
    pub status: SolveStatus,
    /// Number of its iterations.
    pub iterations: usize,
    /// The values of its gait; `None` without one.
    pub gait: Option<GaitValues>,
}

impl SolvedAction {
    pub(crate) fn of(action: ActionIndex, outcome: &SolveOutcome, reference: &ReferenceGait) -> Result<Self, Error> {
        let report = &outcome.report;
        let gait = match report.status {
            SolveStatus::Converged => Some(GaitValues::of(report, &outcome.gait, reference)?),
            _ => None,
        };
        Ok(Self { action, status: report.status, iterations: report.iterations, gait })
    }
}
