//! Expected utility of the best option, against the incumbent, over the whole grid.
//!
//! `E max(f(x), f(b)) - E f(b) = d Phi(d/s) + s phi(d/s)`, `d` and `s` the mean and standard deviation of
//! `f(x) - f(b)`. The variance of an action costs `O(n^2)`, everything else `O(n)`: an upper bound of the variance
//! ranks the actions, and the exact value is computed in that order until no bound exceeds the best value found. The
//! result is the exact maximiser.

use std::collections::HashSet;

use crate::acquisition::avoidance::Avoidance;
use crate::belief::Belief;
use crate::grid::Grid;
use crate::linalg::BLOCK;
use crate::math;
use crate::posterior::Posterior;
use crate::space::{ActionIndex, SearchSpace};

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

/// Upper bounds of the normal distribution function left of 0, where it is convex, by linear interpolation.
struct ProbabilityBound {
    table: Vec<f64>,
}

impl ProbabilityBound {
    fn new() -> Self {
        let at = |i: u32| math::normal_cdf(f64::from(i) / GainBound::STEPS - GainBound::REACH);
        Self { table: (0..=256).map(at).collect() }
    }

    fn of(&self, z: f64) -> f64 {
        let at = ((z + GainBound::REACH) * GainBound::STEPS).max(0.0);
        if at >= 255.0 {
            return 1.0;
        }
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "within 0..255")]
        let i = at as usize;
        let weight = at - i as f64;
        // A little more covers the rounding of the interpolation.
        (self.table[i] + weight * (self.table[i + 1] - self.table[i])) * (1.0 + 1e-12)
    }
}

/// The utility of every action beside the incumbent's.
struct Duel<'a> {
    grid: Grid<'a>,
    incumbent_mean: f64,
    incumbent_variance: f64,
    means: Vec<f64>,
    /// Posterior covariances with the incumbent.
    covariances: Vec<f64>,
    /// Prior covariances with the incumbent.
    prior: Vec<f64>,
    /// Prior variance that answers removed from the incumbent.
    spent: f64,
    /// What knowing the utility of each pending action would take from every standard deviation: squares add up.
    pending: Vec<Vec<f64>>,
}

impl<'a> Duel<'a> {
    fn new(space: &SearchSpace, belief: &'a Belief, best: ActionIndex, pending: &[ActionIndex]) -> Self {
        let grid = Grid::new(space, belief);
        let view = belief.view(best, space.levels(best));
        let incumbent_variance = belief.variance(&view);
        let prior = grid.prior_with(space, best);
        let means = grid.form(&belief.approximation().weights);
        let mut covariances = grid.form(&belief.covariance_weights(&view));
        for (covariance, prior) in covariances.iter_mut().zip(&prior) {
            *covariance += prior;
        }
        let spent = (belief.kernel.variance + belief.kernel.nugget - incumbent_variance).max(1e-12);
        let mut duel = Self {
            grid,
            incumbent_mean: view.mean,
            incumbent_variance,
            means,
            covariances,
            prior,
            spent,
            pending: Vec::new(),
        };
        for &action in pending {
            duel.suppose_known(space, belief, action, best);
        }
        duel
    }

    /// Conditions variances and covariances on the utility of a pending action.
    fn suppose_known(&mut self, space: &SearchSpace, belief: &Belief, action: ActionIndex, best: ActionIndex) {
        let (Ok(at), Ok(incumbent)) = (usize::try_from(action.0), usize::try_from(best.0)) else { return };
        let view = belief.view(action, space.levels(action));
        let weights = belief.covariance_weights(&view);
        let mut column = self.grid.form(&weights);
        for (value, prior) in column.iter_mut().zip(self.grid.prior_with(space, action)) {
            *value += prior;
        }
        let mut variance = belief.variance(&view) + belief.kernel.nugget;
        for earlier in &self.pending {
            let own = earlier[at];
            variance -= own * own;
            for (value, r) in column.iter_mut().zip(earlier) {
                *value -= own * r;
            }
        }
        let sd = variance.max(belief.kernel.nugget).sqrt();
        for value in &mut column {
            *value /= sd;
        }
        let with_best = column[incumbent];
        self.incumbent_variance = (self.incumbent_variance - with_best * with_best).max(0.0);
        for (covariance, r) in self.covariances.iter_mut().zip(&column) {
            *covariance -= r * with_best;
        }
        self.pending.push(column);
    }

    fn supposed(&self, x: usize) -> f64 {
        self.pending.iter().map(|r| r[x] * r[x]).sum()
    }

    /// Mean of the difference to the incumbent.
    fn lead(&self, x: usize) -> f64 {
        self.means[x] - self.incumbent_mean
    }

    /// Variance of the difference, given the action's own variance.
    fn variance(&self, x: usize, own: f64) -> f64 {
        (own - self.supposed(x) + self.incumbent_variance - 2.0 * self.covariances[x]).max(0.0)
    }

    /// At least the action's own variance: Cauchy-Schwarz gives what the answers about the incumbent removed.
    fn variance_bound(&self, x: usize, total: f64) -> f64 {
        if !self.pending.is_empty() {
            return total;
        }
        total - (self.prior[x] - self.covariances[x]).powi(2) / self.spent
    }
}

/// The probability of every action to be feasible.
struct Chance<'a> {
    grid: Grid<'a>,
    means: Vec<f64>,
    threshold: f64,
    prior_sd: f64,
    bounds: ProbabilityBound,
}

impl<'a> Chance<'a> {
    fn new(space: &SearchSpace, belief: &'a Belief, threshold: f64) -> Self {
        let grid = Grid::new(space, belief);
        let means = grid.form(&belief.approximation().weights);
        Self { grid, means, threshold, prior_sd: belief.kernel.variance.sqrt(), bounds: ProbabilityBound::new() }
    }

    fn bound(&self, x: usize) -> f64 {
        self.bounds.of((self.means[x] - self.threshold) / self.prior_sd)
    }

    fn of(&self, actions: &[usize]) -> Vec<f64> {
        let variances = self.grid.variances(actions);
        let chance = |(&x, v): (&usize, f64)| math::normal_cdf((self.means[x] - self.threshold) / v.max(1e-12).sqrt());
        actions.iter().zip(variances).map(chance).collect()
    }
}

/// The action outside `taken` with the highest expected utility of the better of it and `best`, times its
/// probability of being feasible where that is a function of its own. `among` restricts the search; the utilities of
/// `pending` actions are supposed to become known. Actions in the region of avoidance only where nothing else is left.
pub(crate) fn against(
    belief: &Posterior,
    best: ActionIndex,
    taken: &HashSet<ActionIndex>,
    pending: &[ActionIndex],
    among: Option<&[ActionIndex]>,
) -> Option<ActionIndex> {
    let avoidance = Avoidance::of(belief);
    let found = maximiser(belief, best, taken, pending, among, avoidance.as_ref());
    if found.is_none() && avoidance.is_some() {
        return maximiser(belief, best, taken, pending, among, None);
    }
    found
}

fn maximiser(
    belief: &Posterior,
    best: ActionIndex,
    taken: &HashSet<ActionIndex>,
    pending: &[ActionIndex],
    among: Option<&[ActionIndex]>,
    avoidance: Option<&Avoidance<'_>>,
) -> Option<ActionIndex> {
    let space = belief.space();
    let duel = Duel::new(space, &belief.utility, best, pending);
    let threshold = belief.settings().ordinal_thresholds.first().copied().unwrap_or(f64::NEG_INFINITY);
    let chance = belief.feasibility.as_ref().map(|belief| Chance::new(space, belief, threshold));
    // Nothing feasible was found yet: whatever is feasible is better.
    let hopeless = chance.is_some() && belief.infeasible.contains(&best);
    let total = belief.utility.kernel.variance;
    let bounds = GainBound::new();
    let bound = |x: usize| {
        let variance = duel.variance(x, duel.variance_bound(x, total));
        let gain = if hopeless { 1.0 } else { bounds.of(duel.lead(x), variance) };
        gain * chance.as_ref().map_or(1.0, |chance| chance.bound(x))
    };
    let mut free = vec![among.is_none(); duel.means.len()];
    let mut mark = |action: &ActionIndex, value: bool| {
        if let Some(free) = usize::try_from(action.0).ok().and_then(|x| free.get_mut(x)) {
            *free = value;
        }
    };
    for action in among.unwrap_or_default() {
        mark(action, true);
    }
    for action in taken {
        mark(action, false);
    }
    if let Some(avoidance) = avoidance {
        let means = chance.as_ref().map_or(&duel.means, |chance| &chance.means);
        for (free, &mean) in free.iter_mut().zip(means) {
            *free &= !avoidance.rules_out(mean);
        }
    }
    let mut ranked: Vec<(f64, usize)> = (0..free.len()).filter(|&x| free[x]).map(|x| (bound(x), x)).collect();
    let order = |a: &(f64, usize), b: &(f64, usize)| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1));
    let mut top: Option<(f64, usize)> = None;
    let mut consider = |chunk: &[(f64, usize)]| {
        let highest = top.map_or(f64::NEG_INFINITY, |(value, _)| value);
        let allowed = |x: &usize| avoidance.is_none_or(|avoidance| avoidance.allows(ActionIndex(*x as u64)));
        let actions: Vec<usize> = chunk.iter().map(|c| c.1).filter(allowed).collect();
        let gains: Vec<(usize, f64)> = actions
            .iter()
            .zip(duel.grid.variances(&actions))
            .map(|(&x, own)| (x, if hopeless { 1.0 } else { expected_gain(duel.lead(x), duel.variance(x, own)) }))
            .filter(|&(x, gain)| gain * chance.as_ref().map_or(1.0, |chance| chance.bound(x)) >= highest)
            .collect();
        let actions: Vec<usize> = gains.iter().map(|g| g.0).collect();
        let chances = chance.as_ref().map_or_else(|| vec![1.0; gains.len()], |chance| chance.of(&actions));
        for ((x, gain), chance) in gains.into_iter().zip(chances) {
            let value = gain * chance;
            if top.is_none_or(|(highest, at)| value > highest || (value == highest && x < at)) {
                top = Some((value, x));
            }
        }
        top.map_or(f64::NEG_INFINITY, |(value, _)| value)
    };
    // The first block alone usually rules out most of the rest, which then need not be sorted.
    let first = BLOCK.min(ranked.len());
    if first < ranked.len() {
        ranked.select_nth_unstable_by(first, order);
    }
    let (head, tail) = ranked.split_at(first);
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
    use crate::settings::{Labels, LearnerSettings, Method};
    use crate::space::Dimension;

    #[test]
    fn the_pruned_search_finds_the_maximiser() {
        let dimensions = [3, 4, 3, 5]
            .iter()
            .enumerate()
            .map(|(d, &n)| Dimension { name: d.to_string(), values: (0..n).map(f64::from).collect(), lengthscale: 1.3 })
            .collect();
        let space = SearchSpace::new(dimensions).unwrap();
        for (shares, seed) in [((0.0, 0.0), 1), ((0.3, 0.3), 2), ((0.0, 0.0), 3), ((0.5, 0.0), 4), ((0.3, 0.2), 5)] {
            let settings = LearnerSettings {
                additive_share: shares.0,
                pairwise_share: shares.1,
                labels: if seed % 2 == 1 { Labels::Separate } else { Labels::InUtility },
                ..LearnerSettings::published(Method::Eubo)
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
                let chance = belief.feasibility.as_ref().map_or(1.0, |feasibility| {
                    let view = feasibility.view(action, space.levels(action));
                    math::normal_cdf(view.mean / feasibility.variance(&view).sqrt())
                });
                let gain = expected_gain(mean, variance) * chance;
                if gain > top.0 {
                    top = (gain, action);
                }
            }
            assert_eq!(against(&belief, best, &taken, &[], None), Some(top.1));
        }
    }
}
