//! Decides which gaits may reach a person: be walked with, compared or exported for a device.
//!
//! [`WalkableGait`] has private fields and one constructor, [`admit`]. Every controller file, walk, lab session,
//! comparison and recommendation takes one, so code that skips the rules does not compile.

use super::identical_gaits::is_same_gait;
use super::safety_reports::SafetyReports;
use super::trial_transitions::has_state;
use crate::error::{Error, FieldError};
use gait_optimizer::Gait;
use gaitwright_store::certificates::{self, CertificateOnRecord};
use gaitwright_store::trials::{Trial, TrialState};
use gaitwright_store::{
    Connection, Packed, StoreError, StoreResult, StudyId, TrialId, consents, gaits, imports, trials,
};
use std::collections::HashMap;
use thiserror::Error as ThisError;

/// The certificate of a walkable gait.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Certified {
    /// The certificate passed.
    Passed,
    /// The certificate failed, which the controller file states.
    Failed,
    /// A lab script evaluated the trial, so the record has no gait to certify.
    ByLab,
}

/// A converged gait with a certificate and without a safety report in force, of a subject who has not withdrawn consent.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct WalkableGait {
    trial: TrialId,
    number: u32,
    study: StudyId,
    certified: Certified,
}

impl WalkableGait {
    /// Its trial.
    pub fn trial(&self) -> TrialId {
        self.trial
    }

    /// Number of its trial.
    pub fn number(&self) -> u32 {
        self.number
    }

    /// State of its certificate.
    pub fn certified(&self) -> Certified {
        self.certified
    }

    /// The trajectory.
    ///
    /// # Errors
    /// [`gaitwright_store::StoreError::Missing`] when it was pruned or the lab evaluated the trial.
    pub async fn trajectory(&self, db: &mut Connection) -> StoreResult<Packed<Gait>> {
        gaits::get(db, self.trial).await
    }
}

/// Why a gait must not be used for walking or compared.
#[derive(Debug, Clone, PartialEq, Eq, ThisError)]
pub enum NotWalkable {
    /// The subject withdrew consent.
    #[error("The subject withdrew consent.")]
    Withdrawn,
    /// The trial has no converged gait.
    #[error("Trial {number} {}. Only a converged gait can be used for walking or compared.", has_state(*state))]
    NotConverged {
        /// Number of the trial.
        number: u32,
        /// Its state.
        state: TrialState,
    },
    /// The gait has a safety report in force.
    #[error(
        "The gait of trial {number} was reported as unsafe by {by}. Do not walk with it until staff have cleared it."
    )]
    ReportedUnsafe {
        /// Number of the trial.
        number: u32,
        /// Author of the report.
        by: String,
    },
    /// Another trial of the subject has the same gait, which has a safety report in force.
    #[error(
        "Trial {number} has the same gait as {other}, which was reported as unsafe by {by}. Do not walk with it until staff \
         have cleared the gait of {other}."
    )]
    SameGaitReportedUnsafe {
        /// Number of the trial.
        number: u32,
        /// The other trial, as shown to people.
        other: String,
        /// Author of the report.
        by: String,
    },
    /// The gait has no certificate yet.
    #[error(
        "The gait of trial {number} has no certificate yet. If it is not being certified, press Certify on its \
         page or request its certificate."
    )]
    NotCertified {
        /// The trial.
        id: TrialId,
        /// Its number.
        number: u32,
    },
    /// The study came from an archive without a trusted signature, and no certificate passed here.
    #[error(
        "Trial {number} belongs to a study from an archive without a trusted signature. Its gait must not be used \
         for walking or compared unless it has passed certification on this service."
    )]
    Unconfirmed {
        /// Number of the trial.
        number: u32,
    },
    /// The trajectory was pruned before it was certified.
    #[error(
        "The trajectory of trial {number} was deleted before its gait was certified, so the gait cannot be used for \
         walking or compared."
    )]
    Pruned {
        /// Number of the trial.
        number: u32,
    },
}

impl NotWalkable {
    /// The error for a request field that names the trial.
    pub fn of_field(&self, field: &str, trial: TrialId) -> Error {
        FieldError::new(field, trial.to_string(), "a walkable gait").because(self).into()
    }
}

impl From<NotWalkable> for Error {
    fn from(reason: NotWalkable) -> Self {
        Self::conflict(reason.to_string())
    }
}

/// The facts that decide which gaits of a study are walkable: safety reports, certificates, consent and origin.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Grounds {
    /// Safety reports and their reviews.
    pub safety_reports: SafetyReports,
    /// Certificates of converged trials.
    pub certificates: HashMap<TrialId, CertificateOnRecord>,
    /// Whether the subject withdrew consent.
    pub withdrawn: bool,
    /// Whether the study came from an archive without a trusted signature. Nobody vouches for its figures and states,
    /// so only a certificate made here can admit one of its gaits.
    pub untrusted: bool,
}

impl Grounds {
    /// Reads the facts of a study.
    ///
    /// # Errors
    /// Errors of the database.
    pub async fn read(db: &mut Connection, study: StudyId) -> StoreResult<Self> {
        Ok(Self {
            safety_reports: SafetyReports::read(db, study).await?,
            certificates: certificates::of_study(db, study).await?,
            withdrawn: consents::is_withdrawn(db, study).await?,
            untrusted: imports::is_untrusted(db, study).await?,
        })
    }

    /// Reads the facts with the certificates of a few trials only. For changes, which hold the only writer while a
    /// study may have ten thousand trials. Any other trial is refused.
    ///
    /// # Errors
    /// Errors of the database.
    pub async fn read_for(db: &mut Connection, study: StudyId, trials: &[TrialId]) -> StoreResult<Self> {
        Ok(Self {
            safety_reports: SafetyReports::read(db, study).await?,
            certificates: certificates::of_trials(db, trials).await?,
            withdrawn: consents::is_withdrawn(db, study).await?,
            untrusted: imports::is_untrusted(db, study).await?,
        })
    }

    /// Decides whether the gait of a trial may reach a person. No other function does.
    ///
    /// # Errors
    /// [`NotWalkable`] with the first reason.
    pub fn admit(&self, trial: &Trial) -> Result<WalkableGait, NotWalkable> {
        let number = trial.number;
        if self.withdrawn {
            return Err(NotWalkable::Withdrawn);
        }
        if trial.state != TrialState::Converged {
            return Err(NotWalkable::NotConverged { number, state: trial.state });
        }
        if let Some(report) = self.safety_reports.unsafe_motions.about(trial) {
            return Err(match report.other_trial(trial) {
                None => NotWalkable::ReportedUnsafe { number, by: report.report.by.clone() },
                Some(other) => NotWalkable::SameGaitReportedUnsafe { number, other, by: report.report.by.clone() },
            });
        }
        let certified = match self.certificates.get(&trial.id) {
            _ if trial.script.is_some() => Certified::ByLab,
            Some(CertificateOnRecord::Passed) => Certified::Passed,
            Some(CertificateOnRecord::Failed) => Certified::Failed,
            Some(CertificateOnRecord::NotCertified) => {
                return Err(NotWalkable::NotCertified { id: trial.id, number });
            }
            Some(CertificateOnRecord::Pruned) | None => return Err(NotWalkable::Pruned { number }),
        };
        if self.untrusted && certified != Certified::Passed {
            return Err(NotWalkable::Unconfirmed { number });
        }
        Ok(WalkableGait { trial: trial.id, number, study: trial.study_id, certified })
    }

    /// Whether a gait could be walkable once it is certified. Comparisons choose among these, so that the choice does
    /// not depend on when certificates arrive.
    pub fn may_become_walkable(&self, trial: &Trial) -> bool {
        matches!(self.admit(trial), Ok(_) | Err(NotWalkable::NotCertified { .. }))
    }
}

/// The gait of a trial, if it may reach a person.
///
/// # Errors
/// Errors of the database, even for a trial that does not exist.
pub async fn admit(db: &mut Connection, trial: TrialId) -> StoreResult<Result<WalkableGait, NotWalkable>> {
    let trial = trials::get(db, trial).await?;
    Ok(Grounds::read_for(db, trial.study_id, &[trial.id]).await?.admit(&trial))
}

/// Whether both gaits of an earlier pair are still walkable.
///
/// # Errors
/// Errors of the database, even for a trial that does not exist.
pub async fn are_walkable(db: &mut Connection, (a, b): (TrialId, TrialId)) -> StoreResult<bool> {
    Ok(admit(db, a).await?.is_ok() && admit(db, b).await?.is_ok())
}

/// Two different walkable gaits of one study.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct WalkablePair {
    first: WalkableGait,
    second: WalkableGait,
}

impl WalkablePair {
    /// A pair of two gaits. `None` if they belong to two studies or are the same motion.
    pub fn of((first, of_first): (WalkableGait, &Trial), (second, of_second): (WalkableGait, &Trial)) -> Option<Self> {
        let distinct = first.study == second.study && first.trial != second.trial && !is_same_gait(of_first, of_second);
        distinct.then_some(Self { first, second })
    }

    /// The trials, in the order of the pair.
    pub fn trials(&self) -> (TrialId, TrialId) {
        (self.first.trial, self.second.trial)
    }
}

/// The pair of two trials of a study; `fields` name them.
///
/// # Errors
/// [`Error::NotFound`], or [`Error::Invalid`] naming the field.
pub async fn admit_pair(
    db: &mut Connection,
    study: StudyId,
    fields: (&str, &str),
    pair: (TrialId, TrialId),
) -> Result<WalkablePair, Error> {
    let (first, second) = trials::pair(db, pair).await?;
    let first = first.filter(|trial| trial.study_id == study).ok_or_else(|| not_of_study(fields.0, pair.0))?;
    let second = second.filter(|trial| trial.study_id == study).ok_or_else(|| not_of_study(fields.1, pair.1))?;
    let grounds = Grounds::read_for(db, study, &[first.id, second.id]).await?;
    if grounds.withdrawn {
        return Err(NotWalkable::Withdrawn.into());
    }
    let admit = |field: &str, trial: &Trial| grounds.admit(trial).map_err(|reason| reason.of_field(field, trial.id));
    let (a, b) = (admit(fields.0, &first)?, admit(fields.1, &second)?);
    let other = "a different gait: both trials have the same one";
    WalkablePair::of((a, &first), (b, &second)).ok_or_else(|| Error::invalid(fields.1, pair.1.to_string(), other))
}

/// The trial of this study that `field` names.
///
/// # Errors
/// [`Error::Invalid`], with the same text for a trial of another study and for one that does not exist.
pub async fn trial_of_study(db: &mut Connection, study: StudyId, field: &str, id: TrialId) -> Result<Trial, Error> {
    match trials::get(db, id).await {
        Ok(trial) if trial.study_id == study => Ok(trial),
        Ok(_) | Err(StoreError::Missing { .. }) => Err(not_of_study(field, id)),
        Err(other) => Err(other.into()),
    }
}

fn not_of_study(field: &str, id: TrialId) -> Error {
    Error::invalid(field, id.to_string(), "a trial of this study")
}
