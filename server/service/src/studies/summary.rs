//! A study in one document: what `tune --json` prints, a contract for scripts.

use super::recommended::{CertificateState, Judged};
use super::snapshot::StudySnapshot;
use gait_optimizer::{SolveStatus, TunedBounds};
use gaitwright_store::studies::StudyState;
use gaitwright_store::trials::{Trial, TrialState};
use gaitwright_store::{StudyId, TrialId};
use serde::Serialize;

/// A study in one document.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Summary {
    /// The study.
    pub study_id: StudyId,
    /// Where it stands.
    pub state: StudyState,
    /// Number of the recommended trial.
    pub best_trial: Option<u32>,
    /// Its action.
    pub best_action: Option<TunedBounds>,
    /// Its Gait RMSE, rad.
    pub best_gait_rmse_rad: Option<f64>,
    /// Its cost of transport.
    pub best_cost_of_transport: Option<f64>,
    /// What the certificate of its gait says.
    pub best_certificate: CertificateState,
    /// Why that failed, in words.
    pub best_objections: Vec<String>,
    /// Where it failed: the best trial whose gait passed.
    pub passing: Option<TrialSummary>,
    /// Every trial, by number.
    pub trials: Vec<TrialSummary>,
}

/// A trial of a [`Summary`].
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TrialSummary {
    /// 1, 2, ...
    pub number: u32,
    /// Identifier.
    pub trial_id: TrialId,
    /// The bounds.
    pub action: TunedBounds,
    /// `converged` or `not_converged`; none when the solve gave no result.
    pub label: Option<TrialState>,
    /// Where the trial stands.
    pub state: TrialState,
    /// How the solve ended.
    pub status: Option<SolveStatus>,
    /// Gait RMSE, rad.
    pub gait_rmse_rad: Option<f64>,
    /// Cost of transport.
    pub cost_of_transport: Option<f64>,
    /// Interior-point iterations.
    pub iterations: Option<u32>,
    /// Wall time of the solve, s.
    pub seconds_total: Option<f64>,
    /// Number of the trial whose gait it started from; none: cold.
    pub warm_started_from: Option<u32>,
}

/// The summary of a study and its best trial, with what is known of its certificates.
pub fn of(snapshot: &StudySnapshot, best: Option<TrialId>, judged: Judged) -> Summary {
    let best = best.and_then(|id| snapshot.trial(id));
    Summary {
        study_id: snapshot.study.id,
        state: snapshot.study.state,
        best_trial: best.map(|trial| trial.number),
        best_action: best.map(|trial| trial.action),
        best_gait_rmse_rad: best.and_then(|trial| trial.gait_rmse_rad),
        best_cost_of_transport: best.and_then(|trial| trial.cost_of_transport),
        best_certificate: judged.verdict,
        best_objections: judged.objections,
        passing: judged.passing.and_then(|id| snapshot.trial(id)).map(|trial| line(trial, &snapshot.trials)),
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
        label: Some(trial.state).filter(|state| state.is_result()),
        state: trial.state,
        status: trial.status,
        gait_rmse_rad: trial.gait_rmse_rad,
        cost_of_transport: trial.cost_of_transport,
        iterations: trial.iterations,
        seconds_total: trial.seconds_total,
        warm_started_from: number_of(trial.warm_started_from, all),
    }
}
