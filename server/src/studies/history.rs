//! The best action by iteration: what the study would have recommended after each result.

use super::choice::best_trial;
use super::standing::Standing;
use crate::store::TrialId;
use gait_learner::LearnerError;
use serde::Serialize;
use utoipa::ToSchema;

/// The recommendation after some results.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, ToSchema)]
pub struct Milestone {
    /// Number of the trial after whose proposal's predecessors this held: 1, 2, ...
    pub iteration: u32,
    /// The best trial then.
    pub trial_id: TrialId,
    /// Its number.
    pub number: u32,
    /// Its Gait RMSE, rad; none when it did not converge.
    pub gait_rmse_rad: Option<f64>,
    /// Its cost of transport.
    pub cost_of_transport: Option<f64>,
}

/// The best trial after each iteration. What the learner believed when it proposed trial n + 1 is the best after
/// iteration n; after the last one, what it believes now.
///
/// # Errors
/// When the learner refuses the log.
pub fn of(standing: &Standing) -> Result<Vec<Milestone>, LearnerError> {
    let milestone = |iteration: u32, id: TrialId| {
        standing.trial(id).map(|best| Milestone {
            iteration,
            trial_id: id,
            number: best.number,
            gait_rmse_rad: best.gait_rmse_rad,
            cost_of_transport: best.cost_of_transport,
        })
    };
    let mut history: Vec<Milestone> =
        standing.trials.iter().filter_map(|trial| milestone(trial.number - 1, trial.best_before?)).collect();
    let last = standing.trials.iter().rev().find(|trial| trial.state.is_result()).map(|trial| trial.number);
    if let (Some(last), Some(best)) = (last, best_trial(standing)?)
        && history.last().is_none_or(|milestone| milestone.iteration < last)
    {
        history.extend(milestone(last, best));
    }
    Ok(history)
}
