//! The certificate of a trial's gait: made when somebody asks for it or the study has ended, then kept.

use crate::error::Error;
use crate::workers::Certify;
use gait_optimizer::Gait;
use gait_optimizer::certificate::{Certificate, certify};
use gaitwright_compute::OnPool;
use gaitwright_compute::priority::behind_solves;
use gaitwright_store::audit::{self, Actor};
use gaitwright_store::trials::TrialState;
use gaitwright_store::{
    Connection, Packed, Store, TrialId, Writer, certificates, commit, consents, events, gaits, trials,
};
use serde_json::json;
use std::sync::Arc;

/// What there is to begin with.
#[derive(Debug)]
pub enum Certification {
    /// It was made before.
    Made(Box<Certificate>),
    /// The gait to certify.
    Ahead(Packed<Gait>),
}

/// Looks for the certificate of a trial's gait.
///
/// # Errors
/// [`Error::Conflict`] when the trial has no converged gait or its subject withdrew, or what the database reports.
pub async fn begin(reader: &mut Connection, trial: TrialId) -> Result<Certification, Error> {
    let found = trials::get(reader, trial).await?;
    consents::may_be_shown(reader, found.study_id).await?;
    if let Some(certificate) = certificates::find(reader, trial).await? {
        return Ok(Certification::Made(Box::new(certificate)));
    }
    if found.state != TrialState::Converged {
        let state = found.state.as_str();
        return Err(Error::conflict(format!("trial {} is {state}: only a converged gait is certified", found.number)));
    }
    Ok(Certification::Ahead(gaits::get(reader, trial).await?))
}

/// The certificate; a new one takes some seconds of processor time, outside any transaction.
///
/// # Errors
/// When the gait is not well-formed.
pub async fn certificate(store: &mut Store, certification: Certification) -> Result<Certificate, Error> {
    match certification {
        Certification::Made(certificate) => Ok(*certificate),
        Certification::Ahead(gait) => {
            let certified = move |pool: &OnPool| Ok(certify(&gait.unpack(pool)?)?);
            store.compute(certified).await?
        }
    }
}

/// Certifies the gait of a trial on a thread of its own that gives way to every solve, and keeps the certificate. Nobody waits
/// for the thread when this is dropped.
///
/// # Errors
/// As [`begin`] and [`certificate`].
pub async fn aside(
    store: &mut Store,
    actor: &Actor,
    trial: TrialId,
    certifier: &Arc<dyn Certify>,
) -> Result<(), Error> {
    let Certification::Ahead(gait) = begin(&mut *store.read().await?, trial).await? else { return Ok(()) };
    let gait = store.compute(move |pool| gait.unpack(pool)).await??;
    let certifier = Arc::clone(certifier);
    let told = behind_solves("certifier", move || certifier.certify(&gait))
        .map_err(|e| Error::Internal(format!("no thread for a certification: {e}")))?;
    let found = match told.await {
        Ok(Ok(certificate)) => certificate,
        Ok(Err(reason)) => Certificate::failed_because(&reason.to_string()),
        Err(_) => Certificate::failed_because("the certification broke off"),
    };
    let mut writer = store.write().await?;
    record(&mut writer, actor, trial, &found).await?;
    Ok(commit(writer).await?)
}

/// Keeps a certificate.
///
/// # Errors
/// What the database reports.
pub async fn record(
    writer: &mut Writer,
    actor: &Actor,
    trial: TrialId,
    certificate: &Certificate,
) -> Result<(), Error> {
    if certificates::keep(writer, trial, certificate).await? {
        let study = trials::get(writer, trial).await?.study_id;
        let payload = json!({ "trial_id": trial, "passed": certificate.passed });
        events::append(writer, study, "gait_certified", &payload).await?;
        let detail = json!({ "passed": certificate.passed, "objections": certificate.objections });
        audit::append(writer, actor, "trial.certify", &format!("trial {trial}"), &detail).await?;
    }
    Ok(())
}
