//! The utility of the gaits of a study, identical gaits pooled.

use super::identical_gaits::pooled;
use super::ranking::ranking;
use super::snapshot::StudySnapshot;
use gait_learner::{LearnerError, Posterior, Prediction};
use gaitwright_store::TrialId;
use gaitwright_store::trials::Trial;

/// A gait that can be recommended.
#[derive(Debug, Clone, PartialEq)]
pub struct GaitUtility {
    /// The trials that have this gait, those with the highest utility first. Never empty.
    pub trials: Vec<TrialId>,
    /// Utility of the first of them.
    pub utility: Prediction,
    /// How much higher the utility of the recommended gait is; `None` for the recommended gait itself.
    pub behind: Option<Prediction>,
}

/// Whether a difference in utility, the larger less the smaller, exceeds its standard deviation. If so, the order is right
/// with a probability of at least 84 %.
pub fn is_distinguishable(difference: &Prediction) -> bool {
    difference.mean > difference.standard_deviation
}

/// The gaits without a safety report in force, by decreasing utility. The first is the recommended one. Trials with equal
/// actions or identical gaits are one gait.
pub(super) fn gait_utilities(
    snapshot: &StudySnapshot,
    posterior: &Posterior,
) -> Result<Vec<GaitUtility>, LearnerError> {
    let ranked: Vec<&Trial> = ranking(snapshot, posterior)?.into_iter().filter_map(|id| snapshot.trial(id)).collect();
    let pools = pooled(ranked);
    let best = pools.first().map(|pool| pool[0].action_index);
    let utility = |(place, pool): (usize, Vec<&Trial>)| {
        let action = pool[0].action_index;
        let behind = match best.filter(|_| place > 0) {
            Some(best) => Some(posterior.difference(best, action)?),
            None => None,
        };
        Ok(GaitUtility {
            trials: pool.iter().map(|trial| trial.id).collect(),
            utility: posterior.predict(action)?,
            behind,
        })
    };
    pools.into_iter().enumerate().map(utility).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_a_difference_above_its_standard_deviation_is_distinguishable() {
        let difference = |mean| Prediction { mean, standard_deviation: 0.5 };
        assert!(
            is_distinguishable(&difference(0.51))
                && !is_distinguishable(&difference(0.5))
                && !is_distinguishable(&difference(0.0))
        );
        assert!(difference(0.51).probability_above_zero() > 0.84 && difference(0.49).probability_above_zero() < 0.84);
    }
}
