//! How sure a study is of its recommended gait, as one sentence. It uses the values of the page *Analysis*.

use crate::format::{decimal, percent};
use gaitwright_service::studies::analysis::Analysis;
use gaitwright_service::studies::gait_utilities::is_distinguishable;
use gaitwright_service::studies::snapshot::StudySnapshot;
use gaitwright_store::studies::AnswerSource;
use gaitwright_store::trials::Trial;

/// The sentence about the recommended gait. `None` without a recommendation.
pub(super) fn certainty(snapshot: &StudySnapshot, analysis: &Analysis) -> Option<String> {
    if snapshot.waits_for_first_answer() {
        return None;
    }
    match snapshot.study.plan.answer_source {
        AnswerSource::GaitRmse => by_gait_rmse(snapshot, analysis),
        AnswerSource::People | AnswerSource::Both => by_utility(snapshot, analysis),
    }
}

fn by_gait_rmse(snapshot: &StudySnapshot, analysis: &Analysis) -> Option<String> {
    let recommended = snapshot.trial(*analysis.gaits.first()?.trials.first()?)?;
    let own = recommended.gait_rmse_rad?;
    let others = analysis.gaits.iter().skip(1).flat_map(|gait| &gait.trials).filter_map(|id| snapshot.trial(*id));
    let rmse = |trial: &&Trial| trial.gait_rmse_rad.unwrap_or(f64::INFINITY);
    let lowest = others.min_by(|a, b| rmse(a).total_cmp(&rmse(b)));
    Some(match (lowest, analysis.gaits.len()) {
        (None, _) => {
            "The recommended gait is the only gait so far. Its Gait RMSE is computed, not estimated.".to_owned()
        }
        (Some(other), _) if rmse(&other) < own => format!(
            "Trial {} has a lower Gait RMSE, {} rad. The learner recommends the gait with the highest estimated utility. \
             The estimate also uses gaits with similar bounds.",
            other.number,
            decimal(other.gait_rmse_rad)
        ),
        (Some(_), gaits) => {
            format!(
                "The recommended gait has the lowest Gait RMSE of {gaits} different gaits. This is computed from the \
                 gaits, not estimated."
            )
        }
    })
}

fn by_utility(snapshot: &StudySnapshot, analysis: &Analysis) -> Option<String> {
    analysis.gaits.first()?;
    let comparisons = match analysis.agreement.comparisons + analysis.agreement.no_difference {
        1 => "1 comparison".to_owned(),
        all => format!("{all} comparisons"),
    };
    let Some(next) = analysis.gaits.get(1) else {
        return Some("Only one gait can be recommended, so there is nothing to compare it with.".to_owned());
    };
    let (difference, number) = (next.behind?, snapshot.trial(*next.trials.first()?)?.number);
    // Without a line break before the sign.
    let sure = percent(difference.probability_above_zero()).replace(' ', "\u{a0}");
    let gaits = analysis.gaits.len();
    Some(if is_distinguishable(&difference) {
        format!(
            "After {comparisons}, the learner is {sure} sure that the recommended gait is better than that of trial {number}, the \
             next best of {gaits} different gaits."
        )
    } else {
        format!(
            "Too few comparisons to tell: after {comparisons}, the learner is only {sure} sure that the recommended gait is better \
             than that of trial {number}, the next best of {gaits} different gaits."
        )
    })
}
