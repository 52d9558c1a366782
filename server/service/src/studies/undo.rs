//! Undo of an answer that was just saved: it no longer counts, and the answer that it replaced counts again.

use super::feedback_log::{self, CurrentAnswer};
use super::recorded_answer::RecordedAnswer;
use crate::access::Caller;
use crate::error::Error;
use crate::printable;
use gaitwright_store::assessments::{self, UnsavedAssessment};
use gaitwright_store::feedback::{Attribution, Origin};
use gaitwright_store::{AnswerId, Connection, StudyId, Writer, audit, consents, events, now};
use serde_json::json;
use thiserror::Error;

/// How long after it was saved an answer can be undone, s. Pages with scripts offer it for a shorter time.
pub const UNDO_WITHIN_S: f64 = 120.0;

/// The reason in the record of an answer that was undone.
const UNDONE: &str = "undone immediately after answering";

/// Why an answer cannot be undone.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum NotUndone {
    /// It was undone before.
    #[error("This answer was already undone.")]
    Already,
    /// It was changed or retracted.
    #[error("This answer no longer counts: {0}.")]
    Retracted(String),
    /// It is an answer that undo brought back.
    #[error(
        "This answer counts again because a change to it was undone. An undo cannot be undone: change the answer instead."
    )]
    Restored,
    /// It was saved too long ago.
    #[error("This answer was saved more than two minutes ago. Change it or retract it instead.")]
    TooLate,
    /// It is a safety report, or follows from one.
    #[error("A safety report cannot be undone. Staff will review it and can clear the gait.")]
    SafetyReport,
    /// A rater gave it.
    #[error("Only the rater who gave this answer can undo it.")]
    ByRater,
    /// The service computed it.
    #[error("Only people's answers can be undone. The service computed this entry.")]
    Computed,
    /// The author of the answer that would be brought back has answered the comparison again.
    #[error("{0} has answered this comparison again since. Retract this answer instead.")]
    AnsweredAgain(String),
}

impl From<NotUndone> for Error {
    fn from(reason: NotUndone) -> Self {
        Self::CannotBeUndone(reason.to_string())
    }
}

/// Undoes an answer: retracts it and, if it replaced another answer, appends one with the content and the author of
/// that answer. Returns the identifier of the appended answer. All changes are in the transaction of the writer.
///
/// # Errors
/// [`Error::NotFound`], even for an answer of another study; [`NotUndone`]; [`Error::Conflict`] if the subject withdrew
/// consent.
pub async fn undo(
    writer: &mut Writer,
    caller: &Caller,
    study: Option<StudyId>,
    id: AnswerId,
    author: Option<&str>,
) -> Result<Option<AnswerId>, Error> {
    let newest = RecordedAnswer::get(writer, study, id).await?;
    consents::may_be_shown(writer, newest.study()).await?;
    let author = printable::name("author", author.unwrap_or(&caller.name), 80)?;
    refuse(writer, &newest).await?;
    if !newest.retract(writer, author, UNDONE).await? {
        return Err(NotUndone::Already.into());
    }
    let replaced = match newest.replaces() {
        Some(replaced) => Some(RecordedAnswer::get(writer, Some(newest.study()), replaced).await?),
        None => None,
    };
    let restored = match &replaced {
        Some(replaced) => Some(restore(writer, &newest, replaced).await?),
        None => None,
    };
    let detail = json!({ "study": newest.study(), "author": author, "restored": restored });
    let (change, kind) = match &newest {
        RecordedAnswer::Preference(_) => ("preference.undo", "preference"),
        RecordedAnswer::Assessment(_) => ("assessment.undo", "assessment"),
    };
    audit::append(writer, &caller.actor, change, &format!("{kind} {id}"), &detail).await?;
    Ok(restored)
}

/// The outcome of an undo that took place before: the answer that it brought back, or else the undone one. `None` if the
/// answer was not undone.
///
/// # Errors
/// [`Error::NotFound`], even for an answer of another study.
pub async fn outcome(db: &mut Connection, study: StudyId, id: AnswerId) -> Result<Option<AnswerId>, Error> {
    let answer = RecordedAnswer::get(db, Some(study), id).await?;
    if answer.retraction().is_none_or(|retraction| retraction.reason != UNDONE) {
        return Ok(None);
    }
    let Some(replaced) = answer.replaces() else { return Ok(Some(id)) };
    let restored = RecordedAnswer::get(db, Some(study), replaced).await?.restoration(db).await?;
    Ok(Some(restored.unwrap_or(id)))
}

/// Refuses an answer that cannot be undone.
async fn refuse(writer: &mut Writer, newest: &RecordedAnswer) -> Result<(), Error> {
    let refused = |reason: NotUndone| Err(Error::from(reason));
    if newest.is_computed() {
        return refused(NotUndone::Computed);
    }
    if newest.is_by_rater() {
        return refused(NotUndone::ByRater);
    }
    if newest.is_about_safety(writer).await? {
        return refused(NotUndone::SafetyReport);
    }
    match newest.retraction() {
        Some(retraction) if retraction.reason == UNDONE => return refused(NotUndone::Already),
        Some(retraction) => return refused(NotUndone::Retracted(retraction.reason.clone())),
        None => {}
    }
    if newest.restores().is_some() {
        return refused(NotUndone::Restored);
    }
    if now().seconds_since(newest.created_at()) > UNDO_WITHIN_S {
        return refused(NotUndone::TooLate);
    }
    Ok(())
}

/// Brings the replaced answer back. Its gaits are not checked again: it would have stood through a safety report, too.
async fn restore(writer: &mut Writer, newest: &RecordedAnswer, replaced: &RecordedAnswer) -> Result<AnswerId, Error> {
    refuse_a_second_answer(writer, newest, replaced).await?;
    let (restored, payload) = match replaced {
        RecordedAnswer::Preference(row) => {
            let id = feedback_log::restore(writer, row).await?;
            (AnswerId::from(id), json!({ "feedback_id": id }))
        }
        RecordedAnswer::Assessment(row) => {
            let new = UnsavedAssessment {
                study: row.study_id,
                pair: row.pair(),
                answer: row.answer,
                attribution: Attribution { source: row.source, author: &row.author, note: &row.note },
                feedback: None,
                origin: Origin::Restores(row.id),
            };
            let id = assessments::insert(writer, &new).await?;
            (id.into(), json!({ "feedback_id": null, "assessment_id": id }))
        }
    };
    events::append(writer, newest.study(), "feedback_given", &payload).await?;
    Ok(restored)
}

/// An answer can be changed in the name of another person. Then the former author may have answered again meanwhile.
async fn refuse_a_second_answer(
    writer: &mut Writer,
    newest: &RecordedAnswer,
    replaced: &RecordedAnswer,
) -> Result<(), Error> {
    let Some(pair) = replaced.pair() else { return Ok(()) };
    let (_, author) = replaced.given_by();
    let study = newest.study();
    let is_since = match feedback_log::current_answer(writer, study, pair, author).await? {
        None => false,
        Some(CurrentAnswer::Preference(id)) => {
            RecordedAnswer::get(writer, Some(study), id.into()).await?.created_at() > newest.created_at()
        }
        Some(CurrentAnswer::Assessment(id)) => {
            RecordedAnswer::get(writer, Some(study), id.into()).await?.created_at() > newest.created_at()
        }
        Some(CurrentAnswer::Blind(_) | CurrentAnswer::Suggestion(_)) => true,
    };
    if is_since { Err(NotUndone::AnsweredAgain(author.to_owned()).into()) } else { Ok(()) }
}
