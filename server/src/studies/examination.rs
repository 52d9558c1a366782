//! The certificate of a trial's gait: made when somebody asks for it or the study has ended, then kept.

use crate::error::Error;
use crate::store::audit::{self, Actor};
use crate::store::trials::TrialState;
use crate::store::{Connection, Store, TrialId, Writer, certificates, commit, consents, events, gaits, trials};
use crate::workers::Examine;
use crate::workers::stand_back::behind_solves;
use gait_optimizer::Gait;
use gait_optimizer::certificate::{Certificate, certify};
use serde_json::json;
use std::sync::Arc;

/// What there is to begin with.
#[derive(Debug)]
pub enum Examination {
    /// It was made before.
    Made(Box<Certificate>),
    /// The gait to examine.
    Ahead(Box<Gait>),
}

/// Looks for the certificate of a trial's gait.
///
/// # Errors
/// [`Error::Conflict`] when the trial has no converged gait or its subject withdrew, or what the database reports.
pub async fn begin(reader: &mut Connection, trial: TrialId) -> Result<Examination, Error> {
    let found = trials::get(reader, trial).await?;
    consents::may_be_shown(reader, found.study_id).await?;
    if let Some(certificate) = certificates::find(reader, trial).await? {
        return Ok(Examination::Made(Box::new(certificate)));
    }
    if found.state != TrialState::Converged {
        let state = found.state.as_str();
        return Err(Error::conflict(format!("trial {} is {state}: only a converged gait is examined", found.number)));
    }
    Ok(Examination::Ahead(Box::new(gaits::get(reader, trial).await?)))
}

/// The certificate; a new one takes some seconds of processor time, outside any transaction.
///
/// # Errors
/// When the gait is not well-formed.
pub async fn certificate(store: &mut Store, examination: Examination) -> Result<Certificate, Error> {
    match examination {
        Examination::Made(certificate) => Ok(*certificate),
        Examination::Ahead(gait) => Ok(store.compute(move |_| certify(&gait)).await??),
    }
}

/// Examines the gait of a trial on a thread of its own that gives way to every solve, and keeps the certificate. Nobody waits
/// for the thread when this is dropped.
///
/// # Errors
/// As [`begin`] and [`certificate`].
pub async fn aside(store: &Store, actor: &Actor, trial: TrialId, examiner: &Arc<dyn Examine>) -> Result<(), Error> {
    let Examination::Ahead(gait) = begin(&mut *store.read().await?, trial).await? else { return Ok(()) };
    let examiner = Arc::clone(examiner);
    let told = behind_solves("examiner", move || examiner.examine(&gait))
        .map_err(|e| Error::Internal(format!("no thread for an examination: {e}")))?;
    let found = match told.await {
        Ok(Ok(certificate)) => certificate,
        Ok(Err(reason)) => Certificate::of_unexaminable(&reason.to_string()),
        Err(_) => Certificate::of_unexaminable("the examination broke off"),
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
        events::append(writer, study, "gait_examined", &payload).await?;
        let detail = json!({ "passed": certificate.passed, "objections": certificate.objections });
        audit::append(writer, actor, "trial.certify", &format!("trial {trial}"), &detail).await?;
    }
    Ok(())
}
