//! Decisions by simulated walks in a study: the label of a gait, and comparisons of gaits with nearly the same Gait RMSE.

use super::execution::{MAX_SIMULATED_WALKS, NewExecutionReport};
use crate::error::Error;
use gait_optimizer::execution::ExecutionOptions;
use gaitwright_store::studies::{AnswerSource, Evaluation, SimulatedWalks, SimulatedWalksEffect, StudyPlan};
use gaitwright_store::trials::Label;
use serde_json::json;

/// Checks the setting of a study.
///
/// # Errors
/// [`Error::Invalid`] naming the field.
pub(super) fn check(plan: &StudyPlan) -> Result<(), Error> {
    let SimulatedWalks { effect, number_of_simulated_walks, gait_rmse_tolerance_rad, least_mean_strides } =
        plan.simulated_walks;
    if !(1..=MAX_SIMULATED_WALKS).contains(&number_of_simulated_walks) {
        let field = "simulated_walks.number_of_simulated_walks";
        return Err(Error::invalid(field, number_of_simulated_walks, &format!("1 to {MAX_SIMULATED_WALKS}")));
    }
    if !(0.0..=10.0).contains(&gait_rmse_tolerance_rad) {
        let field = "simulated_walks.gait_rmse_tolerance_rad";
        return Err(Error::invalid(field, json!(gait_rmse_tolerance_rad), "0 to 10"));
    }
    let strides = f64::from(ExecutionOptions::default().strides);
    if !(0.0..=strides).contains(&least_mean_strides) {
        let field = "simulated_walks.least_mean_strides";
        return Err(Error::invalid(field, json!(least_mean_strides), &format!("0 to {strides}")));
    }
    if effect != SimulatedWalksEffect::None && plan.evaluation == Evaluation::Script {
        let allowed = "none, because scripts evaluate the trials of this study and their gaits are not stored here";
        return Err(Error::invalid("simulated_walks.effect", effect.as_str(), allowed));
    }
    if effect == SimulatedWalksEffect::TieBreak && plan.answer_source == AnswerSource::People {
        let allowed = "none, report or label, because people answer the comparisons of this study";
        return Err(Error::invalid("simulated_walks.effect", effect.as_str(), allowed));
    }
    Ok(())
}

/// The execution report that a study makes of each gait. All of them have the seed of the study, so that the gaits meet
/// the same disturbances.
pub(super) fn report_of_each_gait(plan: &StudyPlan) -> NewExecutionReport {
    NewExecutionReport { number_of_simulated_walks: plan.simulated_walks.number_of_simulated_walks, seed: plan.seed }
}

/// The label of a converged gait.
pub(super) fn label_of_gait(walks: &SimulatedWalks, mean_strides: Option<f64>) -> Label {
    let too_few = mean_strides.is_some_and(|strides| strides < walks.least_mean_strides);
    if walks.effect == SimulatedWalksEffect::Label && too_few { Label::NotExecutable } else { Label::Converged }
}

/// Why a gait is not executable.
pub(super) fn why_not_executable(walks: &SimulatedWalks, mean_strides: f64) -> String {
    format!(
        "Simulated walks with this gait last {mean_strides:.2} strides on average, fewer than the minimum of {} for an executable gait in this study.",
        walks.least_mean_strides
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    fn walks(effect: SimulatedWalksEffect) -> SimulatedWalks {
        SimulatedWalks { effect, least_mean_strides: 3.0, ..SimulatedWalks::default() }
    }

    #[test]
    fn only_the_label_setting_labels_gaits_and_only_below_its_least_number() {
        for effect in SimulatedWalksEffect::ALL {
            for (strides, is_too_few) in [(None, false), (Some(2.999), true), (Some(3.0), false), (Some(20.0), false)] {
                let labelled = label_of_gait(&walks(effect), strides) == Label::NotExecutable;
                assert_eq!(labelled, effect == SimulatedWalksEffect::Label && is_too_few, "{effect:?} {strides:?}");
            }
        }
    }
}
