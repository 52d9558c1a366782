//! The certificates of the best gaits of a study, so that a recommendation always states whether its gait passed.

use super::analysis::Analyses;
use super::certification;
use super::recommended_trial;
use super::snapshot::StudySnapshot;
use crate::error::Error;
use gaitwright_compute::OnPool;
use gaitwright_store::audit::Actor;
use gaitwright_store::{Connection, Store, StoreResult, TrialId, certificates, commit, gaits};
use serde::Serialize;
use std::collections::BTreeSet;
use std::sync::Arc;
use utoipa::ToSchema;

/// The most gaits that are certified in search of one that passes.
pub const MAX_CERTIFIED: usize = 10;

/// State of the certificate of a gait: `passed`, every checked value is within its limit, the walker does not fall and
/// the gait is stable; `failed`, the certificate did not pass; `being_certified`, the gait is being certified;
/// `not_certified`, the gait has no certificate.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum CertificateState {
    /// Every checked value is within its limit, the walker does not fall, and the gait is stable.
    Passed,
    /// The certificate did not pass.
    Failed,
    /// The gait is being certified.
    BeingCertified,
    /// The gait has no certificate.
    #[default]
    NotCertified,
}

impl CertificateState {
    /// The name in tables.
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Passed => "passed",
            Self::Failed => "failed",
            Self::BeingCertified => "being_certified",
            Self::NotCertified => "not_certified",
        }
    }
}

/// The certificate of the best gait of a study, and an alternative if it failed.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct BestCertification {
    /// State of the certificate of the best gait.
    pub certificate: CertificateState,
    /// Reasons if the certificate failed.
    pub failures: Vec<String>,
    /// If the best gait failed, the best one that passed.
    pub passing: Option<TrialId>,
    /// The best gait without a certificate among the first [`MAX_CERTIFIED`], unless a better one passed.
    pub without_certificate: Option<TrialId>,
    /// Whether the service is certifying that gait.
    pub certifying: bool,
}

impl BestCertification {
    /// Sets whether the service is certifying the best gait without a certificate.
    pub fn certified_by_service(&mut self, certifying: bool) {
        self.certifying = certifying;
        if certifying && self.certificate == CertificateState::NotCertified {
            self.certificate = CertificateState::BeingCertified;
        }
    }
}

/// Reads the certificates of gaits that are ranked best first.
///
/// # Errors
/// Errors of the database.
pub async fn of_ranking(db: &mut Connection, ranking: &[TrialId]) -> StoreResult<BestCertification> {
    let mut certification = BestCertification::default();
    for (place, &trial) in ranking.iter().enumerate() {
        let certificate = match certificates::passed(db, trial).await? {
            Some(true) => CertificateState::Passed,
            Some(false) => CertificateState::Failed,
            None => CertificateState::NotCertified,
        };
        if place == 0 {
            certification.certificate = certificate;
        }
        match certificate {
            CertificateState::Passed => {
                certification.passing = Some(trial).filter(|_| place > 0);
                break;
            }
            CertificateState::Failed => {}
            _ if place < MAX_CERTIFIED && gaits::exists(db, trial).await? => {
                certification.without_certificate.get_or_insert(trial);
            }
            _ => {}
        }
    }
    if let Some(&best) = ranking.first().filter(|_| certification.certificate == CertificateState::Failed) {
        certification.failures = certificates::find(db, best).await?.map(|found| found.failures).unwrap_or_default();
    }
    Ok(certification)
}

/// The next gait to certify. `None` if one has passed, or if the first [`MAX_CERTIFIED`] failed. Skips the gaits in
/// `refused`, which cannot be certified.
///
/// # Errors
/// Errors of the database.
pub async fn next_to_certify(
    db: &mut Connection,
    ranking: &[TrialId],
    refused: &BTreeSet<TrialId>,
) -> StoreResult<Option<TrialId>> {
    for &trial in ranking.iter().take(MAX_CERTIFIED) {
        match certificates::passed(db, trial).await? {
            Some(true) => return Ok(None),
            None if !refused.contains(&trial) && gaits::exists(db, trial).await? => return Ok(Some(trial)),
            Some(false) | None => {}
        }
    }
    Ok(None)
}

/// The gaits that a study recommends or may recommend: the best one, the best one that passed its certificate, and,
/// until one passes, those that are still to be certified.
///
/// # Errors
/// Errors of the database.
pub async fn worth_keeping(db: &mut Connection, ranking: &[TrialId]) -> StoreResult<Vec<TrialId>> {
    let mut kept = Vec::new();
    for (place, &trial) in ranking.iter().enumerate() {
        let passed = certificates::passed(db, trial).await?;
        if place == 0 || passed == Some(true) || (passed.is_none() && place < MAX_CERTIFIED) {
            kept.push(trial);
        }
        if passed == Some(true) {
            break;
        }
    }
    Ok(kept)
}

/// Certifies the gaits of a study, best first, until one passes or [`MAX_CERTIFIED`] have failed.
///
/// A malformed gait, as another worker may have sent it, stays without a certificate.
///
/// # Errors
/// Errors of the learner and the database.
pub async fn certify(
    store: &mut Store,
    actor: &Actor,
    snapshot: StudySnapshot,
    analyses: Arc<Analyses>,
) -> Result<BestCertification, Error> {
    let rank = move |pool: &OnPool| recommended_trial::ranking_to_show(pool, &snapshot, &analyses);
    let ranking = store.compute(rank).await?.map_err(Error::Learner)?;
    let mut refused = BTreeSet::new();
    loop {
        let next = next_to_certify(&mut *store.read().await?, &ranking, &refused).await?;
        let Some(trial) = next else { break };
        let begun = certification::begin(&mut *store.read().await?, trial).await?;
        let certificate = match certification::certificate(store, begun).await {
            Ok(certificate) => certificate,
            Err(error) if error.is_input() => {
                tracing::warn!(%trial, %error, "the gait of a trial cannot be certified");
                refused.insert(trial);
                continue;
            }
            Err(error) => return Err(error),
        };
        let mut writer = store.write().await?;
        certification::record(&mut writer, actor, trial, &certificate).await?;
        commit(writer).await?;
    }
    Ok(of_ranking(&mut *store.read().await?, &ranking).await?)
}
