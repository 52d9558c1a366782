//! Learning of lengthscales and preference noise from the evidence (off by default).
//!
//! A coordinate search maximises evidence times prior over one factor for each lengthscale and one for the preference
//! noise. Priors are log-normal around 1. Lengthscale factors are at least 1, because the data cannot resolve less than
//! the steps of the grid.
//!
//! Each search starts from 1 and uses the feedback about the first `n` visited actions, `n` the last multiple of the
//! learning interval. The result therefore depends on the log only.

use crate::error::Result;
use crate::search_space::SearchSpace;

/// Factors on the lengthscales and the preference noise of the settings.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Hyperparameters {
    pub(crate) lengthscales: Vec<f64>,
    pub(crate) preference_noise: f64,
}

/// Prior standard deviation of the logarithm of a lengthscale factor.
const LENGTHSCALE_SPREAD: f64 = 0.8;
/// Prior standard deviation of the logarithm of the noise factor.
const NOISE_SPREAD: f64 = 1.5;
/// Ratio of successive candidates.
const STEP: f64 = 1.6;
/// Largest lengthscale factor.
const LONGEST: f64 = 20.0;
/// Largest number of passes over the dimensions.
const PASSES: usize = 2;

impl Hyperparameters {
    /// All factors 1.
    pub(crate) fn neutral(space: &SearchSpace) -> Self {
        Self { lengthscales: vec![1.0; space.dimensions().len()], preference_noise: 1.0 }
    }

    fn ln_prior(&self) -> f64 {
        let term = |factor: f64, spread: f64| -0.5 * (crate::special_functions::ln(factor) / spread).powi(2);
        self.lengthscales.iter().map(|&l| term(l, LENGTHSCALE_SPREAD)).sum::<f64>()
            + term(self.preference_noise, NOISE_SPREAD)
    }

    /// Maximises the logarithm of evidence times prior.
    pub(crate) fn learn(space: &SearchSpace, log_evidence: impl Fn(&Self) -> Result<f64>) -> Result<Self> {
        let mut best = Self::neutral(space);
        // A candidate whose covariance cannot be factored is rejected.
        let score = |candidate: &Self| log_evidence(candidate).map_or(f64::NEG_INFINITY, |e| e + candidate.ln_prior());
        let mut highest = log_evidence(&best)? + best.ln_prior();
        let mut consider = |best: &mut Self, change: &dyn Fn(&mut Self)| {
            let mut candidate = best.clone();
            change(&mut candidate);
            candidate.lengthscales.iter_mut().for_each(|l| *l = l.clamp(1.0, LONGEST));
            candidate.preference_noise = candidate.preference_noise.clamp(1e-2, 1e2);
            let value = if candidate == *best { f64::NEG_INFINITY } else { score(&candidate) };
            let better = value > highest + 1e-9;
            if better {
                highest = value;
                *best = candidate;
            }
            better
        };
        // All lengthscales together, then the noise, then one dimension at a time.
        while consider(&mut best, &|h| h.lengthscales.iter_mut().for_each(|l| *l *= STEP)) {}
        for factor in [STEP, 1.0 / STEP] {
            while consider(&mut best, &|h| h.preference_noise *= factor) {}
        }
        for _ in 0..PASSES {
            let mut improved = false;
            for d in 0..space.dimensions().len() {
                for factor in [STEP, 1.0 / STEP] {
                    improved |= consider(&mut best, &|h| h.lengthscales[d] *= factor);
                }
            }
            if !improved {
                break;
            }
        }
        Ok(best)
    }
}

#[cfg(test)]
mod tests {
    use crate::action::ActionIndex;
    use crate::feedback::{Feedback, FeedbackLog};
    use crate::learner::posterior;
    use crate::random::Random;
    use crate::search_space::{Dimension, SearchSpace};
    use crate::settings::{LearnerSettings, Method};

    #[test]
    fn learned_lengthscales_improve_predictions_of_unvisited_actions() {
        let dimension =
            |name: &str| Dimension { name: name.into(), values: (0..8).map(f64::from).collect(), lengthscale: 1.0 };
        let space = SearchSpace::new(vec![dimension("matters"), dimension("does not")]).unwrap();
        let utility = |a: ActionIndex| (1.7 * space.levels(a)[0] as f64).sin();
        let mut random = Random::new(1, 0);
        let mut log = FeedbackLog::default();
        for _ in 0..40 {
            let action = ActionIndex(random.below(64));
            if log.visited.contains(&action) {
                continue;
            }
            for &other in log.visited.iter().rev().take(3) {
                let better = utility(action) > utility(other);
                let (winner, loser) = if better { (action, other) } else { (other, action) };
                log.feedback.push(Feedback::Preference { winner, loser });
            }
            log.visited.push(action);
        }
        let settings = LearnerSettings { preference_noise: 0.1, ..LearnerSettings::published(Method::Eubo) };
        let learning = LearnerSettings { learn_every: Some(10), ..settings.clone() };
        // Number of pairs of actions that the posterior mean orders wrongly.
        let wrong = |settings: &LearnerSettings| {
            let belief = posterior(&space, &log, settings).unwrap();
            let actions: Vec<ActionIndex> = (0..64).map(ActionIndex).collect();
            let mut wrong = 0;
            for &a in &actions {
                for &b in &actions {
                    let truth = utility(a) - utility(b);
                    let believed = belief.mean(a).unwrap() - belief.mean(b).unwrap();
                    wrong += u32::from(truth.abs() > 1e-9 && truth * believed < 0.0);
                }
            }
            wrong
        };
        let (fixed, learned) = (wrong(&settings), wrong(&learning));
        assert!(learned < fixed, "{learned} {fixed}");
    }
}
