//! Thompson sampling: the maximiser of a joint sample of the utility.

use crate::acquisition::avoidance::Avoidance;
use crate::acquisition::candidates::{highest, near_best_or_random};
use crate::action::ActionIndex;
use crate::error::Result;
use crate::excluded::ForbiddenActions;
use crate::grid_sample::posterior_sample;
use crate::posterior::Posterior;
use crate::random::Random;
use crate::whole_grid::WholeGrid;

/// Number of candidates if the grid is too large for a joint sample.
const CANDIDATES: usize = 200;

/// The maximiser over all actions outside `forbidden`, and outside the region of avoidance if possible.
pub(crate) fn over_grid(
    posterior: &Posterior,
    forbidden: &ForbiddenActions<'_>,
    random: &mut Random,
) -> Result<Option<ActionIndex>> {
    let space = posterior.space();
    let grid = WholeGrid::new(space, &posterior.utility);
    let sample = posterior_sample(space, &posterior.utility, &grid, random)?;
    let mut ranked: Vec<(f64, ActionIndex)> =
        sample.into_iter().zip((0..).map(ActionIndex)).filter(|(_, action)| !forbidden.contains(*action)).collect();
    ranked.sort_unstable_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    let avoidance = Avoidance::of(posterior);
    let allowed =
        ranked.iter().find(|(_, action)| avoidance.as_ref().is_none_or(|avoidance| avoidance.allows(*action)));
    Ok(allowed.or(ranked.first()).map(|&(_, action)| action))
}

/// The maximiser over candidates, for a large grid. `None` without a candidate.
pub(crate) fn over_candidates(
    posterior: &Posterior,
    best: ActionIndex,
    forbidden: &ForbiddenActions<'_>,
    random: &mut Random,
) -> Result<Option<ActionIndex>> {
    let mut candidates = near_best_or_random(posterior, best, forbidden, CANDIDATES, random);
    if let Some(avoidance) = Avoidance::of(posterior)
        && candidates.iter().any(|&action| avoidance.allows(action))
    {
        candidates.retain(|&action| avoidance.allows(action));
    }
    if candidates.is_empty() {
        return Ok(None);
    }
    let sample = posterior.sampler(&candidates)?.sample(random);
    Ok(highest(&candidates, &sample))
}
