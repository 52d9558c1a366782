//! What the certificate of a recommended gait says: nothing is recommended silently whose certificate failed.

use super::belief::Beliefs;
use super::certification;
use super::choice;
use super::snapshot::StudySnapshot;
use crate::error::Error;
use gaitwright_compute::OnPool;
use gaitwright_store::audit::Actor;
use gaitwright_store::{Connection, Store, StoreResult, TrialId, certificates, commit, gaits};
use serde::Serialize;
use std::collections::BTreeSet;
use std::sync::Arc;
use utoipa::ToSchema;

/// So many of the best gaits are certified in search of one that passes.
pub const MOST_CERTIFIED: usize = 10;

/// What is known of a gait's certificate.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum CertificateState {
    /// Every quantity is within its limit, and the gait is stable.
    Passed,
    /// Something is not.
    Failed,
    /// The service is at it.
    BeingCertified,
    /// Nobody asked for it yet.
    #[default]
    NotCertified,
}

impl CertificateState {
    /// As written in tables.
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Passed => "passed",
            Self::Failed => "failed",
            Self::BeingCertified => "being_certified",
            Self::NotCertified => "not_certified",
        }
    }
}

/// The certificate of a study's best gait, and the gait to take where that one failed.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Judged {
    /// Of the best gait.
    pub verdict: CertificateState,
    /// Why it failed, in words.
    pub objections: Vec<String>,
    /// Where the best one failed: the best gait that is known to pass.
    pub passing: Option<TrialId>,
    /// The best gait that was not certified, where no better one passed; of the first [`MOST_CERTIFIED`].
    pub without_certificate: Option<TrialId>,
    /// The service is certifying that one by itself.
    pub certifying: bool,
}

impl Judged {
    /// Says whether the service is certifying the best gait that was not certified.
    pub fn certified_by_service(&mut self, certifying: bool) {
        self.certifying = certifying;
        if certifying && self.verdict == CertificateState::NotCertified {
            self.verdict = CertificateState::BeingCertified;
        }
    }
}

/// Reads what is known of the certificates of gaits, the best one first.
///
/// # Errors
/// What the database reports.
pub async fn judged(db: &mut Connection, ranking: &[TrialId]) -> StoreResult<Judged> {
    let mut judged = Judged::default();
    for (place, &trial) in ranking.iter().enumerate() {
        let verdict = match certificates::passed(db, trial).await? {
            Some(true) => CertificateState::Passed,
            Some(false) => CertificateState::Failed,
            None => CertificateState::NotCertified,
        };
        if place == 0 {
            judged.verdict = verdict;
        }
        match verdict {
            CertificateState::Passed => {
                judged.passing = Some(trial).filter(|_| place > 0);
                break;
            }
            CertificateState::Failed => {}
            _ if place < MOST_CERTIFIED && gaits::is_here(db, trial).await? => {
                judged.without_certificate.get_or_insert(trial);
            }
            _ => {}
        }
    }
    if let Some(&best) = ranking.first().filter(|_| judged.verdict == CertificateState::Failed) {
        judged.objections = certificates::find(db, best).await?.map(|found| found.objections).unwrap_or_default();
    }
    Ok(judged)
}

/// The next gait to certify in search of one that passes: none when one has passed, or the first [`MOST_CERTIFIED`] have
/// failed. `refused`: what cannot be certified.
///
/// # Errors
/// What the database reports.
pub async fn next_to_certify(
    db: &mut Connection,
    ranking: &[TrialId],
    refused: &BTreeSet<TrialId>,
) -> StoreResult<Option<TrialId>> {
    for &trial in ranking.iter().take(MOST_CERTIFIED) {
        match certificates::passed(db, trial).await? {
            Some(true) => return Ok(None),
            None if !refused.contains(&trial) && gaits::is_here(db, trial).await? => return Ok(Some(trial)),
            Some(false) | None => {}
        }
    }
    Ok(None)
}

/// The gaits that a study recommends or may still recommend: the best one, the best one that passes its certificate, and, as long
/// as none is known to pass, those that are still to be certified.
///
/// # Errors
/// What the database reports.
pub async fn worth_keeping(db: &mut Connection, ranking: &[TrialId]) -> StoreResult<Vec<TrialId>> {
    let mut kept = Vec::new();
    for (place, &trial) in ranking.iter().enumerate() {
        let passed = certificates::passed(db, trial).await?;
        if place == 0 || passed == Some(true) || (passed.is_none() && place < MOST_CERTIFIED) {
            kept.push(trial);
        }
        if passed == Some(true) {
            break;
        }
    }
    Ok(kept)
}

/// Certifies the gaits of a study, the best one first, until one passes or [`MOST_CERTIFIED`] have failed.
///
/// What is no gait of the walker, as another worker may have sent it, stays without a certificate.
///
/// # Errors
/// What learner and database report.
pub async fn certify(
    store: &mut Store,
    actor: &Actor,
    snapshot: StudySnapshot,
    beliefs: Arc<Beliefs>,
) -> Result<Judged, Error> {
    let rank = move |pool: &OnPool| choice::ranking_to_show(pool, &snapshot, &beliefs);
    let ranking = store.compute(rank).await?.map_err(Error::Learner)?;
    let mut refused = BTreeSet::new();
    loop {
        let next = next_to_certify(&mut *store.read().await?, &ranking, &refused).await?;
        let Some(trial) = next else { break };
        let begun = certification::begin(&mut *store.read().await?, trial).await?;
        let certificate = match certification::certificate(store, begun).await {
            Ok(certificate) => certificate,
            Err(error) if error.is_input() => {
                tracing::warn!(%trial, %error, "what a trial gave cannot be certified");
                refused.insert(trial);
                continue;
            }
            Err(error) => return Err(error),
        };
        let mut writer = store.write().await?;
        certification::record(&mut writer, actor, trial, &certificate).await?;
        commit(writer).await?;
    }
    Ok(judged(&mut *store.read().await?, &ranking).await?)
}
