//! Unblinding of a lab session.

use super::controller_file_download::not_included;
use super::lab_answer;
use super::session::still_shown;
use crate::error::Error;
use crate::printable;
use gaitwright_store::audit::{self, Actor};
use gaitwright_store::lab_sessions::{self, LabSession, SessionStep};
use gaitwright_store::{LabSessionId, Writer};
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
    lab_answer::record_answer(writer, &session).await?;
    Ok(session)
}
