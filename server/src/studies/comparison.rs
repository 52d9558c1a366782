//! Whom to compare a new trial with, and what Gait RMSE answers.

use super::standing::Standing;
use crate::compute::OnPool;
use crate::store::TrialId;
use crate::store::feedback::Said;
use crate::store::trials::{Trial, TrialState};
use gait_learner::{ActionIndex, FeedbackLog, LearnerError, comparisons_to_ask_among};

/// The earlier converged trials that a new converged trial is compared with: the best of them, or the last ones,
/// as the learner's settings say. `standing` is read before the new trial's result is in it.
///
/// # Errors
/// When the learner refuses the log.
pub fn partners(_: &OnPool, standing: &Standing, new: TrialId) -> Result<Vec<TrialId>, LearnerError> {
    let Some(new) = standing.trial(new) else { return Ok(Vec::new()) };
    let plan = &standing.study.plan;
    let comparable = standing.comparable();
    let log = standing.log();
    let questions = comparisons_to_ask_among(&plan.search_space, &log, new.action_index, &plan.learner, |a| {
        comparable.contains(&a)
    })?;
    Ok(questions.into_iter().filter_map(|q| standing.trial_of(q.against)).map(|trial| trial.id).collect())
}

/// What Gait RMSE says about two gaits: the smaller one is better, equal ones tie.
pub fn by_gait_rmse(new: (TrialId, f64), old: (TrialId, f64)) -> Said {
    if new.1 < old.1 {
        Said::Preference { winner: new.0, loser: old.0 }
    } else if old.1 < new.1 {
        Said::Preference { winner: old.0, loser: new.0 }
    } else {
        Said::Tie { a: new.0, b: old.0 }
    }
}

/// Whether two trials gave the very same motion, as when a bound changed that no gait comes near: a person has nothing to
/// compare then. So many figures agree to the last bit in no other case.
fn is_same_gait(one: &Trial, other: &Trial) -> bool {
    let figures = |trial: &Trial| {
        let report = trial.report.as_ref()?;
        let single = [report.objective, report.cost_of_transport, report.stride_length_m];
        let all = single.iter().chain(&report.gait_rmse_parts_rad).chain(&report.durations_s).chain(&report.vhip_m_s);
        Some(all.map(|figure| figure.to_bits()).collect::<Vec<_>>())
    };
    figures(one).is_some_and(|figures_of_one| figures(other) == Some(figures_of_one))
}

/// The pair of trials that a person should compare now, if there is one: the newest converged trial with a
/// partner that nobody has compared it with, and that is another gait.
///
/// # Errors
/// When the learner refuses the log.
pub fn open_question(_: &OnPool, standing: &Standing) -> Result<Option<(TrialId, TrialId)>, LearnerError> {
    let plan = &standing.study.plan;
    let log = standing.log();
    let mut comparable = standing.comparable();
    let Some(&newest) = log.visited.iter().rev().find(|action| comparable.contains(action)) else { return Ok(None) };
    if let Some(own) = standing.trial_of(newest) {
        comparable.retain(|action| {
            *action == newest || !standing.trial_of(*action).is_some_and(|other| is_same_gait(own, other))
        });
    }
    // Whom to compare with follows from what was heard before: else an answer about the newest gait could move the
    // best one, and with it the question.
    let mut before = log.clone();
    before.feedback.retain(|feedback| match feedback.actions() {
        (a, Some(b)) => a != newest && b != newest,
        (_, None) => true,
    });
    let questions =
        comparisons_to_ask_among(&plan.search_space, &before, newest, &plan.learner, |a| comparable.contains(&a))?;
    let converged = |action| standing.trial_of(action).filter(|t| t.state == TrialState::Converged).map(|t| t.id);
    let open = questions.into_iter().filter(|q| !is_answered(&log, q.action, q.against));
    let mut pairs = open.filter_map(|q| Some((converged(q.action)?, converged(q.against)?)));
    Ok(pairs.find(|pair| !standing.objections.is_skipped(*pair)))
}

fn is_answered(log: &FeedbackLog, a: ActionIndex, b: ActionIndex) -> bool {
    log.feedback.iter().any(|feedback| {
        let (first, second) = feedback.actions();
        second.is_some_and(|second| (first, second) == (a, b) || (second, first) == (a, b))
    })
}
