//! Possible roles of a study with an atlas.

use crate::error::Error;
use gaitwright_store::studies::{AnswerSource, AtlasRole, Evaluation, StudyPlan, WarmStartFrom};

/// The most actions of a search space that an atlas can have.
const MAX_ACTIONS: u64 = 100_000;

/// Checks what a study does with an atlas.
///
/// # Errors
/// [`Error::Invalid`] naming the field.
pub(super) fn check(plan: &StudyPlan) -> Result<(), Error> {
    if plan.atlas == AtlasRole::None {
        return Ok(());
    }
    let role = plan.atlas.as_str();
    if plan.warm_start_from != WarmStartFrom::Root {
        let allowed = "root, because the gaits of an atlas start from one root gait";
        return Err(Error::invalid("warm_start_from", plan.warm_start_from.as_str(), allowed));
    }
    if plan.evaluation == Evaluation::Script {
        return Err(Error::invalid("atlas", role, "none, because scripts evaluate the trials of this study"));
    }
    if plan.repeat_results {
        return Err(Error::invalid("repeat_results", true, "false, because an atlas has each gait once"));
    }
    if plan.atlas == AtlasRole::Make && plan.answer_source == AnswerSource::People {
        let allowed = "gait_rmse or both, because an atlas does not wait for people";
        return Err(Error::invalid("answer_source", plan.answer_source.as_str(), allowed));
    }
    let actions = plan.search_space.len();
    if actions > MAX_ACTIONS {
        let allowed =
            format!("none, because the search space has {actions} actions and an atlas at most {MAX_ACTIONS}");
        return Err(Error::invalid("atlas", role, &allowed));
    }
    Ok(())
}
