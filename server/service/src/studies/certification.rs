//! Makes the certificate of one trial's gait and stores it.

use super::trial_transitions::has_state;
use crate::error::Error;
use crate::workers::Certify;
use gait_optimizer::Gait;
use gait_optimizer::certificate::{Certificate, certify};
use gaitwright_compute::OnPool;
use gaitwright_compute::priority::run_below_solves;
use gaitwright_store::audit::{self, Actor};
use gaitwright_store::trials::TrialState;
use gaitwright_store::{
    Connection, Packed, Store, TrialId, Writer, certificates, commit, consents, events, gaits, trials,
};
use serde_json::json;
use std::sync::Arc;

/// The start of a certification.
#[derive(Debug)]
pub enum Certification {
    /// The certificate is on record.
    Made(Box<Certificate>),
    /// There is no certificate yet; the gait to certify.
    Ahead(Packed<Gait>),
}

/// Looks for the certificate of a trial's gait.
///
/// # Errors
/// [`Error::Conflict`] if the trial has no converged gait, a script evaluated it, or the subject withdrew consent; errors of the database.
pub async fn begin(reader: &mut Connection, trial: TrialId) -> Result<Certification, Error> {
    let found = trials::get(reader, trial).await?;
    consents::may_be_shown(reader, found.study_id).await?;
    if let Some(certificate) = certificates::find(reader, trial).await? {
        return Ok(Certification::Made(Box::new(certificate)));
    }
    if found.state != TrialState::Converged {
        return Err(Error::conflict(format!(
            "Trial {} {}. Only a converged gait can be certified.",
            found.number,
            has_state(found.state)
        )));
    }
    if found.script.is_some() {
        return Err(Error::conflict(format!(
            "A script evaluated trial {}, so its gait is not stored here and cannot be certified.",
            found.number
        )));
    }
    Ok(Certification::Ahead(gaits::get(reader, trial).await?))
}

/// Requests the certificate of a trial's gait. Returns whether it exists already.
///
/// # Errors
/// As [`begin`].
pub async fn ask(writer: &mut Writer, actor: &Actor, trial: TrialId) -> Result<bool, Error> {
    match begin(writer, trial).await? {
        Certification::Made(_) => Ok(true),
        Certification::Ahead(_) => {
            audit::append(writer, actor, certificates::REQUESTED, &format!("trial {trial}"), &json!({})).await?;
            Ok(false)
        }
    }
}

/// The certificate. A new one takes seconds of CPU time, outside any transaction.
///
/// # Errors
/// When the gait is malformed.
pub async fn certificate(store: &mut Store, certification: Certification) -> Result<Certificate, Error> {
    match certification {
        Certification::Made(certificate) => Ok(*certificate),
        Certification::Ahead(gait) => {
            let certified = move |pool: &OnPool| Ok(certify(&gait.unpack(pool)?)?);
            store.compute(certified).await?
        }
    }
}

/// Certifies the gait of a trial on its own low-priority thread and stores the certificate. Dropping the future
/// abandons the thread.
///
/// # Errors
/// As [`begin`] and [`certificate`].
pub async fn run(store: &mut Store, actor: &Actor, trial: TrialId, certifier: &Arc<dyn Certify>) -> Result<(), Error> {
    let mut reader = store.read().await?;
    let Certification::Ahead(gait) = begin(&mut reader, trial).await? else { return Ok(()) };
    let known = certificates::of_same_gait(&mut reader, trial).await?;
    drop(reader);
    // Unpacking checks the hash by which the certificate of the same gait was found.
    let gait = store.compute(move |pool| gait.unpack(pool)).await??;
    if let Some(known) = known {
        let mut writer = store.write().await?;
        record(&mut writer, actor, trial, &known).await?;
        return Ok(commit(writer).await?);
    }
    let certifier = Arc::clone(certifier);
    let result = run_below_solves("certifier", move || certifier.certify(&gait))
        .map_err(|e| Error::Internal(format!("cannot start a thread for a certification: {e}")))?;
    let found = match result.await {
        Ok(Ok(certificate)) => certificate,
        Ok(Err(reason)) => Certificate::failed_because(&reason.to_string()),
        Err(_) => Certificate::failed_because("The certification was aborted."),
    };
    let mut writer = store.write().await?;
    record(&mut writer, actor, trial, &found).await?;
    Ok(commit(writer).await?)
}

/// Stores a certificate.
///
/// # Errors
/// Errors of the database.
pub async fn record(
    writer: &mut Writer,
    actor: &Actor,
    trial: TrialId,
    certificate: &Certificate,
) -> Result<(), Error> {
    if certificates::insert(writer, trial, certificate).await? {
        let study = trials::get(writer, trial).await?.study_id;
        let payload = json!({ "trial_id": trial, "passed": certificate.passed });
        events::append(writer, study, "gait_certified", &payload).await?;
        let detail = json!({ "passed": certificate.passed, "failures": certificate.failures });
        audit::append(writer, actor, "trial.certify", &format!("trial {trial}"), &detail).await?;
    }
    Ok(())
}
