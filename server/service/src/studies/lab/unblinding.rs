//! Unblinding of a lab session, which turns the subject's answer into a preference or an assessment.

use super::controller_file_download::not_included;
use super::session::still_shown;
use crate::error::Error;
use crate::printable;
use crate::studies::assessment_answer;
use crate::studies::feedback_log::{self, AttributedAnswer, SecondAnswer};
use gaitwright_store::audit::{self, Actor};
use gaitwright_store::feedback::{Attribution, Source};
use gaitwright_store::lab_sessions::{self, LabSession, SessionStep};
use gaitwright_store::{LabSessionId, Writer, events, studies, subjects};
use serde_json::json;

/// Unblinds a session: reveals which gait each walk used to all readers, and passes the subject's answer to the
/// learner.
///
/// # Errors
/// [`Error::Invalid`] without a reason, [`Error::Conflict`] if it is already unblinded, or its allocation is not in
/// this record.
pub async fn unblind(writer: &mut Writer, actor: &Actor, id: LabSessionId, reason: &str) -> Result<LabSession, Error> {
    let reason = printable::reason("reason", reason, " and say why the session is unblinded")?;
    if !still_shown(writer, id).await?.allocation.included {
        return Err(not_included());
    }
    if !lab_sessions::add_step(writer, actor, id, SessionStep::Unblinded, reason).await? {
        return Err(Error::conflict("This session is already unblinded."));
    }
    let detail = json!({ "reason": reason });
    audit::append(writer, actor, "lab_session.unblind", &format!("lab session {id}"), &detail).await?;
    let session = lab_sessions::get(writer, id).await?;
    record_answer(writer, &session).await?;
    Ok(session)
}

/// Passes the current answer, if any, to the learner with the subject as its author. If a gait has been reported as
/// unsafe since the answer, the answer stays on record but does not reach the learner.
pub(super) async fn record_answer(writer: &mut Writer, session: &LabSession) -> Result<(), Error> {
    let (Some(given), Some(walked)) = (session.answer(), session.walked()) else { return Ok(()) };
    let study = studies::get(writer, session.study_id).await?;
    let author = subjects::get(writer, study.plan.subject_id).await?.pseudonym;
    let statement = AttributedAnswer {
        study: study.id,
        pair: walked,
        fields: ("walk 2", "walk 3"),
        answer: given.answer,
        attribution: Attribution { source: Source::Subject, author: &author, note: &given.note },
        // Several sessions may compare the same two gaits.
        second_answer: SecondAnswer::Allowed,
        replaces: None,
    };
    let feedback_id = if given.answer.is_assessment() {
        assessment_answer::write(writer, statement).await.map(drop)
    } else {
        record_preference(writer, statement).await
    };
    match feedback_id {
        Err(reason @ (Error::Invalid(_) | Error::Conflict(_))) => {
            let detail = json!({ "number": given.number, "reason": reason.to_string() });
            let object = format!("lab session {}", session.id);
            Ok(audit::append(writer, &Actor::program(), "lab_session.answer_not_used", &object, &detail).await?)
        }
        other => other,
    }
}

async fn record_preference(writer: &mut Writer, statement: AttributedAnswer<'_>) -> Result<(), Error> {
    let feedback_id = feedback_log::record(writer, statement).await?;
    Ok(events::append(writer, statement.study, "feedback_given", &json!({ "feedback_id": feedback_id })).await?)
}
