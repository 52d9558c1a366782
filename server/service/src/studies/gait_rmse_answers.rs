//! The preferences that Gait RMSE implies where it answers in place of people.

use super::snapshot::StudySnapshot;
use super::tie_break::{BrokenTie, ComparedGait};
use crate::error::Error;
use gait_learner::{LearnerError, proposed_comparisons_among};
use gaitwright_compute::OnPool;
use gaitwright_store::TrialId;
use gaitwright_store::feedback::FeedbackContent;
use gaitwright_store::studies::{AnswerSource, SimulatedWalks};

/// A computed answer.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct ComputedAnswer {
    /// Content of the answer.
    pub(super) content: FeedbackContent,
    /// Its reason; empty if Gait RMSE alone decided.
    pub(super) note: String,
}

/// The preferences about a new converged trial; none if people answer. `snapshot` does not have the result of the new
/// trial yet.
///
/// # Errors
/// When the learner cannot work with the log.
pub(super) fn gait_rmse_answers(
    pool: &OnPool,
    snapshot: &StudySnapshot,
    new: TrialId,
    gait_rmse_rad: f64,
    mean_strides: Option<f64>,
) -> Result<Vec<ComputedAnswer>, Error> {
    let plan = &snapshot.study.plan;
    if plan.answer_source == AnswerSource::People {
        return Ok(Vec::new());
    }
    let Some(number) = snapshot.trial(new).map(|trial| trial.number) else { return Ok(Vec::new()) };
    let new = ComparedGait { trial: new, number, gait_rmse_rad, mean_strides };
    let partners = partners(pool, snapshot, new.trial).map_err(Error::Learner)?;
    let answer = |id| Some(answer(&plan.simulated_walks, new, ComparedGait::of(snapshot.trial(id)?)?));
    Ok(partners.into_iter().filter_map(answer).collect())
}

/// The earlier converged trials that a new converged trial is compared with: the best one or the latest ones, depending
/// on the settings of the learner. `snapshot` does not have the result of the new trial yet.
///
/// # Errors
/// When the learner cannot work with the log.
fn partners(_: &OnPool, snapshot: &StudySnapshot, new: TrialId) -> Result<Vec<TrialId>, LearnerError> {
    let Some(new) = snapshot.trial(new) else { return Ok(Vec::new()) };
    let plan = &snapshot.study.plan;
    let comparable = snapshot.comparable();
    let log = snapshot.log();
    let proposed = proposed_comparisons_among(&plan.search_space, &log, new.action_index, &plan.learner, |a| {
        comparable.contains(&a)
    })?;
    Ok(proposed.into_iter().filter_map(|c| snapshot.trial_of(c.against)).map(|trial| trial.id).collect())
}

/// The computed answer about two gaits. The smaller Gait RMSE is better, equal values mean no difference. If simulated
/// walks break ties and the values differ by less than the tolerance, the gait with more strides is better.
pub(super) fn answer(walks: &SimulatedWalks, new: ComparedGait, old: ComparedGait) -> ComputedAnswer {
    match BrokenTie::between(walks, new, old) {
        Some(BrokenTie { winner, loser, reason }) => {
            ComputedAnswer { content: FeedbackContent::Preference { winner, loser }, note: reason }
        }
        None => ComputedAnswer { content: by_gait_rmse(new, old), note: String::new() },
    }
}

fn by_gait_rmse(new: ComparedGait, old: ComparedGait) -> FeedbackContent {
    if new.gait_rmse_rad < old.gait_rmse_rad {
        FeedbackContent::Preference { winner: new.trial, loser: old.trial }
    } else if old.gait_rmse_rad < new.gait_rmse_rad {
        FeedbackContent::Preference { winner: old.trial, loser: new.trial }
    } else {
        FeedbackContent::NoDifference { a: new.trial, b: old.trial }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use gaitwright_store::studies::SimulatedWalksEffect;

    fn gait(number: u32, gait_rmse_rad: f64, mean_strides: Option<f64>) -> ComparedGait {
        ComparedGait { trial: TrialId::fresh(), number, gait_rmse_rad, mean_strides }
    }

    /// Whether the new gait wins, and whether the answer names simulated walks.
    fn decided(effect: SimulatedWalksEffect, new: ComparedGait, old: ComparedGait) -> (Option<bool>, bool) {
        let walks = SimulatedWalks { effect, gait_rmse_tolerance_rad: 0.05, ..SimulatedWalks::default() };
        let ComputedAnswer { content, note } = answer(&walks, new, old);
        let new_wins = match content {
            FeedbackContent::Preference { winner, .. } => Some(winner == new.trial),
            _ => None,
        };
        (new_wins, note.contains("simulated walks decide"))
    }

    #[test]
    fn gaits_within_the_tolerance_are_compared_by_their_strides() {
        use SimulatedWalksEffect::{Label, None as Off, Report, TieBreak};
        let worse_but_steady = gait(2, 0.64, Some(9.0));
        let better_but_falls = gait(1, 0.60, Some(2.0));
        assert_eq!(decided(TieBreak, worse_but_steady, better_but_falls), (Some(true), true));
        assert_eq!(decided(TieBreak, better_but_falls, worse_but_steady), (Some(false), true));
        for effect in [Off, Report, Label] {
            assert_eq!(decided(effect, worse_but_steady, better_but_falls), (Some(false), false), "{effect:?}");
        }
    }

    #[test]
    fn gait_rmse_decides_outside_the_tolerance_and_for_equal_or_unknown_strides() {
        let better = gait(1, 0.60, Some(2.0));
        for (other, new_wins) in [
            (gait(2, 0.65, Some(9.0)), Some(false)),
            (gait(2, 0.61, Some(2.0)), Some(false)),
            (gait(2, 0.61, None), Some(false)),
            (gait(2, 0.60, Some(2.0)), None),
        ] {
            assert_eq!(decided(SimulatedWalksEffect::TieBreak, other, better), (new_wins, false), "{other:?}");
        }
    }
}
