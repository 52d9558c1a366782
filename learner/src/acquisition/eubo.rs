//! Expected utility of the best option, against the incumbent, over the whole grid.
//!
//! `E max(f(x), f(b)) - E f(b) = d Phi(d/s) + s phi(d/s)`, `d` and `s` the mean and standard deviation of
//! `f(x) - f(b)`. The variance of an action costs `O(n^2)`, everything else `O(n)`: an upper bound of the variance
//! ranks the actions, and the exact value is computed in that order until no bound exceeds the best value found. The
//! result is the exact maximiser.

use std::collections::HashSet;

use crate::grid::Grid;
use crate::linalg::BLOCK;
use crate::math;
use crate::posterior::Posterior;
use crate::space::ActionIndex;

/// `E max(X, 0)` for `X` normal with the given mean and variance.
pub(crate) fn expected_gain(mean: f64, variance: f64) -> f64 {
    let sd = variance.max(1e-18).sqrt();
    let z = mean / sd;
    mean * math::normal_cdf(z) + sd * math::normal_density(z)
}

/// The action outside `taken` with the highest expected utility of the better of it and `best`, times its
/// probability of being feasible where that is a function of its own.
pub(crate) fn against(belief: &Posterior, best: ActionIndex, taken: &HashSet<ActionIndex>) -> Option<ActionIndex> {
    let space = belief.space();
    let utility = &belief.utility;
    let grid = Grid::new(space, utility);
    let incumbent = utility.view(best, space.levels(best));
    let own = utility.variance(&incumbent);
    let hopeless = belief.feasibility.is_some() && belief.infeasible.contains(&best);
    let slot = utility.model().slot(best);
    let weights = slot.map_or_else(|| vec![0.0; utility.model().points.len()], |slot| utility.covariance_weights(slot));
    let (means, covariances) = grid.forms(&utility.approximation().weights, &weights);
    let feasibility = belief.feasibility.as_ref().map(|feasibility| {
        let grid = Grid::new(space, feasibility);
        let weights = &feasibility.approximation().weights;
        let means = grid.forms(weights, weights).0;
        (grid, means, feasibility.kernel.variance)
    });
    let threshold = belief.settings().ordinal_thresholds.first().copied().unwrap_or(f64::NEG_INFINITY);
    let total = utility.kernel.variance;
    // Cauchy-Schwarz: what the answers about the incumbent alone remove of a variance.
    let spent = (total + utility.kernel.nugget - own).max(1e-12);
    let taken: HashSet<u64> = taken.iter().map(|a| a.0).collect();
    let mut ranked: Vec<(f64, usize)> = (0..means.len())
        .filter(|&x| !taken.contains(&(x as u64)))
        .map(|x| {
            let prior = utility.kernel.covariance(&space.levels(ActionIndex(x as u64)), &space.levels(best));
            let removed = if slot.is_some() { (prior - covariances[x]).powi(2) / spent } else { 0.0 };
            let variance = total - removed + own - 2.0 * covariances[x];
            let gain = if hopeless { 1.0 } else { expected_gain(means[x] - incumbent.mean, variance) };
            let chance = feasibility.as_ref().map_or(1.0, |(_, means, total)| {
                let z = (means[x] - threshold) / total.sqrt();
                if z >= 0.0 { 1.0 } else { math::normal_cdf(z) }
            });
            (gain * chance, x)
        })
        .collect();
    ranked.sort_unstable_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    let mut top: Option<(f64, usize)> = None;
    for chunk in ranked.chunks(BLOCK) {
        if top.is_some_and(|(value, _)| chunk[0].0 < value) {
            break;
        }
        let actions: Vec<usize> = chunk.iter().map(|c| c.1).collect();
        let variances = grid.variances(&actions);
        let chances: Vec<f64> = match &feasibility {
            None => vec![1.0; actions.len()],
            Some((grid, means, _)) => {
                let variances = grid.variances(&actions);
                actions
                    .iter()
                    .zip(variances)
                    .map(|(&x, v)| math::normal_cdf((means[x] - threshold) / v.max(1e-12).sqrt()))
                    .collect()
            }
        };
        for ((&x, variance), chance) in actions.iter().zip(variances).zip(chances) {
            let gain = if hopeless {
                1.0
            } else {
                expected_gain(means[x] - incumbent.mean, (variance + own - 2.0 * covariances[x]).max(0.0))
            };
            let value = gain * chance;
            if top.is_none_or(|(highest, at)| value > highest || (value == highest && x < at)) {
                top = Some((value, x));
            }
        }
    }
    top.map(|(_, x)| ActionIndex(x as u64))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::feedback::{Feedback, FeedbackLog};
    use crate::posterior::posterior;
    use crate::random::Random;
    use crate::settings::{LearnerSettings, Method};
    use crate::space::{Dimension, SearchSpace};

    #[test]
    fn the_pruned_search_finds_the_maximiser() {
        let dimensions = [3, 4, 3, 5]
            .iter()
            .enumerate()
            .map(|(d, &n)| Dimension { name: d.to_string(), values: (0..n).map(f64::from).collect(), lengthscale: 1.3 })
            .collect();
        let space = SearchSpace::new(dimensions).unwrap();
        for (shares, seed) in [((0.0, 0.0), 1), ((0.3, 0.3), 2), ((0.0, 0.0), 3), ((0.5, 0.0), 4)] {
            let settings = LearnerSettings {
                additive_share: shares.0,
                pairwise_share: shares.1,
                ..LearnerSettings::of(Method::Eubo)
            };
            let mut random = Random::new(seed, 0);
            let mut log = FeedbackLog::default();
            while log.visited.len() < 25 {
                let action = ActionIndex(random.below(space.len()));
                if let Some(&other) = log.visited.last()
                    && other != action
                {
                    let (winner, loser) = if random.uniform() < 0.5 { (action, other) } else { (other, action) };
                    log.feedback.push(Feedback::Preference { winner, loser });
                }
                log.feedback.push(Feedback::Label { action, category: usize::from(random.uniform() < 0.7) });
                log.visited.push(action);
            }
            let belief = posterior(&space, &log, &settings).unwrap();
            let best = belief.best().unwrap();
            let taken: HashSet<ActionIndex> = log.visited.iter().copied().collect();
            let incumbent = belief.utility.view(best, space.levels(best));
            let mut top = (0.0, ActionIndex(0));
            for action in (0..space.len()).map(ActionIndex).filter(|a| !taken.contains(a)) {
                let (mean, variance) =
                    belief.utility.difference(&belief.utility.view(action, space.levels(action)), &incumbent);
                let gain = expected_gain(mean, variance);
                if gain > top.0 {
                    top = (gain, action);
                }
            }
            assert_eq!(against(&belief, best, &taken), Some(top.1));
        }
    }
}
