//! Actions whose gait is known without a solve: a gait of the study is a solution of the action, because the bounds that
//! differ are inactive in it.

use super::snapshot::StudySnapshot;
use gait_learner::{ActionIndex, Dimension, ExcludedActions, LearnerError, SearchSpace};
use gait_optimizer::{TunedBounds, UnchangedBound};
use gaitwright_store::trials::Trial;
use std::ops::Range;

/// The actions of the search space that have the gait of a trial, each trial's own action included. The gait of an open trial is
/// known if an atlas has it.
///
/// # Errors
/// When the action of a trial is not in the search space.
pub(super) fn actions_with_known_gait(snapshot: &StudySnapshot) -> Result<ExcludedActions, LearnerError> {
    let space = &snapshot.study.plan.search_space;
    let mut boxes = Vec::new();
    let of_atlas = |open: &Trial| {
        let mut gaits = snapshot.atlas.iter().filter(|trial| trial.state.has_gait());
        gaits.find(|trial| trial.action_index == open.action_index)
    };
    let open = snapshot.trials.iter().filter(|trial| trial.state.is_open()).filter_map(of_atlas);
    for trial in with_gait(snapshot).chain(open) {
        let unchanged = trial.report.as_ref().map_or(&[][..], |report| &report.unchanged_bounds);
        boxes.push(levels_with_gait(space, space.check(trial.action_index)?, unchanged));
    }
    ExcludedActions::new(space, boxes)
}

/// The levels of each dimension with which the gait of an action stays a solution.
pub(super) fn levels_with_gait(
    space: &SearchSpace,
    action: ActionIndex,
    unchanged: &[UnchangedBound],
) -> Vec<Range<usize>> {
    let levels = |(dimension, own): (&Dimension, usize)| {
        let bound = unchanged.iter().find(|bound| bound.bound == dimension.name);
        bound.map_or(own..own + 1, |bound| levels_of(bound, dimension, own))
    };
    space.dimensions().iter().zip(space.levels(action)).map(levels).collect()
}

/// The tuned bounds that were active in no gait of the study. Empty if there are fewer than two gaits, or if one does not say.
pub fn never_active(snapshot: &StudySnapshot) -> Vec<String> {
    let gaits: Vec<&Trial> = with_gait(snapshot).collect();
    let limits = &snapshot.study.plan.gait_settings.limits;
    let is_inactive = |trial: &Trial, name: &str| {
        let mut bounds = trial.report.iter().flat_map(|report| &report.unchanged_bounds);
        let value = TunedBounds::place_of(name).map(|place| trial.action.to_array()[place]);
        bounds.any(|bound| bound.bound == name && value.is_some_and(|value| !bound.is_active(value, limits)))
    };
    let tuned = snapshot.study.plan.search_space.dimensions().iter().filter(|dimension| dimension.values.len() > 1);
    tuned
        .map(|dimension| dimension.name.clone())
        .filter(|name| gaits.len() > 1 && gaits.iter().all(|trial| is_inactive(trial, name)))
        .collect()
}

fn with_gait(snapshot: &StudySnapshot) -> impl Iterator<Item = &Trial> {
    snapshot.trials.iter().filter(|trial| trial.state.has_gait())
}

/// The levels around `own` with which the gait stays a solution.
fn levels_of(bound: &UnchangedBound, dimension: &Dimension, own: usize) -> Range<usize> {
    let stays = |value: &&f64| bound.contains(**value);
    let (below, above) = dimension.values.split_at(own);
    let fewer = below.iter().rev().take_while(stays).count();
    let more = above.iter().skip(1).take_while(stays).count();
    own - fewer..own + 1 + more
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn levels_of_an_interval_contain_its_own_and_the_neighbours_inside() {
        let dimension = Dimension { name: "a6".to_owned(), values: vec![0.0, 0.1, 0.2, 0.3, 0.4], lengthscale: 0.1 };
        let bound = |least, most| UnchangedBound { bound: "a6".to_owned(), least, most };
        let levels = |least, most| levels_of(&bound(least, most), &dimension, 2);
        assert_eq!(levels(Some(0.2), Some(0.2)), 2..3);
        assert_eq!(levels(Some(0.1), None), 1..5);
        assert_eq!(levels(None, Some(0.39)), 0..4);
        // A report of an archive may have any interval.
        assert_eq!(levels(Some(f64::NAN), Some(0.0)), 2..3);
    }
}
