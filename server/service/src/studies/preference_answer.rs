//! Records and retracts preferences from people and scripts, for pages and REST.

use super::answer_giver::AnswerGiver;
use crate::access::Caller;
use crate::error::Error;
use crate::printable;
use crate::studies::feedback_log::{self, AttributedAnswer};
use crate::studies::recorded_answer;
use crate::studies::trial_transitions::has_state;
use crate::studies::walkable;
use gaitwright_store::audit;
use gaitwright_store::blind_pairs::OrderedAnswer;
use gaitwright_store::feedback::{Attribution, FeedbackContent, FeedbackRow, Source};
use gaitwright_store::trials::{Trial, TrialState};
use gaitwright_store::{
    AnswerId, Connection, FeedbackId, StudyId, TrialId, Writer, consents, events, feedback, studies,
};
use serde::{Deserialize, Serialize};
use serde_json::json;
use utoipa::ToSchema;

/// Which of two gaits is better.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum PairAnswer {
    /// Gait A is better.
    A,
    /// Gait B is better.
    B,
    /// Neither gait is better.
    NoDifference,
}

/// Refuses the answer that only the service gives.
///
/// # Errors
/// [`Error::Invalid`] with the answers that people give.
pub(super) fn refuse_retracted(answer: OrderedAnswer) -> Result<(), Error> {
    if answer != OrderedAnswer::Retracted {
        return Ok(());
    }
    let others = OrderedAnswer::ALL.into_iter().filter(|other| *other != answer).map(OrderedAnswer::as_str);
    Err(Error::invalid("answer", "retracted", &format!("one of {}", others.collect::<Vec<_>>().join(", "))))
}

/// A preference to record.
#[derive(Debug, Clone, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
#[schema(as = NewPreference)]
pub struct Answer {
    /// The trial with gait A.
    pub trial_a: TrialId,
    /// The trial with gait B.
    pub trial_b: TrialId,
    /// Which gait is better.
    pub answer: PairAnswer,
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
    /// Identifier of the preference or assessment that this answer replaces: a person's answer about the same two trials,
    /// which then no longer counts. If this answer is undone, the replaced one counts again.
    #[serde(default)]
    pub replaces: Option<AnswerId>,
}

/// Records a preference.
///
/// # Errors
/// [`Error::Invalid`] naming the field, [`Error::NotFound`] for an unknown trial.
pub async fn give(writer: &mut Writer, caller: &Caller, study: StudyId, answer: &Answer) -> Result<FeedbackId, Error> {
    let study = studies::get(writer, study).await?;
    let attribution = attribution(caller, answer.source, answer.author.as_deref(), &answer.note)?;
    let (a, b) = (answer.trial_a, answer.trial_b);
    let ordered = match answer.answer {
        PairAnswer::A => OrderedAnswer::First,
        PairAnswer::B => OrderedAnswer::Second,
        PairAnswer::NoDifference => OrderedAnswer::NoDifference,
    };
    let fields = ("trial_a", "trial_b");
    let statement = AttributedAnswer {
        study: study.id,
        pair: (a, b),
        fields,
        answer: ordered,
        attribution,
        second_answer: recorded_answer::replace(writer, (study.id, (a, b)), answer.replaces, attribution.author)
            .await?,
        replaces: answer.replaces,
    };
    let feedback_id = feedback_log::record(writer, statement).await?;
    let id = feedback_id.ok_or_else(|| Error::Internal("a preference did not reach the learner".to_owned()))?;
    events::append(writer, study.id, "feedback_given", &json!({ "feedback_id": id })).await?;
    let detail = json!({
        "study": study.id, "trial_a": a, "trial_b": b, "answer": answer.answer, "author": attribution.author,
        "replaces": answer.replaces,
    });
    audit::append(writer, &caller.actor, "preference.give", &format!("preference {id}"), &detail).await?;
    Ok(id)
}

/// The author of an answer: the caller, or the person that the caller names.
///
/// # Errors
/// [`Error::Invalid`] for `source`, `author` or `note`.
pub fn attribution<'a>(
    caller: &'a Caller,
    source: Option<AnswerGiver>,
    author: Option<&'a str>,
    note: &'a str,
) -> Result<Attribution<'a>, Error> {
    let source = source.map_or_else(|| caller.source(), Source::from);
    let author = printable::name("author", author.unwrap_or(&caller.name), 80)?;
    // A signed-in user cannot answer as another clinician.
    if caller.user.is_some() && source == Source::Clinician && author != caller.name {
        return Err(Error::invalid("author", author, &format!("{} (the signed-in user), or omitted", caller.name)));
    }
    printable::note("note", note, 2000)?;
    Ok(Attribution { source, author, note })
}

/// The most answers of other people that a comparison lists.
const MAX_OTHER_ANSWERS: u32 = 20;

/// The newest answers of other people to the same comparison. The learner uses all of them.
///
/// # Errors
/// Errors of the database.
pub async fn other_answers(db: &mut Connection, row: &FeedbackRow) -> Result<Vec<FeedbackRow>, Error> {
    let (FeedbackContent::Preference { winner: a, loser: b } | FeedbackContent::NoDifference { a, b }) = row.content
    else {
        return Ok(Vec::new());
    };
    Ok(feedback::of_pair(db, (a, b), Some(&row.author), MAX_OTHER_ANSWERS).await?)
}

/// Retracts a preference.
///
/// # Errors
/// [`Error::NotFound`], even for a preference of another study. [`Error::Conflict`] if it was already retracted, if it
/// is a label, or if the subject withdrew consent.
pub async fn retract(
    writer: &mut Writer,
    caller: &Caller,
    study: Option<StudyId>,
    id: FeedbackId,
    author: Option<&str>,
    reason: &str,
) -> Result<FeedbackRow, Error> {
    if let Some(study) = study {
        studies::get(writer, study).await?;
    }
    let row = feedback::get(writer, id).await?;
    let is_preference =
        matches!(row.content, FeedbackContent::Preference { .. } | FeedbackContent::NoDifference { .. });
    if !is_preference || study.is_some_and(|study| study != row.study_id) {
        return Err(Error::NotFound { what: "preference".to_owned(), id: id.to_string() });
    }
    retract_entry(writer, caller, ("preference", &row), author, reason).await
}

/// Retracts an entry of the learner's log, named by its kind in the audit trail.
///
/// # Errors
/// [`Error::Invalid`] naming the field, [`Error::Conflict`] if it was retracted or the subject withdrew consent.
pub(super) async fn retract_entry(
    writer: &mut Writer,
    caller: &Caller,
    (kind, row): (&str, &FeedbackRow),
    author: Option<&str>,
    reason: &str,
) -> Result<FeedbackRow, Error> {
    consents::may_be_shown(writer, row.study_id).await?;
    let author = printable::name("author", author.unwrap_or(&caller.name), 80)?;
    let reason = printable::reason("reason", reason, &format!(" and say why the {kind} is retracted"))?;
    if !feedback::retract(writer, row, author, reason).await? {
        return Err(Error::conflict(format!("This {kind} was already retracted.")));
    }
    events::append(writer, row.study_id, "feedback_retracted", &json!({ "feedback_id": row.id })).await?;
    let detail = json!({ "study": row.study_id, "author": author, "reason": reason });
    audit::append(writer, &caller.actor, &format!("{kind}.retract"), &format!("{kind} {}", row.id), &detail).await?;
    Ok(feedback::get(writer, row.id).await?)
}

/// The converged trial that `field` names.
///
/// # Errors
/// [`Error::Invalid`] for a trial of another study or without a gait.
pub async fn comparable(db: &mut Connection, study: StudyId, field: &str, id: TrialId) -> Result<Trial, Error> {
    let trial = walkable::trial_of_study(db, study, field, id).await?;
    if trial.state != TrialState::Converged {
        let allowed = format!("a converged trial, but trial {} {}", trial.number, has_state(trial.state));
        return Err(Error::invalid(field, id.to_string(), &allowed));
    }
    Ok(trial)
}
