//! The subject's answer in a lab session: which walk was better.
//!
//! It becomes a preference, or an assessment, at unblinding: preferences are visible to every reader, and a person who
//! was in the lab could infer the allocation from them.

use super::question::{can_be_retracted, next_number, next_walk};
use super::session::{LabSessionProgress, session_progress, still_open, still_shown};
use super::unblinding;
use crate::access::Caller;
use crate::error::Error;
use crate::printable;
use crate::studies::new_safety_report;
use crate::studies::preference_answer as answering;
use crate::studies::safety_reports::SafetyReports;
use gaitwright_store::blind_pairs::OrderedAnswer;
use gaitwright_store::feedback::{Attribution, Source};
use gaitwright_store::lab_answers::{self, LabAnswer};
use gaitwright_store::lab_sessions::{LabSession, SessionStep};
use gaitwright_store::{LabSessionId, Writer, audit, events, lab_sessions};
use serde::Deserialize;
use serde_json::json;
use utoipa::ToSchema;

/// Maximum length of a note, characters.
const MAX_NOTE: usize = 2000;

/// The subject's answer.
#[derive(Debug, Clone, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
#[schema(as = NewLabAnswer)]
pub struct NewAnswer {
    /// Number of the answer: `answer_number` or, for a report of an unsafe walk, `report_number` of the session. An
    /// answer that is sent twice counts once.
    #[schema(minimum = 1)]
    pub number: u32,
    /// The answer. First is walk 2, second is walk 3.
    pub answer: OrderedAnswer,
    /// Free text, at most 2000 characters.
    #[serde(default)]
    #[schema(max_length = 2000)]
    pub note: String,
}

/// Records the answer of the subject. A safety report is accepted at any time, even in a closed session.
///
/// # Errors
/// [`Error::Invalid`] naming the field, [`Error::Conflict`] if the subject withdrew consent; for an answer other than a
/// safety report even if there is another answer, before all walks are recorded, and in a closed session.
pub async fn give(
    writer: &mut Writer,
    caller: &Caller,
    id: LabSessionId,
    new: &NewAnswer,
) -> Result<LabSessionProgress, Error> {
    answering::refuse_retracted(new.answer)?;
    printable::note("note", &new.note, MAX_NOTE)?;
    let session = still_shown(writer, id).await?;
    let number = next_number(&session);
    if !(1..=number).contains(&new.number) {
        return Err(Error::invalid("number", new.number, &format!("{number}, the number of the next answer")));
    }
    if new.answer.is_about_safety() {
        return report_unsafe(writer, caller, &session, new).await;
    }
    let session = still_open(writer, id).await?;
    if let Some(walk) = next_walk(&session) {
        return Err(Error::conflict(format!(
            "Walk {walk} is not recorded yet. Record all walks before you record the answer."
        )));
    }
    if let Some(current) = session.answer() {
        let other = "There is already an answer. To change it, retract it first.";
        return if is_same(current, new) { session_progress(writer, id).await } else { Err(Error::conflict(other)) };
    }
    if new.number != number {
        return Err(Error::conflict(format!(
            "Answer {} was retracted. The next answer has number {number}.",
            new.number
        )));
    }
    add(writer, caller, id, number, new).await
}

/// Whether an answer is the same form, sent twice.
fn is_same(current: &LabAnswer, new: &NewAnswer) -> bool {
    (current.number, current.answer, current.note.as_str()) == (new.number, new.answer, new.note.as_str())
}

/// Records a safety report: as the answer of the session, in place of another answer while the session is blinded. If
/// that cannot be, as a report of its own about the gait of the walk, or about both gaits while that is concealed.
async fn report_unsafe(
    writer: &mut Writer,
    caller: &Caller,
    session: &LabSession,
    new: &NewAnswer,
) -> Result<LabSessionProgress, Error> {
    let walked = session.walked();
    let (gaits, blinded) = match walked {
        Some(pair) => (new.answer.unsafe_of(pair), ""),
        None if new.answer == OrderedAnswer::UnsafeBoth => (vec![session.trial_a, session.trial_b], ""),
        None => (vec![session.trial_a, session.trial_b], "; blinded: it may be either gait"),
    };
    match session.answer() {
        None => add(writer, caller, session.id, next_number(session), new).await,
        Some(current)
            if is_same(current, new)
                && SafetyReports::read(writer, session.study_id).await?.are_all_in_force(&gaits) =>
        {
            session_progress(writer, session.id).await
        }
        Some(current) if walked.is_none() && !current.answer.is_about_safety() => {
            retract_number(writer, caller, session.id, current.number).await?;
            add(writer, caller, session.id, next_number(session), new).await
        }
        Some(_) => {
            let walks = match new.answer {
                OrderedAnswer::UnsafeFirst => "walk 2",
                OrderedAnswer::UnsafeSecond => "walk 3",
                _ => "walks 2 and 3",
            };
            // At most 80 characters, as every author.
            let author = format!("the subject in lab session {} ({walks}{blinded})", session.number);
            let attribution = Attribution { source: Source::Subject, author: &author, note: &new.note };
            new_safety_report::after_an_answer(writer, caller, &gaits, attribution).await?;
            session_progress(writer, session.id).await
        }
    }
}

async fn add(
    writer: &mut Writer,
    caller: &Caller,
    id: LabSessionId,
    number: u32,
    new: &NewAnswer,
) -> Result<LabSessionProgress, Error> {
    if !lab_answers::insert(writer, &caller.actor, id, number, (new.answer, &new.note)).await? {
        return Err(Error::conflict("Another answer was recorded at the same time. Check it before you answer again."));
    }
    let session = lab_sessions::get(writer, id).await?;
    if session.done(SessionStep::Unblinded).is_some() {
        unblinding::record_answer(writer, &session).await?;
    }
    let detail = json!({ "number": number, "answer": new.answer, "note": new.note });
    audit::append(writer, &caller.actor, "lab_session.answer", &format!("lab session {id}"), &detail).await?;
    // A safety report takes effect at once, so open pages must update.
    events::append(writer, session.study_id, "lab_session_answered", &json!({ "lab_session_id": id })).await?;
    session_progress(writer, id).await
}

/// Retracts the current answer. It stays on record, but no longer counts.
///
/// # Errors
/// [`Error::NotFound`], [`Error::Conflict`] if there is no answer, or one that cannot be retracted here.
pub async fn retract(writer: &mut Writer, caller: &Caller, id: LabSessionId) -> Result<LabSessionProgress, Error> {
    let session = still_open(writer, id).await?;
    let answer = session.answer().ok_or_else(|| Error::conflict("There is no answer to retract."))?;
    if !can_be_retracted(&session) {
        let why = "This answer cannot be retracted here, because it is a safety report or the session is unblinded. Ask a clinician \
                   to retract the answer or review the safety report.";
        return Err(Error::conflict(why));
    }
    retract_number(writer, caller, id, answer.number).await?;
    session_progress(writer, id).await
}

/// Retracts the answer with this number, and records it in the audit trail.
async fn retract_number(writer: &mut Writer, caller: &Caller, id: LabSessionId, number: u32) -> Result<(), Error> {
    lab_answers::retract(writer, &caller.actor, id, number).await?;
    let detail = json!({ "number": number });
    Ok(audit::append(writer, &caller.actor, "lab_session.retract", &format!("lab session {id}"), &detail).await?)
}
