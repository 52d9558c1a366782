//! The gaits that a person may walk with, be asked about or be given for a device.
//!
//! [`WalkableGait`] has private fields and one constructor, [`admit`]. Every controller file, walk, planned session,
//! comparison and recommendation takes one, so a way to a person that skips the rules does not compile.

use super::safety_reports::SafetyReports;
use crate::error::Error;
use gait_optimizer::export::ControllerFile;
use gait_optimizer::{Gait, SolveReport};
use gaitwright_store::certificates::{self, CertificateOnRecord};
use gaitwright_store::trials::{Trial, TrialState};
use gaitwright_store::{Connection, Packed, StoreError, StoreResult, StudyId, TrialId, consents, gaits, trials};
use std::collections::HashMap;
use thiserror::Error as ThisError;

/// What is known of the certificate of a walkable gait.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Certified {
    /// It passed.
    Passed,
    /// It failed, and the controller file says so.
    Failed,
    /// The lab evaluated the trial itself; the record has no gait to certify.
    ByLab,
}

/// A converged gait with a known certificate and no open safety report, of a subject who has not withdrawn.
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

    /// What its certificate says.
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

    /// The controller file of this gait, which says whether it passed its certificate. `gait` is [`Self::trajectory`].
    ///
    /// # Errors
    /// [`Error::Invalid`] for a rate out of range.
    pub fn controller_file(&self, gait: &Gait, rate_hz: f64) -> Result<String, Error> {
        let certificate_passed = Some(self.certified == Certified::Passed);
        pretty(&ControllerFile { certificate_passed, ..ControllerFile::new(gait, rate_hz)? })
    }

    /// The controller file of this gait for a blinded walk: nothing in it names the gait.
    ///
    /// # Errors
    /// [`Error::Invalid`] for a rate out of range.
    pub fn blinded_controller_file(&self, gait: &Gait, rate_hz: f64) -> Result<String, Error> {
        pretty(&ControllerFile::new(gait, rate_hz)?)
    }
}

fn pretty(file: &ControllerFile) -> Result<String, Error> {
    serde_json::to_string_pretty(file).map_err(|e| Error::Internal(e.to_string()))
}

/// Why nobody may walk with a gait.
#[derive(Debug, Clone, PartialEq, Eq, ThisError)]
pub enum NotWalkable {
    /// The subject withdrew consent.
    #[error("the subject withdrew consent")]
    Withdrawn,
    /// The trial has no converged gait.
    #[error("trial {number} is {state}: only a converged gait can be walked with or compared")]
    NotConverged {
        /// Number of the trial.
        number: u32,
        /// Its state.
        state: &'static str,
    },
    /// Somebody reported the gait as unsafe, and the report is open.
    #[error(
        "the gait of trial {number} was called unsafe by {by}: nobody walks with it until staff decide that it may be walked with again"
    )]
    ReportedUnsafe {
        /// Number of the trial.
        number: u32,
        /// Who reported it.
        by: String,
    },
    /// The gait has no certificate yet.
    #[error(
        "the gait of trial {number} has no certificate yet: it is being certified, or POST /api/v1/trials/{id}/certificate certifies it now"
    )]
    NotCertified {
        /// The trial.
        id: TrialId,
        /// Its number.
        number: u32,
    },
    /// The trajectory was pruned before it was certified.
    #[error("the gait of trial {number} was pruned and never certified")]
    Pruned {
        /// Number of the trial.
        number: u32,
    },
}

impl NotWalkable {
    /// The same as the refusal of a field that names the trial.
    pub fn of_field(&self, field: &str, trial: TrialId) -> Error {
        Error::invalid(field, trial.to_string(), &format!("a gait that may be walked with ({self})"))
    }
}

impl From<NotWalkable> for Error {
    fn from(reason: NotWalkable) -> Self {
        Self::conflict(reason.to_string())
    }
}

/// What the rules need to know of a study: who reported what, which gaits have certificates, and consent.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Grounds {
    /// Safety reports and what staff decided.
    pub safety_reports: SafetyReports,
    /// Certificates of converged trials.
    pub certificates: HashMap<TrialId, CertificateOnRecord>,
    /// Whether the subject withdrew.
    pub withdrawn: bool,
}

impl Grounds {
    /// Reads them.
    ///
    /// # Errors
    /// What the database reports.
    pub async fn read(db: &mut Connection, study: StudyId) -> StoreResult<Self> {
        Ok(Self {
            safety_reports: SafetyReports::read(db, study).await?,
            certificates: certificates::of_study(db, study).await?,
            withdrawn: consents::is_withdrawn(db, study).await?,
        })
    }

    /// The same with the certificates of a few trials of the study alone, for changes: they hold the only writer, and a study
    /// may have ten thousand trials. Any other trial is refused.
    ///
    /// # Errors
    /// What the database reports.
    pub async fn read_for(db: &mut Connection, study: StudyId, trials: &[TrialId]) -> StoreResult<Self> {
        let mut found = HashMap::new();
        for &trial in trials {
            found.extend(certificates::of_trial(db, trial).await?.map(|certificate| (trial, certificate)));
        }
        Ok(Self {
            safety_reports: SafetyReports::read(db, study).await?,
            certificates: found,
            withdrawn: consents::is_withdrawn(db, study).await?,
        })
    }

    /// Whether the gait of a trial may reach a person: the one place that decides.
    ///
    /// # Errors
    /// [`NotWalkable`] with the first reason.
    pub fn admit(&self, trial: &Trial) -> Result<WalkableGait, NotWalkable> {
        let number = trial.number;
        if self.withdrawn {
            return Err(NotWalkable::Withdrawn);
        }
        if trial.state != TrialState::Converged {
            return Err(NotWalkable::NotConverged { number, state: trial.state.as_str() });
        }
        if let Some(closed) = self.safety_reports.closed.iter().find(|closed| closed.trial == trial.id) {
            return Err(NotWalkable::ReportedUnsafe { number, by: closed.by.clone() });
        }
        let certified = match self.certificates.get(&trial.id) {
            _ if trial.asked_by.is_some() => Certified::ByLab,
            Some(CertificateOnRecord::Passed) => Certified::Passed,
            Some(CertificateOnRecord::Failed) => Certified::Failed,
            Some(CertificateOnRecord::NotCertified) => {
                return Err(NotWalkable::NotCertified { id: trial.id, number });
            }
            Some(CertificateOnRecord::Pruned) | None => return Err(NotWalkable::Pruned { number }),
        };
        Ok(WalkableGait { trial: trial.id, number, study: trial.study_id, certified })
    }

    /// Whether a gait may be chosen for a comparison once it is certified: the choice must not depend on when that is.
    pub fn may_become_walkable(&self, trial: &Trial) -> bool {
        matches!(self.admit(trial), Ok(_) | Err(NotWalkable::NotCertified { .. }))
    }
}

/// The gait of a trial, if it may reach a person.
///
/// # Errors
/// What the database reports, with a trial that does not exist.
pub async fn admit(db: &mut Connection, trial: TrialId) -> StoreResult<Result<WalkableGait, NotWalkable>> {
    let trial = trials::get(db, trial).await?;
    Ok(Grounds::read_for(db, trial.study_id, &[trial.id]).await?.admit(&trial))
}

/// Whether both gaits of a pair that was drawn earlier may still reach a person.
///
/// # Errors
/// What the database reports, with a trial that does not exist.
pub async fn are_walkable(db: &mut Connection, (a, b): (TrialId, TrialId)) -> StoreResult<bool> {
    Ok(admit(db, a).await?.is_ok() && admit(db, b).await?.is_ok())
}

/// Two different gaits of one study that a person may be asked about.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct WalkablePair {
    first: WalkableGait,
    second: WalkableGait,
}

impl WalkablePair {
    /// A pair of two gaits. `None`: they are of two studies, or they are the same gait.
    pub fn of((first, of_first): (WalkableGait, &Trial), (second, of_second): (WalkableGait, &Trial)) -> Option<Self> {
        let distinct = first.study == second.study && first.trial != second.trial && !is_same_gait(of_first, of_second);
        distinct.then_some(Self { first, second })
    }

    /// The trials, in the order of the pair.
    pub fn trials(&self) -> (TrialId, TrialId) {
        (self.first.trial, self.second.trial)
    }
}

/// The pair of two trials of a study; `fields` named them.
///
/// # Errors
/// [`Error::NotFound`], or [`Error::Invalid`] naming the field that is at fault.
pub async fn admit_pair(
    db: &mut Connection,
    study: StudyId,
    fields: (&str, &str),
    pair: (TrialId, TrialId),
) -> Result<WalkablePair, Error> {
    let first = trial_of_study(db, study, fields.0, pair.0).await?;
    let second = trial_of_study(db, study, fields.1, pair.1).await?;
    let grounds = Grounds::read_for(db, study, &[first.id, second.id]).await?;
    if grounds.withdrawn {
        return Err(NotWalkable::Withdrawn.into());
    }
    let admit = |field: &str, trial: &Trial| grounds.admit(trial).map_err(|reason| reason.of_field(field, trial.id));
    let (a, b) = (admit(fields.0, &first)?, admit(fields.1, &second)?);
    let same = format!("another gait than {}: both trials gave the same one", fields.0);
    WalkablePair::of((a, &first), (b, &second)).ok_or_else(|| Error::invalid(fields.1, pair.1.to_string(), &same))
}

/// A trial of this study; `field` named it.
///
/// # Errors
/// [`Error::Invalid`], the same for a trial of another study and for one that does not exist.
pub async fn trial_of_study(db: &mut Connection, study: StudyId, field: &str, id: TrialId) -> Result<Trial, Error> {
    match trials::get(db, id).await {
        Ok(trial) if trial.study_id == study => Ok(trial),
        Ok(_) | Err(StoreError::Missing { .. }) => Err(Error::invalid(field, id.to_string(), "a trial of this study")),
        Err(other) => Err(other.into()),
    }
}

/// Whether two trials gave the very same motion, as when a bound changed that no gait comes near. So many figures agree to
/// the last bit in no other case.
pub fn is_same_gait(one: &Trial, other: &Trial) -> bool {
    let figures = |report: &SolveReport| {
        let single = [report.objective, report.cost_of_transport, report.stride_length_m];
        let all = single.iter().chain(&report.gait_rmse_parts_rad).chain(&report.durations_s).chain(&report.vhip_m_s);
        all.map(|figure| figure.to_bits()).collect::<Vec<_>>()
    };
    one.id == other.id
        || one.report.as_ref().zip(other.report.as_ref()).is_some_and(|(one, other)| figures(one) == figures(other))
}
