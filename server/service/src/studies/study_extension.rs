//! Extends a study by further trials. One that has ended continues. For pages and REST.

use super::lifecycle::{self, StudyTransition};
use super::snapshot::has_changed;
use super::study_change::changed;
use super::study_plan;
use crate::error::Error;
use gaitwright_store::audit::Actor;
use gaitwright_store::studies::{Study, StudyLimits, StudyState};
use gaitwright_store::{StudyId, Writer, studies};
use serde::Deserialize;
use serde_json::json;
use utoipa::ToSchema;

/// Largest number of trials of a study.
const MAX_TRIALS: i64 = 10_000;

/// A larger number of trials.
#[derive(Debug, Clone, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct StudyExtension {
    /// Number of trials. Must exceed the current number.
    #[schema(minimum = 2, maximum = 10000)]
    pub number_of_trials: u32,
}

/// Raises the number of trials of a study. If the study has ended, it resumes.
///
/// # Errors
/// [`Error::Invalid`] if the number of trials would not increase, [`Error::Conflict`] if it cannot, [`Error::NotFound`].
pub async fn extend(writer: &mut Writer, actor: &Actor, id: StudyId, more: &StudyExtension) -> Result<Study, Error> {
    let study = studies::get(writer, id).await?;
    let least = i64::from(study.plan.number_of_trials) + 1;
    study_plan::check_range("number_of_trials", i64::from(more.number_of_trials), least.min(MAX_TRIALS), MAX_TRIALS)?;
    if least > MAX_TRIALS {
        return Err(Error::conflict(format!("The study has {MAX_TRIALS} trials already, the largest number allowed.")));
    }
    study_plan::check_range("number_of_trials", i64::from(more.number_of_trials), least, MAX_TRIALS)?;
    let state = match study.state {
        ended @ (StudyState::Finished | StudyState::Stopped) => lifecycle::after(ended, StudyTransition::Extend)?,
        other => other,
    };
    raise_number_of_trials(writer, &study, more.number_of_trials, state).await?;
    let detail = json!({ "from": study.plan.number_of_trials, "to": more.number_of_trials, "state": state });
    changed(writer, actor, "study.extend", &study, state, &detail).await
}

/// Sets the number of trials of a study, and the state in which it continues. The caller writes event and audit trail.
///
/// # Errors
/// [`Error::Invalid`] for too many trials, [`Error::Conflict`] if the study has changed; errors of the database.
pub(super) async fn raise_number_of_trials(
    writer: &mut Writer,
    study: &Study,
    number_of_trials: u32,
    state: StudyState,
) -> Result<(), Error> {
    study_plan::check_range("number_of_trials", i64::from(number_of_trials), 1, MAX_TRIALS)?;
    let limits = StudyLimits {
        name: study.plan.name.clone(),
        priority: study.plan.priority,
        parallel_trials: study.plan.parallel_trials,
        number_of_trials,
    };
    studies::set_limits(writer, study.id, &limits).await?;
    if state != study.state && !studies::set_state(writer, study, state, "The study was extended.").await? {
        return Err(has_changed());
    }
    Ok(())
}
