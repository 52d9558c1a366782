//! Records and retracts assessments: answers of staff about two gaits that state no preference (cannot tell, or
//! unsafe).

use super::answer_giver::AnswerGiver;
use super::feedback_log::{self, AttributedAnswer, SecondAnswer};
use super::preference_answer::attribution;
use super::recorded_answer;
use crate::access::Caller;
use crate::error::Error;
use crate::printable;
use gaitwright_store::assessments::{self, Assessment, AssessmentAnswer};
use gaitwright_store::feedback::Origin;
use gaitwright_store::{AnswerId, AssessmentId, StudyId, TrialId, Writer, audit, consents, events, feedback, studies};
use serde::Deserialize;
use serde_json::json;
use utoipa::ToSchema;

/// An assessment to record.
#[derive(Debug, Clone, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
#[schema(as = NewAssessment)]
pub struct NewAssessment {
    /// The trial with gait A.
    pub trial_a: TrialId,
    /// The trial with gait B.
    pub trial_b: TrialId,
    /// The answer. To state which gait is better, record a preference instead.
    pub answer: AssessmentAnswer,
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
    /// Identifier of the preference or assessment that this assessment replaces: a person's answer about the same two
    /// trials, which then no longer counts. If this assessment is undone, the replaced one counts again.
    #[serde(default)]
    pub replaces: Option<AnswerId>,
}

/// Writes an assessment.
///
/// # Errors
/// [`Error::Invalid`] naming the field, [`Error::NotFound`] for an unknown trial.
pub async fn give(
    writer: &mut Writer,
    caller: &Caller,
    study: StudyId,
    new: &NewAssessment,
) -> Result<AssessmentId, Error> {
    let study = studies::get(writer, study).await?;
    let attribution = attribution(caller, new.source, new.author.as_deref(), &new.note)?;
    let pair = (new.trial_a, new.trial_b);
    let (second_answer, replaces) =
        match recorded_answer::replace(writer, (study.id, pair), new.replaces, attribution.author).await {
            // A safety report is accepted even if the answer to change no longer counts.
            Err(Error::Conflict(_)) if new.answer.is_about_safety() => (SecondAnswer::Refused, None),
            second_answer => (second_answer?, new.replaces),
        };
    let statement = AttributedAnswer {
        study: study.id,
        pair,
        fields: ("trial_a", "trial_b"),
        answer: new.answer.into(),
        attribution,
        second_answer,
        replaces,
    };
    let id = write(writer, statement).await?;
    let (trial_a, trial_b, author) = (new.trial_a, new.trial_b, attribution.author);
    let detail = json!({
        "study": study.id, "trial_a": trial_a, "trial_b": trial_b, "answer": new.answer, "author": author,
        "replaces": replaces,
    });
    audit::append(writer, &caller.actor, "assessment.give", &format!("assessment {id}"), &detail).await?;
    Ok(id)
}

/// Adds an assessment and the preference derived from it, and notifies open pages.
///
/// # Errors
/// As [`feedback_log::record`].
pub(super) async fn write(writer: &mut Writer, statement: AttributedAnswer<'_>) -> Result<AssessmentId, Error> {
    let feedback_id = feedback_log::record(writer, statement).await?;
    let AttributedAnswer { study, pair, answer, attribution, replaces, .. } = statement;
    let (answer, origin) = (answer.try_into()?, Origin::replacing(replaces));
    let new = assessments::UnsavedAssessment { study, pair, answer, attribution, feedback: feedback_id, origin };
    let id = assessments::insert(writer, &new).await?;
    events::append(writer, study, "feedback_given", &json!({ "feedback_id": feedback_id, "assessment_id": id }))
        .await?;
    Ok(id)
}

/// Retracts an assessment, and the preference that was derived from it.
///
/// # Errors
/// [`Error::NotFound`], even for an assessment of another study. [`Error::Conflict`] if it was already retracted, or if
/// the subject withdrew consent.
pub async fn retract(
    writer: &mut Writer,
    caller: &Caller,
    study: Option<StudyId>,
    id: AssessmentId,
    (author, reason): (Option<&str>, &str),
) -> Result<Assessment, Error> {
    let assessment = assessments::get(writer, id).await?;
    if study.is_some_and(|study| study != assessment.study_id) {
        return Err(Error::NotFound { what: "assessment".to_owned(), id: id.to_string() });
    }
    consents::may_be_shown(writer, assessment.study_id).await?;
    if assessment.answer.is_about_safety() {
        return Err(Error::conflict(
            "A safety report cannot be retracted. Staff will review it and can clear the gait.",
        ));
    }
    let author = printable::name("author", author.unwrap_or(&caller.name), 80)?;
    let reason = printable::reason("reason", reason, " and say why the answer is retracted")?;
    if !assessments::retract(writer, id, author, reason).await? {
        return Err(Error::conflict("This assessment was already retracted."));
    }
    if let Some(feedback_id) = assessment.feedback_id {
        let row = feedback::get(writer, feedback_id).await?;
        feedback::retract(writer, &row, author, reason).await?;
    }
    events::append(writer, assessment.study_id, "feedback_retracted", &json!({ "assessment_id": id })).await?;
    let detail = json!({ "study": assessment.study_id, "author": author, "reason": reason });
    audit::append(writer, &caller.actor, "assessment.retract", &format!("assessment {id}"), &detail).await?;
    Ok(assessments::get(writer, id).await?)
}
