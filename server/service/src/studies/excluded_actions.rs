//! The actions that must not be proposed although the study has no result of them.

use super::bound_grid;
use super::snapshot::StudySnapshot;
use gait_learner::ActionIndex;
use gaitwright_store::studies::Evaluation;

/// Actions that are being solved, that failed, or, in a study of a lab script, with the bounds of a gait that was reported
/// as unsafe.
pub(super) fn excluded_without_result(snapshot: &StudySnapshot) -> Vec<ActionIndex> {
    let plan = &snapshot.study.plan;
    let open = snapshot.trials.iter().filter(|trial| !trial.state.is_result()).map(|trial| trial.action_index);
    let unsafe_bounds =
        snapshot.grounds.safety_reports.unsafe_motions.bounds().filter(|_| plan.evaluation == Evaluation::Script);
    let unsafe_actions =
        unsafe_bounds.filter_map(|bounds| bound_grid::action_of(&plan.search_space, plan.base_bounds, bounds));
    open.chain(unsafe_actions).collect()
}
