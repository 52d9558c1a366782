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

/// Upper bounds of [`expected_gain`] by linear interpolation of the convex `h(z) = z Phi(z) + phi(z)`.
struct GainBound {
    table: Vec<f64>,
}

impl GainBound {
    const REACH: f64 = 8.0;
    const STEPS: f64 = 32.0;

    fn new() -> Self {
        let h = |i: u32| {
            let z = f64::from(i) / Self::STEPS - Self::REACH;
            z * math::normal_cdf(z) + math::normal_density(z)
        };
        Self { table: (0..=512).map(h).collect() }
    }

    fn of(&self, mean: f64, variance: f64) -> f64 {
        // A little more than the variance covers its rounding.
        let sd = (variance.max(0.0) + 1e-9).sqrt();
        let at = (mean / sd + Self::REACH) * Self::STEPS;
        if at >= 511.0 {
            return mean + sd * 1e-9;
        }
        let at = at.max(0.0);
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "within 0..511")]
        let i = at as usize;
        let weight = at - i as f64;
        sd * (self.table[i] + weight * (self.table[i + 1] - self.table[i]))
    }
}

/// The action outside `taken` with the highest expected utility of the better of it and `best`, times its
/// probability of being feasible where that is a function of its own.
pub(crate) fn against(
    belief: &Posterior,
    best: ActionIndex,
    taken: &HashSet<ActionIndex>,
    among: Option<&[ActionIndex]>,
) -> Option<ActionIndex> {
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
    let with_best = slot.map(|slot| grid.with_point(slot));
    let bounds = GainBound::new();
    let bound = |x: usize| {
        let removed = with_best.as_ref().map_or(0.0, |k| (k[x] - covariances[x]).powi(2) / spent);
        let variance = total - removed + own - 2.0 * covariances[x];
        let gain = if hopeless { 1.0 } else { bounds.of(means[x] - incumbent.mean, variance) };
        let chance = feasibility.as_ref().map_or(1.0, |(_, means, total)| {
            let z = (means[x] - threshold) / total.sqrt();
            if z >= 0.0 { 1.0 } else { math::normal_cdf(z) }
        });
        gain * chance
    };
    let mut free = vec![among.is_none(); means.len()];
    for action in among.unwrap_or_default() {
        if let Some(free) = usize::try_from(action.0).ok().and_then(|x| free.get_mut(x)) {
            *free = true;
        }
    }
    for action in taken {
        if let Some(free) = usize::try_from(action.0).ok().and_then(|x| free.get_mut(x)) {
            *free = false;
        }
    }
    let mut ranked: Vec<(f64, usize)> = (0..means.len()).filter(|&x| free[x]).map(|x| (bound(x), x)).collect();
    let order = |a: &(f64, usize), b: &(f64, usize)| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1));
    let mut top: Option<(f64, usize)> = None;
    // The first block alone usually rules out most of the rest, which then need not be sorted.
    let first = BLOCK.min(ranked.len());
    if first < ranked.len() {
        ranked.select_nth_unstable_by(first, order);
    }
    let (head, tail) = ranked.split_at_mut(first);
    let mut consider = |chunk: &[(f64, usize)]| {
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
        top.map_or(f64::NEG_INFINITY, |(value, _)| value)
    };
    let mut highest = if head.is_empty() { f64::NEG_INFINITY } else { consider(head) };
    let mut rest: Vec<(f64, usize)> = tail.iter().copied().filter(|(bound, _)| *bound >= highest).collect();
    rest.sort_unstable_by(order);
    for chunk in rest.chunks(BLOCK) {
        if chunk[0].0 < highest {
            break;
        }
        highest = consider(chunk);
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
            assert_eq!(against(&belief, best, &taken, None), Some(top.1));
        }
    }
}
