//! Candidate actions: random ones, and ones near the best action.

use std::collections::HashSet;

use crate::acquisition::line_points;
use crate::action::ActionIndex;
use crate::excluded::ForbiddenActions;
use crate::posterior::Posterior;
use crate::random::Random;

/// Number of lines through the best action among the candidates of a large grid.
const LINES: usize = 20;

/// At most `count` actions outside `forbidden`: those of some lines through the best action, then random ones.
pub(crate) fn near_best_or_random(
    posterior: &Posterior,
    best: ActionIndex,
    forbidden: &ForbiddenActions<'_>,
    count: usize,
    random: &mut Random,
) -> Vec<ActionIndex> {
    let space = posterior.space();
    let mut seen = HashSet::new();
    let mut chosen: Vec<ActionIndex> = (0..LINES).flat_map(|_| line_points::through(space, best, random)).collect();
    chosen.extend((0..count).map_while(|_| forbidden.random_other(random)));
    chosen.retain(|action| !forbidden.contains(*action) && seen.insert(*action));
    chosen.truncate(count);
    chosen
}

/// The action with the highest value; the first of several. `None` without an action.
pub(crate) fn highest(actions: &[ActionIndex], values: &[f64]) -> Option<ActionIndex> {
    let start = (*actions.first()?, f64::NEG_INFINITY);
    Some(actions.iter().zip(values).fold(start, |top, (&a, &f)| if f > top.1 { (a, f) } else { top }).0)
}
