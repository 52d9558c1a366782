//! The controller file of a walk of a lab session: who fetched it decides whether the session is still blinded.

use super::session::{checked_device_walk, gaits_to_walk_with, still_shown};
use crate::access::Caller;
use crate::error::Error;
use gaitwright_store::{LabSessionId, Writer, allocations, audit};
use serde_json::json;

/// Which of a session's two gaits.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum GaitOfWalk {
    /// Gait A.
    A,
    /// Gait B.
    B,
}

/// Releases the controller file of a walk and records who fetched it, because the file reveals the gait. Only the
/// device's token leaves the session blinded for its caller. Both gaits are admitted in the transaction of the release,
/// so no file is released after a report was acknowledged.
///
/// # Errors
/// [`Error::Invalid`] for a walk without the device or an unknown walk, [`Error::Conflict`] if the session is closed, one
/// of its gaits is not walkable, the allocation is not in this record, or the subject withdrew consent.
pub async fn for_device(writer: &mut Writer, caller: &Caller, id: LabSessionId, walk: u8) -> Result<GaitOfWalk, Error> {
    let session = still_shown(writer, id).await?;
    checked_device_walk(walk)?;
    if !session.allocation.included {
        return Err(not_included());
    }
    gaits_to_walk_with(writer, &session, walk).await?;
    let to_device = caller.is_device();
    let is_one = allocations::for_device(writer, id, walk, (&caller.actor, to_device)).await?;
    let detail = json!({ "walk": walk, "to_device": to_device });
    audit::append(writer, &caller.actor, "lab_session.controller_file", &format!("lab session {id}"), &detail).await?;
    Ok(if is_one.ok_or_else(not_included)? { GaitOfWalk::A } else { GaitOfWalk::B })
}

pub(super) fn not_included() -> Error {
    Error::conflict(
        "The archive of this session did not include the allocation, because the session was blinded. Unblind it on the \
         system where it was planned.",
    )
}
