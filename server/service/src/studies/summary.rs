//! The summary of a study as one document, as `tune --json` prints it for scripts.

use super::actions_with_known_gait::never_active;
use super::certified_best::{BestCertification, CertificateState};
use super::snapshot::StudySnapshot;
use gait_optimizer::execution::ExecutionReport;
use gait_optimizer::{SolveStatus, TunedBounds};
use gaitwright_store::studies::StudyState;
use gaitwright_store::trials::{Label, Trial, TrialState};
use gaitwright_store::{StudyId, TrialId};
use serde::Serialize;

/// Summary of a study.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Summary {
    /// Identifier of the study.
    pub study_id: StudyId,
    /// State of the study.
    pub state: StudyState,
    /// Number of the recommended trial.
    pub best_trial: Option<u32>,
    /// Action of the recommended trial.
    pub best_action: Option<TunedBounds>,
    /// Gait RMSE of the recommended trial, rad.
    pub best_gait_rmse_rad: Option<f64>,
    /// Cost of transport of the recommended trial.
    pub best_cost_of_transport: Option<f64>,
    /// Simulated walks with the recommended gait. Absent if there were none.
    pub best_simulated_walks: Option<SimulatedWalksSummary>,
    /// State of the certificate of the recommended gait.
    pub best_certificate: CertificateState,
    /// Reasons if that certificate failed.
    pub best_failures: Vec<String>,
    /// If it failed, the best trial whose gait passed.
    pub passing: Option<TrialSummary>,
    /// Tuned bounds that were active in no gait so far.
    pub never_active: Vec<String>,
    /// Every trial, by number.
    pub trials: Vec<TrialSummary>,
}

/// The simulated walks of an execution report, over all kinds of ground.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SimulatedWalksSummary {
    /// Number of simulated walks.
    pub number_of_simulated_walks: u32,
    /// Number of complete ones.
    pub completed: u32,
    /// Mean number of strides.
    pub mean_strides: f64,
    /// Seed of the disturbances.
    pub seed: u64,
}

impl SimulatedWalksSummary {
    fn of(report: &ExecutionReport) -> Self {
        let (completed, number_of_simulated_walks) = report.completed_of_all();
        Self { number_of_simulated_walks, completed, mean_strides: report.mean_strides(), seed: report.seed }
    }
}

/// A trial of a [`Summary`].
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TrialSummary {
    /// 1, 2, ...
    pub number: u32,
    /// Identifier.
    pub trial_id: TrialId,
    /// Bounds of the trial.
    pub action: TunedBounds,
    /// Label. Absent without a result.
    pub label: Option<Label>,
    /// State of the trial.
    pub state: TrialState,
    /// Status of the solve.
    pub status: Option<SolveStatus>,
    /// Gait RMSE, rad.
    pub gait_rmse_rad: Option<f64>,
    /// Cost of transport.
    pub cost_of_transport: Option<f64>,
    /// Mean strides of the simulated walks on which the result depends.
    pub mean_strides: Option<f64>,
    /// Interior-point iterations.
    pub iterations: Option<u32>,
    /// Wall time of the solve, s.
    pub seconds_total: Option<f64>,
    /// Number of the trial that gave the warm start. Absent for a cold start.
    pub warm_started_from: Option<u32>,
}

/// The summary of a study with its best trial, the certificates and the execution report of the best gait.
pub fn of(
    snapshot: &StudySnapshot,
    best: Option<TrialId>,
    certification: BestCertification,
    report: Option<&ExecutionReport>,
) -> Summary {
    let best = best.and_then(|id| snapshot.trial(id));
    Summary {
        study_id: snapshot.study.id,
        state: snapshot.study.state,
        best_trial: best.map(|trial| trial.number),
        best_action: best.map(|trial| trial.action),
        best_gait_rmse_rad: best.and_then(|trial| trial.gait_rmse_rad),
        best_cost_of_transport: best.and_then(|trial| trial.cost_of_transport),
        best_simulated_walks: report.map(SimulatedWalksSummary::of),
        best_certificate: certification.certificate,
        best_failures: certification.failures,
        passing: certification.passing.and_then(|id| snapshot.trial(id)).map(|trial| line(trial, &snapshot.trials)),
        never_active: never_active(snapshot),
        trials: snapshot.trials.iter().map(|trial| line(trial, &snapshot.trials)).collect(),
    }
}

/// The number of a trial.
pub fn number_of(id: Option<TrialId>, all: &[Trial]) -> Option<u32> {
    id.and_then(|id| all.iter().find(|trial| trial.id == id)).map(|trial| trial.number)
}

fn line(trial: &Trial, all: &[Trial]) -> TrialSummary {
    TrialSummary {
        number: trial.number,
        trial_id: trial.id,
        action: trial.action,
        label: trial.state.label(),
        state: trial.state,
        status: trial.status,
        gait_rmse_rad: trial.gait_rmse_rad,
        cost_of_transport: trial.cost_of_transport,
        mean_strides: trial.mean_strides,
        iterations: trial.iterations,
        seconds_total: trial.seconds_total,
        warm_started_from: number_of(trial.warm_started_from, all),
    }
}
