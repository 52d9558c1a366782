//! What to try next.

use std::collections::HashSet;

use serde::{Deserialize, Serialize};

use crate::acquisition::avoidance::Avoidance;
use crate::acquisition::information::{InformationGain, Pair};
use crate::acquisition::{eubo, line, thompson};
use crate::error::{LearnerError, Result};
use crate::feedback::FeedbackLog;
use crate::grid::Grid;
use crate::posterior::{Learner, Posterior};
use crate::random::Random;
use crate::settings::{LearnerSettings, Method, Partner, Start};
use crate::space::{ActionIndex, SearchSpace};

/// Why an action is proposed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum ProposalReason {
    /// Nothing was tried yet.
    FirstAction,
    /// The method draws at random.
    RandomAction,
    /// Highest of a Thompson draw over the untried actions of a line through the best one.
    ThompsonOnLine,
    /// Highest expected utility of the better of it and the best action so far.
    ExpectedBestUtility,
    /// Highest of one joint draw over the whole grid.
    JointThompson,
    /// Its answers would tell most about the utility.
    InformationGain,
    /// No line through the best action held a candidate: a uniformly random untried action, or, where actions may be
    /// repeated and all were tried, one that is not pending.
    LinesExhausted,
}

/// An action to try.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Proposal {
    /// What to try.
    pub action: ActionIndex,
    /// Why.
    pub reason: ProposalReason,
    /// The best action so far, if any was tried.
    pub best: Option<ActionIndex>,
}

/// Lines drawn before a random action is taken instead.
const MAX_LINES: usize = 200;

/// Proposes one action that is not pending and, unless the settings let LineCoSpar repeat, was not tried.
///
/// # Errors
/// When a setting is out of range, the log does not fit the space, or no such action is left
/// ([`LearnerError::Exhausted`]).
pub fn propose(
    space: &SearchSpace,
    log: &FeedbackLog,
    pending: &[ActionIndex],
    settings: &LearnerSettings,
    seed: u64,
) -> Result<Proposal> {
    Learner::default().propose(space, log, pending, settings, seed)
}

impl Learner {
    /// As [`propose`].
    ///
    /// # Errors
    /// As [`propose`].
    pub fn propose(
        &mut self,
        space: &SearchSpace,
        log: &FeedbackLog,
        pending: &[ActionIndex],
        settings: &LearnerSettings,
        seed: u64,
    ) -> Result<Proposal> {
        propose_from(&self.posterior(space, log, settings)?, pending, seed)
    }
}

/// Proposes `settings.samples_per_iteration` different actions for as many workers, fewer when fewer are left.
///
/// # Errors
/// As [`propose`].
pub fn propose_batch(
    space: &SearchSpace,
    log: &FeedbackLog,
    pending: &[ActionIndex],
    settings: &LearnerSettings,
    seed: u64,
) -> Result<Vec<Proposal>> {
    Learner::default().propose_batch(space, log, pending, settings, seed)
}

impl Learner {
    /// As [`propose_batch`].
    ///
    /// # Errors
    /// As [`propose_batch`].
    pub fn propose_batch(
        &mut self,
        space: &SearchSpace,
        log: &FeedbackLog,
        pending: &[ActionIndex],
        settings: &LearnerSettings,
        seed: u64,
    ) -> Result<Vec<Proposal>> {
        let belief = self.posterior(space, log, settings)?;
        let mut pending = pending.to_vec();
        let mut proposals = Vec::new();
        for _ in 0..settings.samples_per_iteration {
            match propose_from(&belief, &pending, seed) {
                Ok(proposal) => {
                    pending.push(proposal.action);
                    proposals.push(proposal);
                }
                Err(LearnerError::Exhausted { .. }) if !proposals.is_empty() => break,
                Err(error) => return Err(error),
            }
        }
        Ok(proposals)
    }
}

fn propose_from(belief: &Posterior, pending: &[ActionIndex], seed: u64) -> Result<Proposal> {
    let space = belief.space();
    for &action in pending {
        space.check(action)?;
    }
    let taken: HashSet<ActionIndex> = belief.visited().iter().chain(pending).copied().collect();
    let settings = belief.settings();
    let repeats = settings.repeats && settings.method == Method::LineCoSpar;
    let barred = if repeats { pending.iter().copied().collect::<HashSet<_>>().len() } else { taken.len() };
    if barred as u64 >= space.len() {
        return Err(LearnerError::Exhausted { actions: space.len() });
    }
    let mut random = Random::new(seed, (belief.visited().len() + pending.len()) as u64);
    let Some(best) = belief.best() else {
        let action = match centre(space)? {
            centre if belief.settings().start == Start::Centre && !taken.contains(&centre) => centre,
            _ => random_untried(space, &taken, &mut random),
        };
        return Ok(Proposal { action, reason: ProposalReason::FirstAction, best: None });
    };
    let enumerable = space.enumerable().is_ok();
    let (action, reason) = match belief.settings().method {
        Method::Eubo if !enumerable => {
            (best_candidate(belief, best, &taken, &mut random), ProposalReason::ExpectedBestUtility)
        }
        Method::Thompson if !enumerable => {
            let mut candidates = candidates(belief, best, &taken, THOMPSON_CANDIDATES, &mut random);
            if let Some(avoidance) = Avoidance::of(belief)
                && candidates.iter().any(|&action| avoidance.allows(action))
            {
                candidates.retain(|&action| avoidance.allows(action));
            }
            let draw = belief.sampler(&candidates)?.draw(&mut random);
            (highest(&candidates, &draw), ProposalReason::JointThompson)
        }
        Method::LineCoSpar => line_cospar(belief, best, pending, &taken, &mut random)?,
        Method::Eubo => match on_lines(belief, best, pending, &taken, &mut random) {
            Some(action) => (action, ProposalReason::ExpectedBestUtility),
            None => return Err(LearnerError::Exhausted { actions: space.len() }),
        },
        Method::Thompson => match thompson(belief, &taken, &mut random)? {
            Some(action) => (action, ProposalReason::JointThompson),
            None => return Err(LearnerError::Exhausted { actions: space.len() }),
        },
        Method::InformationGain => (informative(belief, best, &taken, &mut random), ProposalReason::InformationGain),
        Method::Random => (random_untried(space, &taken, &mut random), ProposalReason::RandomAction),
    };
    Ok(Proposal { action, reason, best: Some(best) })
}

/// Actions on which EUBO looks where the grid is too large to look at every one.
const EUBO_CANDIDATES: usize = 2000;
/// Actions on which a joint draw is taken where the grid is too large for all.
const THOMPSON_CANDIDATES: usize = 200;

/// The action with the highest value, the first of equals.
fn highest(actions: &[ActionIndex], values: &[f64]) -> ActionIndex {
    let start = (actions[0], f64::NEG_INFINITY);
    actions.iter().zip(values).fold(start, |top, (&a, &f)| if f > top.1 { (a, f) } else { top }).0
}

/// Untried actions of 20 lines through the best, then random ones; at least one.
fn candidates(
    belief: &Posterior,
    best: ActionIndex,
    taken: &HashSet<ActionIndex>,
    count: usize,
    random: &mut Random,
) -> Vec<ActionIndex> {
    let space = belief.space();
    let mut seen = HashSet::new();
    let mut chosen: Vec<ActionIndex> = (0..20).flat_map(|_| line::through(space, best, random)).collect();
    chosen.extend((0..count).map(|_| random_untried(space, taken, random)));
    chosen.retain(|action| !taken.contains(action) && seen.insert(*action));
    chosen.truncate(count);
    chosen
}

/// EUBO over candidates instead of the whole grid.
fn best_candidate(
    belief: &Posterior,
    best: ActionIndex,
    taken: &HashSet<ActionIndex>,
    random: &mut Random,
) -> ActionIndex {
    let space = belief.space();
    let candidates = candidates(belief, best, taken, EUBO_CANDIDATES, random);
    let avoidance = Avoidance::of(belief);
    let incumbent = belief.utility.view(best, space.levels(best));
    let values: Vec<f64> = candidates
        .iter()
        .map(|&action| {
            let (mean, variance) =
                belief.utility.difference(&belief.utility.view(action, space.levels(action)), &incumbent);
            if avoidance.as_ref().is_some_and(|avoidance| !avoidance.allows(action)) {
                // Below every gain.
                return -1.0;
            }
            let chance = match &belief.feasibility {
                Some(_) => belief.probability_of_converging(action).unwrap_or(1.0),
                None => 1.0,
            };
            eubo::expected_gain(mean, variance) * chance
        })
        .collect();
    highest(&candidates, &values)
}

/// The untried action with the highest joint draw, of those outside the region of avoidance if there are any.
fn thompson(belief: &Posterior, taken: &HashSet<ActionIndex>, random: &mut Random) -> Result<Option<ActionIndex>> {
    let space = belief.space();
    let grid = Grid::new(space, &belief.utility);
    let draw = thompson::draw(space, &belief.utility, &grid, random)?;
    let mut ranked: Vec<(f64, ActionIndex)> =
        draw.into_iter().zip((0..).map(ActionIndex)).filter(|(_, action)| !taken.contains(action)).collect();
    ranked.sort_unstable_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    let avoidance = Avoidance::of(belief);
    let allowed =
        ranked.iter().find(|(_, action)| avoidance.as_ref().is_none_or(|avoidance| avoidance.allows(*action)));
    Ok(allowed.or(ranked.first()).map(|&(_, action)| action))
}

/// Random actions among which the most informative is sought, as ROIAL does.
const INFORMATION_CANDIDATES: usize = 500;

/// The most informative of 500 random untried actions, of those outside the region of avoidance if there are any.
fn informative(
    belief: &Posterior,
    best: ActionIndex,
    taken: &HashSet<ActionIndex>,
    random: &mut Random,
) -> ActionIndex {
    let space = belief.space();
    let gain = InformationGain::new(belief.settings(), random);
    let avoidance = Avoidance::of(belief);
    let partner = match belief.settings().partner {
        Partner::Previous => belief.visited().last().copied().unwrap_or(best),
        Partner::Incumbent | Partner::Every => best,
    };
    let utility = &belief.utility;
    let other = utility.view(partner, space.levels(partner));
    let other_variance = utility.variance(&other);
    // A partner in the lowest category loses to whatever is not: that tells nothing of the utility.
    let compared = belief.feasibility.is_none() || !belief.infeasible.contains(&partner);
    let mut top: Option<((bool, f64), ActionIndex)> = None;
    for _ in 0..INFORMATION_CANDIDATES {
        let action = random_untried(space, taken, random);
        let view = utility.view(action, space.levels(action));
        let pair = Pair {
            mean: [view.mean, other.mean],
            variance: [utility.variance(&view), other_variance],
            covariance: utility.covariance(&view, &other),
            compared,
        };
        let feasibility = belief.feasibility.as_ref().map(|belief| {
            let view = belief.view(action, space.levels(action));
            (view.mean, belief.variance(&view))
        });
        let rank = (avoidance.as_ref().is_none_or(|avoidance| avoidance.allows(action)), gain.of(&pair, feasibility));
        if top.is_none_or(|(highest, _)| rank > highest) {
            top = Some((rank, action));
        }
    }
    top.map_or(best, |(_, action)| action)
}

/// EUBO on some random lines through the best action, or, where they hold nothing untried, on the whole grid.
fn on_lines(
    belief: &Posterior,
    best: ActionIndex,
    pending: &[ActionIndex],
    taken: &HashSet<ActionIndex>,
    random: &mut Random,
) -> Option<ActionIndex> {
    let lines = belief.settings().lines;
    if lines > 0 && belief.visited().len() < belief.settings().line_trials {
        let candidates: Vec<ActionIndex> =
            (0..lines).flat_map(|_| line::through(belief.space(), best, random)).collect();
        if let Some(action) = eubo::against(belief, best, taken, pending, Some(&candidates)) {
            return Some(action);
        }
    }
    eubo::against(belief, best, taken, pending, None)
}

/// The middle level of every dimension, the lower of two.
fn centre(space: &SearchSpace) -> Result<ActionIndex> {
    space.index_of_levels(&space.shape().iter().map(|n| (n - 1) / 2).collect::<Vec<_>>())
}

/// A uniformly random action outside `taken`, which must not hold the whole space.
fn random_untried(space: &SearchSpace, taken: &HashSet<ActionIndex>, random: &mut Random) -> ActionIndex {
    let mut sorted: Vec<u64> = taken.iter().map(|a| a.0).collect();
    sorted.sort_unstable();
    let mut index = random.below(space.len() - sorted.len() as u64);
    for taken in sorted {
        if taken <= index {
            index += 1;
        }
    }
    ActionIndex(index)
}

fn line_cospar(
    belief: &Posterior,
    best: ActionIndex,
    pending: &[ActionIndex],
    taken: &HashSet<ActionIndex>,
    random: &mut Random,
) -> Result<(ActionIndex, ProposalReason)> {
    let space = belief.space();
    if belief.settings().repeats {
        return line_with_repeats(belief, best, pending, taken, random);
    }
    let suggested: Vec<ActionIndex> =
        belief.utility.model().points.iter().copied().filter(|a| !taken.contains(a)).collect();
    let avoidance = Avoidance::of(belief);
    for attempt in 0..MAX_LINES {
        let mut candidates = suggested.clone();
        for action in line::through(space, best, random) {
            if !taken.contains(&action) && !candidates.contains(&action) {
                candidates.push(action);
            }
        }
        if let Some(avoidance) = avoidance.as_ref().filter(|_| attempt < MAX_LINES / 2) {
            candidates.retain(|&action| avoidance.allows(action));
        }
        if candidates.is_empty() {
            continue;
        }
        let draw = belief.sampler(&candidates)?.draw(random);
        return Ok((highest(&candidates, &draw), ProposalReason::ThompsonOnLine));
    }
    Ok((random_untried(space, taken, random), ProposalReason::LinesExhausted))
}

/// The published draw over visited actions and line, repeated until it avoids the buffered and pending ones.
fn line_with_repeats(
    belief: &Posterior,
    best: ActionIndex,
    pending: &[ActionIndex],
    taken: &HashSet<ActionIndex>,
    random: &mut Random,
) -> Result<(ActionIndex, ProposalReason)> {
    let space = belief.space();
    let model = belief.utility.model();
    let avoidance = Avoidance::of(belief);
    let allowed = |action: ActionIndex| avoidance.as_ref().is_none_or(|avoidance| avoidance.allows(action));
    let line: Vec<ActionIndex> = line::through(space, best, random)
        .into_iter()
        .filter(|&action| model.slot(action).is_none() && allowed(action))
        .collect();
    // The best action so far can always be tried again: somebody may have to stand on firm ground.
    let barred: HashSet<ActionIndex> =
        model.points.iter().copied().filter(|&action| action != best && !allowed(action)).collect();
    let levels: Vec<Vec<usize>> = line.iter().map(|&a| space.levels(a)).collect();
    let buffered: Vec<ActionIndex> = belief.visited().iter().rev().take(belief.settings().buffer).copied().collect();
    let mut chosen = None;
    for _ in 0..50 {
        let (points, others) = belief.utility.draw(&levels, random)?;
        let all = model.points.iter().zip(&points).chain(line.iter().zip(&others));
        let start = (None, f64::NEG_INFINITY);
        chosen = all
            .filter(|(action, _)| !pending.contains(action) && !barred.contains(action))
            .fold(start, |top, (&a, &f)| if f > top.1 { (Some(a), f) } else { top })
            .0;
        if chosen.is_none_or(|chosen| !buffered.contains(&chosen)) {
            break;
        }
    }
    let Some(chosen) = chosen else {
        let all_tried = taken.len() as u64 >= space.len();
        let awaited: HashSet<ActionIndex> = pending.iter().copied().collect();
        let action = random_untried(space, if all_tried { &awaited } else { taken }, random);
        return Ok((action, ProposalReason::LinesExhausted));
    };
    Ok((chosen, ProposalReason::ThompsonOnLine))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::feedback::Feedback;
    use crate::settings::Labels;
    use crate::space::Dimension;

    fn grid() -> SearchSpace {
        let dimensions = [3, 4, 3]
            .iter()
            .enumerate()
            .map(|(d, &n)| Dimension { name: d.to_string(), values: (0..n).map(f64::from).collect(), lengthscale: 1.0 })
            .collect();
        SearchSpace::new(dimensions).unwrap()
    }

    #[test]
    fn every_action_is_proposed_once_and_the_best_is_found() {
        let space = grid();
        let utility = |a: ActionIndex| {
            let levels = space.levels(a);
            -(levels[0] as f64 - 1.0).powi(2) - (levels[1] as f64 - 2.0).powi(2) - (levels[2] as f64).powi(2)
        };
        for method in [Method::LineCoSpar, Method::Eubo, Method::Thompson, Method::InformationGain, Method::Random] {
            let settings = LearnerSettings { repeats: false, ..LearnerSettings::of(method) };
            let mut log = FeedbackLog::default();
            for trial in 0..space.len() {
                let proposal = propose(&space, &log, &[], &settings, 5).unwrap();
                assert_eq!(proposal, propose(&space, &log, &[], &settings, 5).unwrap());
                assert!(!log.visited.contains(&proposal.action), "{method:?} repeats at {trial}");
                for question in comparisons(&space, &log, proposal.action, &settings) {
                    let (a, b) = (proposal.action, question);
                    let (winner, loser) = if utility(a) > utility(b) { (a, b) } else { (b, a) };
                    if utility(a) == utility(b) {
                        log.feedback.push(Feedback::Tie { a, b });
                    } else {
                        log.feedback.push(Feedback::Preference { winner, loser });
                    }
                }
                log.visited.push(proposal.action);
            }
            assert!(matches!(propose(&space, &log, &[], &settings, 5), Err(LearnerError::Exhausted { .. })));
            let best = crate::posterior::posterior(&space, &log, &settings).unwrap().best().unwrap();
            assert_eq!(space.levels(best), [1, 2, 0], "{method:?}");
        }
    }

    fn comparisons(
        space: &SearchSpace,
        log: &FeedbackLog,
        action: ActionIndex,
        settings: &LearnerSettings,
    ) -> Vec<ActionIndex> {
        let questions = crate::ask::comparisons_to_ask(space, log, action, settings).unwrap();
        questions.into_iter().map(|q| q.against).collect()
    }

    #[test]
    fn the_region_of_avoidance_binds_every_method_but_random_while_anything_is_left() {
        let space = grid();
        // Nothing with the highest level of the second dimension converges, everything else does.
        let converges = |action: ActionIndex| space.levels(action)[1] < 3;
        for method in [Method::LineCoSpar, Method::Eubo, Method::Thompson, Method::InformationGain] {
            for (labels, repeats) in [
                (Labels::InUtility, false),
                (Labels::Separate, false),
                (Labels::InUtility, true),
                (Labels::Separate, true),
            ] {
                let settings =
                    LearnerSettings { labels, repeats, avoidance: Some(-0.3), ..LearnerSettings::of(method) };
                let mut log = FeedbackLog::default();
                for action in (0..space.len()).step_by(2).map(ActionIndex) {
                    log.feedback.push(Feedback::Label { action, category: usize::from(converges(action)) });
                    log.visited.push(action);
                }
                let belief = crate::posterior::posterior(&space, &log, &settings).unwrap();
                let avoidance = Avoidance::of(&belief).unwrap();
                let outside = (0..space.len()).map(ActionIndex).filter(|&a| avoidance.allows(a)).count();
                assert!((1..36).contains(&outside), "{outside} {settings:?}");
                let mut free =
                    (0..space.len()).map(ActionIndex).filter(|a| !log.visited.contains(a) && avoidance.allows(*a));
                assert!(free.next().is_some());
                for seed in 0..20 {
                    let proposal = propose(&space, &log, &[], &settings, seed).unwrap();
                    assert!(avoidance.allows(proposal.action), "{} {settings:?}", proposal.action);
                }
                // When everything that is left lies inside, something is proposed nevertheless.
                let pending: Vec<ActionIndex> =
                    (0..space.len()).map(ActionIndex).filter(|&a| avoidance.allows(a)).collect();
                assert!(space.contains(propose(&space, &log, &pending, &settings, 1).unwrap().action));
            }
        }
    }

    #[test]
    fn where_actions_may_be_repeated_only_pending_ones_exhaust_the_space() {
        let space = grid();
        let settings = LearnerSettings { samples_per_iteration: 5, ..LearnerSettings::published(Method::LineCoSpar) };
        let all: Vec<ActionIndex> = (0..space.len()).map(ActionIndex).collect();
        let better = |pair: &[ActionIndex]| Feedback::Preference { winner: pair[1], loser: pair[0] };
        for feedback in [Vec::new(), all.windows(2).map(better).collect()] {
            let log = FeedbackLog { visited: all.clone(), feedback };
            let batch = propose_batch(&space, &log, &[], &settings, 3).unwrap();
            let distinct: HashSet<ActionIndex> = batch.iter().map(|p| p.action).collect();
            assert_eq!(distinct.len(), 5);
            // One action is left that is not pending, then none.
            let proposal = propose(&space, &log, &all[1..], &settings, 3).unwrap();
            assert_eq!(proposal.action, all[0]);
            assert_eq!(
                propose(&space, &log, &all, &settings, 3),
                Err(LearnerError::Exhausted { actions: space.len() })
            );
        }
    }

    #[test]
    fn batches_hold_different_actions() {
        let space = grid();
        let settings = LearnerSettings { samples_per_iteration: 8, repeats: false, ..LearnerSettings::default() };
        let log = FeedbackLog { visited: vec![ActionIndex(0)], feedback: vec![] };
        let pending = [ActionIndex(3), ActionIndex(7)];
        let mut batch: Vec<_> =
            propose_batch(&space, &log, &pending, &settings, 1).unwrap().into_iter().map(|p| p.action).collect();
        batch.extend(pending);
        batch.push(ActionIndex(0));
        batch.sort_unstable();
        batch.dedup();
        assert_eq!(batch.len(), 11);
    }
}
