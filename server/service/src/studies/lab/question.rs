//! The next step of a lab session, which is a walk or the answer of the subject, and the answers so far, as the lab
//! sees them.

use gaitwright_store::Instant;
use gaitwright_store::audit::Actor;
use gaitwright_store::blind_pairs::OrderedAnswer;
use gaitwright_store::lab_answers::LabAnswer;
use gaitwright_store::lab_sessions::{LabSession, SessionStep};
use serde::Serialize;
use utoipa::ToSchema;

/// Number of walks of a session.
pub const WALKS: u8 = 3;

/// The subject's answer, in terms of walks.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
#[schema(as = LabAnswer)]
pub struct AnswerView {
    /// Number of the answer, from 1. It increases by one when an answer is retracted.
    pub number: u32,
    /// The answer. First is walk 2, second is walk 3.
    pub answer: OrderedAnswer,
    /// Free text.
    pub note: String,
    /// Actor who recorded it.
    pub actor: String,
    /// Time of recording.
    pub created_at: Instant,
    /// Whether the person who recorded the answer could have known the allocation: it was recorded after unblinding, or
    /// by a user who had fetched a controller file.
    pub could_have_known: bool,
}

impl AnswerView {
    pub(super) fn of(session: &LabSession, row: &LabAnswer) -> Self {
        let unblinded = session.done(SessionStep::Unblinded).is_some_and(|done| done.at <= row.at);
        Self {
            number: row.number,
            answer: row.answer,
            note: row.note.clone(),
            actor: row.actor.clone(),
            created_at: row.at,
            could_have_known: unblinded || has_file(session, &row.actor, row.at),
        }
    }
}

/// The next walk to record, if any.
pub(super) fn next_walk(session: &LabSession) -> Option<u8> {
    (1..=WALKS).find(|walk| session.done(SessionStep::Walk(*walk)).is_none())
}

/// The number of the answer that is asked for now, if any.
pub(super) fn requested_answer(session: &LabSession) -> Option<u32> {
    let open =
        session.done(SessionStep::Closed).is_none() && next_walk(session).is_none() && session.answer().is_none();
    open.then(|| next_number(session))
}

/// The number of an answer that reports an unsafe walk, if the subject may have walked with the device: walk 1, the one
/// without it, is recorded, or a controller file was fetched.
pub(super) fn takes_report(session: &LabSession) -> Option<u32> {
    let may_have_walked = next_walk(session) != Some(1) || !session.allocation.files.is_empty();
    may_have_walked.then(|| next_number(session))
}

pub(super) fn next_number(session: &LabSession) -> u32 {
    u32::try_from(session.answers.len()).unwrap_or(u32::MAX).saturating_add(1)
}

/// Whether the current answer can be retracted: the session is blinded, and it is not a safety report.
pub(super) fn can_be_retracted(session: &LabSession) -> bool {
    let open = session.done(SessionStep::Closed).is_none() && session.done(SessionStep::Unblinded).is_none();
    open && session.answer().is_some_and(|answer| !answer.answer.is_about_safety())
}

/// Whether an actor may have fetched a controller file of this session before an instant. Any actor counts if a token
/// fetched one, because its holder is unknown.
pub(super) fn has_file(session: &LabSession, actor: &str, at: Instant) -> bool {
    let may_be = |other: &str| other == actor || Actor::is_token(other) || Actor::is_token(actor);
    session.allocation.files.iter().any(|file| !file.to_device && may_be(&file.actor) && file.at <= at)
}
