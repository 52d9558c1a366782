//! Candidate actions: random ones, and ones near the best action.

use std::collections::HashSet;

use crate::acquisition::line;
use crate::action::ActionIndex;
use crate::posterior::Posterior;
use crate::random::Random;
use crate::search_space::SearchSpace;

/// Number of lines through the best action among the candidates of a large grid.
const LINES: usize = 20;

/// A uniformly random action outside `taken`, which must not be the whole space.
pub(crate) fn random_untaken(space: &SearchSpace, taken: &HashSet<ActionIndex>, random: &mut Random) -> ActionIndex {
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

/// 1 to `count` actions outside `taken`: those of some lines through the best action, then random ones.
pub(crate) fn near_best_or_random(
    posterior: &Posterior,
    best: ActionIndex,
    taken: &HashSet<ActionIndex>,
    count: usize,
    random: &mut Random,
) -> Vec<ActionIndex> {
    let space = posterior.space();
    let mut seen = HashSet::new();
    let mut chosen: Vec<ActionIndex> = (0..LINES).flat_map(|_| line::through(space, best, random)).collect();
    chosen.extend((0..count).map(|_| random_untaken(space, taken, random)));
    chosen.retain(|action| !taken.contains(action) && seen.insert(*action));
    chosen.truncate(count);
    chosen
}

/// The action with the highest value; the first of several. `actions` must not be empty.
pub(crate) fn highest(actions: &[ActionIndex], values: &[f64]) -> ActionIndex {
    let start = (actions[0], f64::NEG_INFINITY);
    actions.iter().zip(values).fold(start, |top, (&a, &f)| if f > top.1 { (a, f) } else { top }).0
}
