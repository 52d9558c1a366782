//! Requests for the execution report of one trial's gait.

use super::execution::{NewExecutionReport, gait_of, newest, request};
use super::scheduler::Scheduler;
use crate::error::Error;
use gaitwright_store::audit::Actor;
use gaitwright_store::execution_reports::StoredReport;
use gaitwright_store::{TrialId, Writer, consents, trials};

/// Requests the report of a trial's gait, unless its newest one has the same number and seed.
///
/// # Errors
/// [`Error::Invalid`] naming the field; [`Error::Conflict`] if the trial has no converged gait, a script evaluated it,
/// the subject withdrew consent, or other simulated walks with the gait are queued or running; [`Error::NotFound`] if the gait was
/// pruned; [`Error::NotReady`] if this process simulates no walks; errors of the database.
pub async fn ask(
    writer: &mut Writer,
    scheduler: &Scheduler,
    actor: &Actor,
    id: TrialId,
    asked: NewExecutionReport,
) -> Result<(), Error> {
    asked.options()?;
    let open = scheduler.simulating(id).open();
    if let Some(NewExecutionReport { number_of_simulated_walks, seed }) = open.filter(|open| *open != asked) {
        return Err(Error::conflict(format!(
            "An execution report for this gait (number of simulated walks: {number_of_simulated_walks}, seed: {seed}) is already queued or running. Wait for it, or cancel the job execution_report-{id}."
        )));
    }
    let study = trials::get(writer, id).await?.study_id;
    consents::may_be_shown(writer, study).await?;
    let newest = newest(writer, id).await?.map(|StoredReport { reported, .. }| reported);
    let exists = newest.is_some_and(|newest| {
        (newest.number_of_simulated_walks, newest.seed) == (asked.number_of_simulated_walks, asked.seed)
    });
    if !exists {
        gait_of(writer, id).await?;
        if open.is_none() {
            request(writer, actor, id, asked).await?;
        }
    }
    if scheduler.simulate(id, (!exists).then_some(asked)) {
        Ok(())
    } else {
        Err(Error::NotReady("This service does not simulate walks.".to_owned()))
    }
}
