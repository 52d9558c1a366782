//! Which walk the person who walked found better, in terms of walks.
//!
//! It becomes a preference, or a remark, at unblinding: what the learner hears is shown to everybody who may
//! read, and whoever was in the lab would know the order from it.

use super::session::{InTheLab, has_file, in_the_lab, next_walk, still_open};
use crate::access::Caller;
use crate::error::Error;
use crate::printable;
use crate::studies::preference::{self, Again, GivenJudgement};
use crate::studies::remark;
use gaitwright_store::audit::Actor;
use gaitwright_store::feedback::{Attribution, Source};
use gaitwright_store::lab_answers::{self, LabAnswer};
use gaitwright_store::lab_sessions::{Act, LabSession};
use gaitwright_store::presentations::Judgement;
use gaitwright_store::{Instant, LabSessionId, Writer, audit, events, lab_sessions, studies, subjects};
use serde::{Deserialize, Serialize};
use serde_json::json;
use utoipa::ToSchema;

/// Longest note, characters.
const LONGEST_NOTE: usize = 2000;

/// An answer as read back: walks, and no gait.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
#[schema(as = LabAnswer)]
pub struct AnswerView {
    /// 1; a further one when the one before was taken back.
    pub number: u32,
    /// What was said; first is walk 2, the first one with the device.
    pub answer: Judgement,
    /// Free text.
    pub note: String,
    /// Who wrote it down.
    pub actor: String,
    /// When.
    pub at: Instant,
    /// Whether it was written after the session was unblinded, or by somebody who had fetched a controller file: then it is
    /// no blind answer.
    pub could_have_known: bool,
}

impl AnswerView {
    pub(super) fn of(session: &LabSession, row: &LabAnswer) -> Self {
        let unblinded = session.done(Act::Unblinded).is_some_and(|done| done.at <= row.at);
        Self {
            number: row.number,
            answer: row.said,
            note: row.note.clone(),
            actor: row.actor.clone(),
            at: row.at,
            could_have_known: unblinded || has_file(session, &row.actor, row.at),
        }
    }
}

/// What the person who walked says.
#[derive(Debug, Clone, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
#[schema(as = NewLabAnswer)]
pub struct NewAnswer {
    /// Number of the answer, as asked for: sent twice, it counts once.
    #[schema(minimum = 1)]
    pub number: u32,
    /// What the person says; first is walk 2, second is walk 3. `withdrawn` is the program's own word.
    pub answer: Judgement,
    /// Free text, at most 2000 characters.
    #[serde(default)]
    #[schema(max_length = 2000)]
    pub note: String,
}

/// The number under which the question is asked now; none: it is not.
pub(super) fn asks(session: &LabSession) -> Option<u32> {
    let open = session.done(Act::Closed).is_none() && next_walk(session).is_none() && session.answer().is_none();
    open.then(|| next_number(session))
}

fn next_number(session: &LabSession) -> u32 {
    u32::try_from(session.answers.len()).unwrap_or(u32::MAX).saturating_add(1)
}

/// Whether the answer that stands may go: nobody drew anything from it yet, and it is not about safety.
pub(super) fn can_be_taken_back(session: &LabSession) -> bool {
    let open = session.done(Act::Closed).is_none() && session.done(Act::Unblinded).is_none();
    open && session.answer().is_some_and(|answer| !answer.said.is_about_safety())
}

/// Writes what the person who walked says.
///
/// # Errors
/// [`Error::Invalid`] naming the field, [`Error::Conflict`] before every walk was recorded and when another answer stands.
pub async fn give(writer: &mut Writer, caller: &Caller, id: LabSessionId, new: &NewAnswer) -> Result<InTheLab, Error> {
    if new.answer == Judgement::Withdrawn {
        return Err(Error::invalid("answer", "withdrawn", "what a person can say"));
    }
    printable::note("note", &new.note, LONGEST_NOTE)?;
    let session = still_open(writer, id).await?;
    if let Some(walk) = next_walk(&session) {
        return Err(Error::conflict(format!("walk {walk} was not recorded yet: the question comes after every walk")));
    }
    if let Some(stands) = session.answer() {
        let same = (stands.number, stands.said, stands.note.as_str()) == (new.number, new.answer, new.note.as_str());
        let other = "another answer stands: it is the one that is recorded. To change it, take it back first";
        return if same { in_the_lab(writer, id).await } else { Err(Error::conflict(other)) };
    }
    let number = next_number(&session);
    if new.number != number {
        return Err(Error::conflict(format!("answer {} was taken back; asked for is answer {number}", new.number)));
    }
    if !lab_answers::insert(writer, &caller.actor, id, number, (new.answer, &new.note)).await? {
        return Err(Error::conflict("another answer was written at the same moment"));
    }
    let session = lab_sessions::get(writer, id).await?;
    if session.done(Act::Unblinded).is_some() {
        hear(writer, &session).await?;
    }
    let detail = json!({ "number": number, "answer": new.answer, "note": new.note });
    audit::append(writer, &caller.actor, "lab_session.answer", &format!("lab session {id}"), &detail).await?;
    // What is unsafe is closed at once, and pages that are open say so.
    events::append(writer, session.study_id, "lab_session_answered", &json!({ "lab_session_id": id })).await?;
    in_the_lab(writer, id).await
}

/// Takes the answer back that stands: it stays in the record, and counts no more.
///
/// # Errors
/// [`Error::NotFound`], [`Error::Conflict`] when none stands, or one that cannot be taken back here.
pub async fn take_back(writer: &mut Writer, caller: &Caller, id: LabSessionId) -> Result<InTheLab, Error> {
    let session = still_open(writer, id).await?;
    let answer = session.answer().ok_or_else(|| Error::conflict("there is no answer to take back"))?;
    if !can_be_taken_back(&session) {
        let why = "a walk that was called unsafe stays so, and what the learner has heard is taken back on the page of the \
                   study: tell whoever runs the study";
        return Err(Error::conflict(why));
    }
    lab_answers::take_back(writer, &caller.actor, id, answer.number).await?;
    let detail = json!({ "number": answer.number });
    audit::append(writer, &caller.actor, "lab_session.take_back", &format!("lab session {id}"), &detail).await?;
    in_the_lab(writer, id).await
}

/// Tells the learner the answer that stands, if one does, as said by the subject. An answer about a gait that was reported
/// unsafe since then stays in the record of the session, and the learner does not hear it.
pub(super) async fn hear(writer: &mut Writer, session: &LabSession) -> Result<(), Error> {
    let (Some(given), Some(walked)) = (session.answer(), session.walked()) else { return Ok(()) };
    let study = studies::get(writer, session.study_id).await?;
    let author = subjects::get(writer, study.plan.subject_id).await?.pseudonym;
    let statement = GivenJudgement {
        study: study.id,
        pair: walked,
        fields: ("walk 2", "walk 3"),
        said: given.said,
        attribution: Attribution { source: Source::Subject, author: &author, note: &given.note },
        // The same two gaits may be walked with in several sessions.
        again: Again::Meant,
    };
    let heard = if given.said.is_remark() {
        remark::write(writer, statement).await.map(drop)
    } else {
        heard_as_preference(writer, statement).await
    };
    match heard {
        Err(reason @ (Error::Invalid(_) | Error::Conflict(_))) => {
            let detail = json!({ "number": given.number, "reason": reason.to_string() });
            let object = format!("lab session {}", session.id);
            Ok(audit::append(writer, &Actor::program(), "lab_session.answer_not_heard", &object, &detail).await?)
        }
        other => other,
    }
}

async fn heard_as_preference(writer: &mut Writer, statement: GivenJudgement<'_>) -> Result<(), Error> {
    let heard = preference::hear(writer, statement).await?;
    Ok(events::append(writer, statement.study, "feedback_given", &json!({ "feedback_id": heard })).await?)
}
