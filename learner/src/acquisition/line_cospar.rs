//! LineCoSpar (Tucker et al. 2020): a Thompson sample on a random line through the best action.

use std::collections::HashSet;

use crate::acquisition::avoidance::Avoidance;
use crate::acquisition::candidates::highest;
use crate::acquisition::line_points;
use crate::action::ActionIndex;
use crate::error::Result;
use crate::excluded::{ExcludedActions, ForbiddenActions};
use crate::posterior::Posterior;
use crate::random::Random;

/// Largest number of lines. If none has a candidate, the proposal is a random action.
const MAX_LINES: usize = 200;
/// Largest number of samples that are drawn to find an action outside the buffer.
const MAX_SAMPLES: usize = 50;

/// The highest of a joint sample of the unvisited actions of a line, and of suggested actions that are not visited.
///
/// `None` if no line has a candidate. Respects the region of avoidance in the first half of the lines.
pub(crate) fn unvisited_on_line(
    posterior: &Posterior,
    best: ActionIndex,
    forbidden: &ForbiddenActions<'_>,
    random: &mut Random,
) -> Result<Option<ActionIndex>> {
    let suggested: Vec<ActionIndex> =
        posterior.utility.observed().points.iter().copied().filter(|a| !forbidden.contains(*a)).collect();
    let avoidance = Avoidance::of(posterior);
    for attempt in 0..MAX_LINES {
        let mut candidates = suggested.clone();
        for action in line_points::through(posterior.space(), best, random) {
            if !forbidden.contains(action) && !candidates.contains(&action) {
                candidates.push(action);
            }
        }
        if let Some(avoidance) = avoidance.as_ref().filter(|_| attempt < MAX_LINES / 2) {
            candidates.retain(|&action| avoidance.allows(action));
        }
        if candidates.is_empty() {
            continue;
        }
        let sample = posterior.sampler(&candidates)?.sample(random);
        return Ok(highest(&candidates, &sample));
    }
    Ok(None)
}

/// The published rule: the highest of a joint sample of visited actions and a line, sampled again until it is outside
/// the buffer. Never a pending action; `None` if every candidate is pending.
pub(crate) fn visited_or_on_line(
    posterior: &Posterior,
    best: ActionIndex,
    pending: &[ActionIndex],
    random: &mut Random,
) -> Result<Option<ActionIndex>> {
    let space = posterior.space();
    let observed = posterior.utility.observed();
    let avoidance = Avoidance::of(posterior);
    let allowed = |action: ActionIndex| avoidance.as_ref().is_none_or(|avoidance| avoidance.allows(action));
    let line: Vec<ActionIndex> = line_points::through(space, best, random)
        .into_iter()
        .filter(|&action| observed.slot(action).is_none() && allowed(action))
        .collect();
    // The best action stays a candidate even inside the region of avoidance, so that there is always one.
    let barred: HashSet<ActionIndex> =
        observed.points.iter().copied().filter(|&action| action != best && !allowed(action)).collect();
    let levels: Vec<Vec<usize>> = line.iter().map(|&a| space.levels(a)).collect();
    let buffer = posterior.settings().buffer;
    let buffered: Vec<ActionIndex> = posterior.visited().iter().rev().take(buffer).copied().collect();
    let mut chosen = None;
    for _ in 0..MAX_SAMPLES {
        let (points, others) = posterior.utility.sample(&levels, random)?;
        let all = observed.points.iter().zip(&points).chain(line.iter().zip(&others));
        let start = (None, f64::NEG_INFINITY);
        chosen = all
            .filter(|(action, _)| !pending.contains(action) && !barred.contains(action))
            .fold(start, |top, (&a, &f)| if f > top.1 { (Some(a), f) } else { top })
            .0;
        if chosen.is_none_or(|chosen| !buffered.contains(&chosen)) {
            break;
        }
    }
    Ok(chosen)
}

/// A random action if no line has a candidate. If repeats are allowed and all actions are visited or pending, it may be a
/// visited one. `None` without an action.
pub(crate) fn random_fallback(
    posterior: &Posterior,
    pending: &[ActionIndex],
    forbidden: &ForbiddenActions<'_>,
    repeats: bool,
    random: &mut Random,
) -> Option<ActionIndex> {
    forbidden.random_other(random).or_else(|| {
        let none = ExcludedActions::default();
        let pending = ForbiddenActions::new(posterior.space(), pending.iter().copied(), &none);
        pending.random_other(random).filter(|_| repeats)
    })
}
