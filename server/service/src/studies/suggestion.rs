//! Records suggestions (coactive feedback): bounds with which a gait would have been better than that of a trial.

use super::answer_giver::AnswerGiver;
use super::feedback_log;
use super::preference_answer::{attribution, comparable, retract_entry};
use crate::access::Caller;
use crate::error::Error;
use gait_learner::ActionIndex;
use gaitwright_store::feedback::{self, FeedbackContent, FeedbackRow};
use gaitwright_store::studies::Study;
use gaitwright_store::trials::Trial;
use gaitwright_store::{FeedbackId, StudyId, TrialId, Writer, audit, events, studies};
use serde::Deserialize;
use serde_json::json;
use std::collections::BTreeMap;
use utoipa::ToSchema;

/// Bounds with which a gait would have been better than that of a trial.
#[derive(Debug, Clone, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct NewSuggestion {
    /// Trial whose gait could be better.
    pub over: TrialId,
    /// Suggested values of tuned bounds, such as `{"a5": 0.026}`. Each must be a value of the search space. Other
    /// bounds keep their values from the trial.
    pub bounds: BTreeMap<String, f64>,
    /// Source of the answer: `subject`, `clinician` or `script`. By default `script` for a token, `subject` for a rater, and
    /// `clinician` for any other user.
    #[serde(default)]
    pub source: Option<AnswerGiver>,
    /// Name or pseudonym of the author. Defaults to the caller's name.
    #[serde(default)]
    #[schema(min_length = 1, max_length = 80)]
    pub author: Option<String>,
    /// Free text.
    #[serde(default)]
    #[schema(max_length = 2000)]
    pub note: String,
}

/// Records a suggestion.
///
/// # Errors
/// [`Error::Invalid`] naming the field, [`Error::Conflict`] for a second answer of the same person.
pub async fn give(
    writer: &mut Writer,
    caller: &Caller,
    study: StudyId,
    new: &NewSuggestion,
) -> Result<FeedbackId, Error> {
    let study = studies::get(writer, study).await?;
    let trial = comparable(writer, study.id, "over", new.over).await?;
    let suggested = action(&study, &trial, &new.bounds)?;
    let attribution = attribution(caller, new.source, new.author.as_deref(), &new.note)?;
    let id = feedback_log::suggest(writer, &trial, (suggested, &json!(new.bounds)), attribution).await?;
    events::append(writer, study.id, "feedback_given", &json!({ "feedback_id": id })).await?;
    let detail = json!({ "study": study.id, "over": trial.id, "bounds": new.bounds, "author": attribution.author });
    audit::append(writer, &caller.actor, "suggestion.give", &format!("suggestion {id}"), &detail).await?;
    Ok(id)
}

/// Retracts a suggestion.
///
/// # Errors
/// [`Error::NotFound`] for an entry that is no suggestion; [`Error::Invalid`] naming the field; [`Error::Conflict`] if it was
/// retracted or the subject withdrew consent.
pub async fn retract(
    writer: &mut Writer,
    caller: &Caller,
    id: FeedbackId,
    author: Option<&str>,
    reason: &str,
) -> Result<FeedbackRow, Error> {
    let row = feedback::get(writer, id).await?;
    if !matches!(row.content, FeedbackContent::Suggestion { .. }) {
        return Err(Error::NotFound { what: "suggestion".to_owned(), id: id.to_string() });
    }
    retract_entry(writer, caller, ("suggestion", &row), author, reason).await
}

/// The action of the trial with the suggested bounds.
fn action(study: &Study, trial: &Trial, bounds: &BTreeMap<String, f64>) -> Result<ActionIndex, Error> {
    let space = &study.plan.search_space;
    let dimensions = space.dimensions();
    if let Some(unknown) = bounds.keys().find(|name| !dimensions.iter().any(|dimension| dimension.name == **name)) {
        let names: Vec<&str> = dimensions.iter().map(|dimension| dimension.name.as_str()).collect();
        return Err(Error::invalid("bounds", unknown.as_str(), &format!("one of {}", names.join(", "))));
    }
    let mut levels = space.levels(trial.action_index);
    for (level, dimension) in levels.iter_mut().zip(dimensions) {
        let Some(&value) = bounds.get(&dimension.name) else { continue };
        let place = dimension.values.iter().position(|known| known.to_bits() == value.to_bits());
        *level = place.ok_or_else(|| {
            let known: Vec<String> = dimension.values.iter().map(f64::to_string).collect();
            Error::invalid(&format!("bounds.{}", dimension.name), value, &format!("one of {}", known.join(", ")))
        })?;
    }
    let suggested = space.index_of_levels(&levels).map_err(Error::Learner)?;
    if suggested == trial.action_index {
        return Err(Error::invalid("bounds", json!(bounds), "different from the bounds of the trial"));
    }
    Ok(suggested)
}
