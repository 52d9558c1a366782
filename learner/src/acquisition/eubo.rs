//! Expected utility of the best option (EUBO, Lin et al. 2022): the better of an action and the incumbent.
//!
//! `E max(f(x), f(b)) - E f(b) = d Phi(d/s) + s phi(d/s)`, with `d` and `s` the mean and standard deviation of
//! `f(x) - f(b)`, `b` the incumbent. The variance of an action costs `O(n^2)`, everything else `O(n)`. Therefore the
//! search ranks the actions by an upper bound and computes exact values in that order, until no bound exceeds the best
//! value. The result is the exact maximiser over the grid, or over candidates if the grid is too large.

use crate::acquisition::avoidance::Avoidance;
use crate::acquisition::candidates::near_best_or_random;
use crate::acquisition::duel::{Chance, Duel};
use crate::acquisition::eubo_bounds::{GainBound, expected_gain};
use crate::acquisition::line_points;
use crate::action::ActionIndex;
use crate::action_moments::ActionSet;
use crate::excluded::ForbiddenActions;
use crate::linalg::BLOCK;
use crate::posterior::Posterior;
use crate::random::Random;

/// Number of candidates if the grid is too large to evaluate.
const CANDIDATES: usize = 2000;

/// The action outside `forbidden` that maximises EUBO against `best`, times the probability that it is feasible if labels
/// are separate.
///
/// `among` restricts the search. The utilities of `pending` actions count as known. The region of avoidance is searched
/// only if nothing else is left.
pub(crate) fn against(
    posterior: &Posterior,
    best: ActionIndex,
    forbidden: &ForbiddenActions<'_>,
    pending: &[ActionIndex],
    among: Option<&[ActionIndex]>,
) -> Option<ActionIndex> {
    // Actions with one descriptor have one expected utility.
    let representatives = if among.is_none() { forbidden.one_of_each_descriptor() } else { None };
    let among = among.or(representatives.as_deref());
    // The caller passes `among` if the grid is too large to enumerate.
    let set = match posterior.space().enumerable() {
        Ok(len) if posterior.space().descriptors().is_none() => ActionSet::Grid(len),
        _ => ActionSet::list(among.into_iter().flatten().chain(pending).chain([&best]).copied().collect()),
    };
    let avoidance = Avoidance::of(posterior);
    let found = maximiser(posterior, &set, best, forbidden, pending, among, avoidance.as_ref());
    if found.is_none() && avoidance.is_some() {
        return maximiser(posterior, &set, best, forbidden, pending, among, None);
    }
    found
}

fn maximiser(
    posterior: &Posterior,
    set: &ActionSet,
    best: ActionIndex,
    forbidden: &ForbiddenActions<'_>,
    pending: &[ActionIndex],
    among: Option<&[ActionIndex]>,
    avoidance: Option<&Avoidance<'_>>,
) -> Option<ActionIndex> {
    let space = posterior.space();
    let duel = Duel::new(space, &posterior.utility, set, best, pending);
    let threshold = posterior.settings().ordinal_thresholds.first().copied().unwrap_or(f64::NEG_INFINITY);
    let chance = posterior.feasibility.as_ref().map(|process| Chance::new(space, process, set, threshold));
    // An infeasible incumbent: any feasible action is better, so only the probability counts.
    let hopeless = chance.is_some() && posterior.infeasible.contains(&best);
    let total = posterior.utility.kernel.variance;
    let bounds = GainBound::new();
    let bound = |x: usize| {
        let variance = duel.variance(x, duel.variance_bound(x, total));
        let gain = if hopeless { 1.0 } else { bounds.of(duel.lead(x), variance) };
        gain * chance.as_ref().map_or(1.0, |chance| chance.bound(x))
    };
    let mut free = vec![among.is_none(); set.len()];
    let mut mark = |action: ActionIndex, value: bool| {
        if let Some(free) = set.position(action).and_then(|x| free.get_mut(x)) {
            *free = value;
        }
    };
    for &action in among.unwrap_or_default() {
        mark(action, !forbidden.contains(action));
    }
    for action in forbidden.listed() {
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
        let allowed = |x: &usize| avoidance.is_none_or(|avoidance| avoidance.allows(set.action(*x)));
        let actions: Vec<usize> = chunk.iter().map(|c| c.1).filter(allowed).collect();
        let gains: Vec<(usize, f64)> = actions
            .iter()
            .zip(duel.moments.variances(&actions))
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
    // The first block usually rules out most of the rest, which saves sorting it.
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
    top.map(|(_, x)| set.action(x))
}

/// The action to propose: the maximiser over some random lines through the best action in the first trials, if the
/// settings have lines, and otherwise over the whole grid, or over candidates if the grid is too large.
pub(crate) fn proposal(
    posterior: &Posterior,
    best: ActionIndex,
    pending: &[ActionIndex],
    forbidden: &ForbiddenActions<'_>,
    random: &mut Random,
) -> Option<ActionIndex> {
    let lines = posterior.settings().lines;
    if lines > 0 && posterior.settings().line_trials.is_none_or(|most| posterior.visited().len() < most) {
        let candidates: Vec<ActionIndex> =
            (0..lines).flat_map(|_| line_points::through(posterior.space(), best, random)).collect();
        if let Some(action) = against(posterior, best, forbidden, pending, Some(&candidates)) {
            return Some(action);
        }
    }
    if posterior.space().enumerable().is_ok() {
        return against(posterior, best, forbidden, pending, None);
    }
    let candidates = near_best_or_random(posterior, best, forbidden, CANDIDATES, random);
    against(posterior, best, forbidden, pending, Some(&candidates))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::excluded::ExcludedActions;
    use crate::feedback::{Feedback, FeedbackLog};
    use crate::search_space::{Dimension, SearchSpace};
    use crate::settings::{Labels, LearnerSettings, Method};
    use crate::special_functions;
    use crate::utility_inference::posterior;

    #[test]
    fn pruned_search_finds_the_exact_maximiser() {
        let dimensions = [3, 4, 3, 5]
            .iter()
            .enumerate()
            .map(|(d, &n)| Dimension { name: d.to_string(), values: (0..n).map(f64::from).collect(), lengthscale: 1.3 })
            .collect();
        let space = SearchSpace::new(dimensions).unwrap();
        for seed in 1..=5 {
            let settings = LearnerSettings {
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
            let posterior = posterior(&space, &log, &settings).unwrap();
            let best = posterior.best().unwrap();
            let excluded = ExcludedActions::default();
            let forbidden = ForbiddenActions::new(&space, log.visited.iter().copied(), &excluded);
            let incumbent = posterior.utility.view(best, space.levels(best));
            let mut top = (0.0, ActionIndex(0));
            for action in (0..space.len()).map(ActionIndex).filter(|a| !forbidden.contains(*a)) {
                let (mean, variance) =
                    posterior.utility.difference(&posterior.utility.view(action, space.levels(action)), &incumbent);
                let chance = posterior.feasibility.as_ref().map_or(1.0, |feasibility| {
                    let view = feasibility.view(action, space.levels(action));
                    special_functions::normal_cdf(view.mean / feasibility.variance(&view).sqrt())
                });
                let gain = expected_gain(mean, variance) * chance;
                if gain > top.0 {
                    top = (gain, action);
                }
            }
            assert_eq!(against(&posterior, best, &forbidden, &[], None), Some(top.1));
        }
    }

    /// A log of random comparisons and labels; each action converges with this probability.
    fn random_log(space: &SearchSpace, actions: usize, converges: f64, seed: u64) -> FeedbackLog {
        let mut random = Random::new(seed, 0);
        let mut log = FeedbackLog::default();
        while log.visited.len() < actions {
            let action = ActionIndex(random.below(space.len()));
            if log.visited.contains(&action) {
                continue;
            }
            if let Some(&other) = log.visited.last() {
                let (winner, loser) = if random.uniform() < 0.5 { (action, other) } else { (other, action) };
                log.feedback.push(Feedback::Preference { winner, loser });
            }
            log.feedback.push(Feedback::Label { action, category: usize::from(random.uniform() < converges) });
            log.visited.push(action);
        }
        log
    }

    fn space_of(levels: &[i32]) -> SearchSpace {
        let dimension = |(d, &n): (usize, &i32)| {
            let values = (0..n).map(f64::from).collect();
            Dimension { name: d.to_string(), values, lengthscale: 1.3 }
        };
        SearchSpace::new(levels.iter().enumerate().map(dimension).collect()).unwrap()
    }

    #[test]
    fn list_of_all_actions_has_the_maximiser_of_the_grid() {
        let space = space_of(&[3, 4, 3, 5]);
        for (seed, converges) in [(1, 0.7), (2, 0.7), (3, 0.0), (4, 0.7), (5, 0.5)] {
            let avoidance = (seed == 4).then_some(-0.2);
            let settings = LearnerSettings { avoidance, nugget: 0.01, ..LearnerSettings::of(Method::Eubo) };
            let log = random_log(&space, 20, converges, seed);
            let posterior = posterior(&space, &log, &settings).unwrap();
            let best = posterior.best().unwrap();
            let pending = [ActionIndex(5), ActionIndex(77), ActionIndex(130)];
            let excluded = ExcludedActions::default();
            let forbidden = ForbiddenActions::new(&space, log.visited.iter().chain(&pending).copied(), &excluded);
            let avoidance = Avoidance::of(&posterior);
            let all: Vec<ActionIndex> = (0..space.len()).rev().map(ActionIndex).collect();
            let [on_grid, on_list] = [ActionSet::Grid(180), ActionSet::list(all)]
                .map(|set| maximiser(&posterior, &set, best, &forbidden, &pending, None, avoidance.as_ref()));
            assert!(on_grid.is_some());
            assert_eq!(on_grid, on_list, "{seed}");
        }
    }

    #[test]
    fn grids_too_large_to_enumerate_have_the_same_objective() {
        let space = space_of(&[30, 40, 30, 50]);
        for (seed, converges) in [(1, 0.5), (2, 0.5), (3, 0.5), (4, 0.0), (5, 0.0)] {
            let settings = LearnerSettings { lines: 0, ordinal_noise: 1.0, ..LearnerSettings::of(Method::Eubo) };
            let log = random_log(&space, 20, converges, seed);
            let posterior = posterior(&space, &log, &settings).unwrap();
            let best = posterior.best().unwrap();
            let excluded = ExcludedActions::default();
            let forbidden = ForbiddenActions::new(&space, log.visited.iter().copied(), &excluded);
            let mut random = Random::new(seed, 20);
            let candidates = near_best_or_random(&posterior, best, &forbidden, CANDIDATES, &mut random);
            let incumbent = posterior.utility.view(best, space.levels(best));
            let feasibility = posterior.feasibility.as_ref().unwrap();
            let value = |&action: &ActionIndex| {
                let levels = space.levels(action);
                let (mean, variance) =
                    posterior.utility.difference(&posterior.utility.view(action, levels.clone()), &incumbent);
                let view = feasibility.view(action, levels);
                let chance = special_functions::normal_cdf(view.mean / feasibility.variance(&view).sqrt());
                // Any feasible action is better than an infeasible incumbent.
                if posterior.infeasible.contains(&best) { chance } else { chance * expected_gain(mean, variance) }
            };
            let highest = candidates.iter().map(value).fold(0.0, f64::max);
            let proposed = crate::propose::propose(&space, &log, &[], &settings, seed).unwrap().action;
            assert!(value(&proposed) >= highest * (1.0 - 1e-9), "{seed}: {} {highest}", value(&proposed));
        }
    }
}
