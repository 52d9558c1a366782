//! The state of a lab session in words.

use crate::format::words;
use gaitwright_service::studies::lab::LabSessionView;

/// Whether every walk and the answer of the subject are recorded.
pub(super) fn is_complete(session: &LabSessionView) -> bool {
    session.answer.is_some() && session.walks.iter().all(|walk| walk.recorded.is_some())
}

/// The state of a session. A session stays open for files after its last answer.
pub(super) fn state_in_words(session: &LabSessionView) -> String {
    match (&session.closed, &session.unblinded) {
        (None, Some(_)) => "unblinded".to_owned(),
        (None, None) if is_complete(session) => "all walks and the answer recorded".to_owned(),
        _ => words(session.state.as_str()),
    }
}
