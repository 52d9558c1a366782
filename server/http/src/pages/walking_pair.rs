//! Two gaits that walk side by side, or one behind the other.

use gait_optimizer::gait::stick_figure::stick_figures;
use gait_optimizer::{Gait, ModelError};
use gaitwright_charts::{GaitWalker, stride_pictures};
use gaitwright_store::TrialId;

/// One gait of the pair.
pub(super) struct WalkingGait {
    pub(super) trial: TrialId,
    pub(super) number: u32,
    pub(super) name: String,
    /// The walker, which a script moves, with the other gait behind it.
    pub(super) walker: String,
    /// The stride in pictures, for readers without scripts or with reduced motion.
    pub(super) tiles: String,
    pub(super) has_muscles: bool,
}

/// Two gaits with their trials and names.
///
/// # Errors
/// [`ModelError`] if subject or device of a gait is invalid.
pub(super) fn walking_pair([a, b]: [(TrialId, u32, String, &Gait); 2]) -> Result<[WalkingGait; 2], ModelError> {
    let (walker_a, walker_b) = (GaitWalker::new(a.3)?, GaitWalker::new(b.3)?);
    let (ghost_a, ghost_b) = (walker_a.as_ghost(), walker_b.as_ghost());
    let shown = |(trial, number, name, gait): (TrialId, u32, String, &Gait), walker: &GaitWalker| {
        Ok::<_, ModelError>(WalkingGait {
            walker: walker.svg(&format!("{name}, walking")),
            tiles: stride_pictures(&stick_figures(gait)?),
            has_muscles: gait.muscles,
            trial,
            number,
            name,
        })
    };
    Ok([shown(a, &walker_a.with_ghost(ghost_b))?, shown(b, &walker_b.with_ghost(ghost_a))?])
}
