//! The recommended gait on the study page.

use crate::bound_units;
use crate::format;
use crate::pages::certificate::InWords;
use gait_optimizer::TunedBounds;
use gaitwright_service::studies::certified_best::{BestCertification, CertificateState};
use gaitwright_service::studies::execution;
use gaitwright_service::studies::identical_gaits::is_same_gait;
use gaitwright_service::studies::snapshot::StudySnapshot;
use gaitwright_store::feedback::{FeedbackContent, Source};
use gaitwright_store::trials::Trial;
use gaitwright_store::{Connection, StoreResult, TrialId, certificates, gaits};

/// Findings about the recommended gait besides its trial: certificates and simulated walks.
pub(super) struct BestFindings {
    /// The states of the certificates.
    pub(super) certification: BestCertification,
    /// The values of its certificate; empty without one.
    certificate: Vec<(&'static str, String)>,
    /// How many simulated walks with it were complete.
    simulated_walks: Option<String>,
    /// Whether its trajectory is stored.
    has_gait: bool,
}

impl BestFindings {
    pub(super) async fn read(
        db: &mut Connection,
        best: Option<TrialId>,
        certification: BestCertification,
    ) -> StoreResult<Self> {
        let Some(best) = best else {
            return Ok(Self { certification, certificate: Vec::new(), simulated_walks: None, has_gait: false });
        };
        let certificate = certificates::find(db, best).await?.map(|certificate| InWords::new(certificate).values);
        let simulated_walks = execution::newest(db, best).await?.map(|kept| {
            let report = kept.reported.report;
            format!("{} Mean strides: {:.2}.", report.sentence(), report.mean_strides())
        });
        let has_gait = gaits::exists(db, best).await?;
        Ok(Self { certification, certificate: certificate.unwrap_or_default(), simulated_walks, has_gait })
    }

    pub(super) fn of(self, trial: &Trial, snapshot: &StudySnapshot) -> BestGait {
        let limit = |(name, value): (&&'static str, f64)| (*name, bound_units::limit_in_words(name, value));
        let passing = self.certification.passing.and_then(|id| snapshot.trial(id));
        BestGait {
            id: trial.id,
            number: trial.number,
            rmse: format::decimal(trial.gait_rmse_rad),
            cost: format::decimal(trial.cost_of_transport),
            bounds: TunedBounds::NAMES.iter().zip(trial.action.to_array()).map(limit).collect(),
            preferred: preferred(trial, snapshot),
            has_gait: self.has_gait,
            by_script: trial.script.is_some(),
            passing: passing.map(|trial| Passing {
                id: trial.id,
                number: trial.number,
                rmse: format::decimal(trial.gait_rmse_rad),
            }),
            certification: self.certification,
            certificate: self.certificate,
            simulated_walks: self.simulated_walks,
        }
    }
}

/// How many answers of people prefer this gait, in words; empty if none is about it.
pub(in crate::pages) fn preferred(best: &Trial, snapshot: &StudySnapshot) -> String {
    let is_best = |id: TrialId| snapshot.trial(id).is_some_and(|trial| is_same_gait(trial, best));
    let by_people = snapshot
        .feedback
        .iter()
        .filter(|row| row.retraction.is_none() && !matches!(row.source, Source::GaitRmse | Source::Evaluation));
    let (mut wins, mut all) = (0_usize, 0_usize);
    for row in by_people {
        match row.content {
            FeedbackContent::Preference { winner, loser } if is_best(winner) || is_best(loser) => {
                wins += usize::from(is_best(winner));
                all += 1;
            }
            FeedbackContent::NoDifference { a, b } if is_best(a) || is_best(b) => all += 1,
            _ => {}
        }
    }
    match all {
        0 => String::new(),
        1 if wins == 1 => "the only answer about this gait prefers it".to_owned(),
        1 => "the only answer about this gait does not prefer it".to_owned(),
        2 if wins == 2 => "both answers about this gait prefer it".to_owned(),
        all if wins == all => format!("all {all} answers about this gait prefer it"),
        _ => format!("{wins} of the {all} answers about this gait prefer it"),
    }
}

/// The recommended gait.
pub(super) struct BestGait {
    pub(super) id: TrialId,
    pub(super) number: u32,
    pub(super) rmse: String,
    pub(super) cost: String,
    /// Names and limits in words.
    pub(super) bounds: Vec<(&'static str, String)>,
    /// How many answers of people prefer it; empty without answers.
    pub(super) preferred: String,
    pub(super) has_gait: bool,
    /// Whether a script evaluated it and reported values only.
    pub(super) by_script: bool,
    /// The state of its certificate.
    pub(super) certification: BestCertification,
    /// The values of its certificate.
    pub(super) certificate: Vec<(&'static str, String)>,
    /// How many simulated walks with it were complete; `None` if none were simulated.
    pub(super) simulated_walks: Option<String>,
    /// If it failed, the best trial whose gait passed.
    pub(super) passing: Option<Passing>,
}

impl BestGait {
    pub(super) fn failed(&self) -> bool {
        self.certification.certificate == CertificateState::Failed
    }

    pub(super) fn passed(&self) -> bool {
        self.certification.certificate == CertificateState::Passed
    }

    pub(super) fn is_being_certified(&self) -> bool {
        self.certification.certificate == CertificateState::BeingCertified
    }
}

/// A trial whose gait passed its certificate.
pub(super) struct Passing {
    pub(super) id: TrialId,
    pub(super) number: u32,
    pub(super) rmse: String,
}
