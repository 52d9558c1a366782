//! The best action by iteration: what the study would have recommended after each result.

use super::choice::best_to_show;
use super::standing::Standing;
use crate::store::TrialId;
use crate::store::trials::Trial;
use gait_learner::LearnerError;
use serde::Serialize;
use std::collections::HashMap;
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
    let mut history = known(standing);
    let last = standing.trials.iter().rev().find(|trial| trial.state.is_result()).map(|trial| trial.number);
    if let (Some(last), Some(best)) = (last, best_to_show(standing)?)
        && history.last().is_none_or(|milestone| milestone.iteration < last)
    {
        history.extend(standing.trial(best).map(|best| milestone(last, best)));
    }
    Ok(history)
}

/// What is known without asking the learner: the best when each trial was proposed.
pub fn known(standing: &Standing) -> Vec<Milestone> {
    let by_id: HashMap<TrialId, &Trial> = standing.trials.iter().map(|trial| (trial.id, trial)).collect();
    let best_before = |trial: &Trial| by_id.get(&trial.best_before?).map(|best| milestone(trial.number - 1, best));
    standing.trials.iter().filter_map(best_before).collect()
}

fn milestone(iteration: u32, best: &Trial) -> Milestone {
    Milestone {
        iteration,
        trial_id: best.id,
        number: best.number,
        gait_rmse_rad: best.gait_rmse_rad,
        cost_of_transport: best.cost_of_transport,
    }
}
