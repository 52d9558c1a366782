//! Requests for the certificate of one trial's gait.

use super::certification;
use super::scheduler::Scheduler;
use crate::error::Error;
use gaitwright_store::audit::Actor;
use gaitwright_store::{TrialId, Writer};

/// Requests the certificate of a trial's gait, unless it exists.
///
/// # Errors
/// [`Error::Conflict`] if the trial has no converged gait, a script evaluated it, or the subject withdrew consent;
/// [`Error::NotReady`] if this process certifies no gaits; errors of the database.
pub async fn ask(writer: &mut Writer, scheduler: &Scheduler, actor: &Actor, id: TrialId) -> Result<(), Error> {
    let exists = certification::ask(writer, actor, id).await?;
    if exists || scheduler.certify(id) {
        Ok(())
    } else {
        Err(Error::NotReady("This service does not certify gaits.".to_owned()))
    }
}
