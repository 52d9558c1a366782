//! A study with its trials, as charts of one or of several studies show it.

use super::outcome::StudyOutcome;
use super::utility::utility;
use gaitwright_charts::Figure;
use gaitwright_compute::OnPool;
use gaitwright_service::error::Error;
use gaitwright_service::studies::analysis::{Analyses, too_large_to_wait};
use gaitwright_service::studies::snapshot::StudySnapshot;
use gaitwright_store::trials::TrialCounts;
use gaitwright_store::{Connection, StudyId, consents, devices, feedback, reference_gaits, studies, subjects, trials};

/// How many of the newest trials of a large study are drawn.
const NEWEST: u32 = 200;

/// Maximum number of studies in one chart.
pub(crate) const MAX_IN_A_CHART: usize = 6;

/// Whether these studies have the same reference gait. Otherwise their Gait RMSE measures different things.
pub(crate) fn have_one_reference_gait(studies: &[&StudySnapshot]) -> bool {
    studies.windows(2).all(|pair| pair[0].study.plan.reference_gait_id == pair[1].study.plan.reference_gait_id)
}

/// A study with its snapshot and its reference gait.
pub(crate) struct StudyResults {
    pub(crate) snapshot: StudySnapshot,
    pub(crate) subject: String,
    /// Name of the device.
    pub(crate) device: String,
    /// Name of the reference gait.
    pub(crate) reference_gait: String,
    pub(crate) counts: TrialCounts,
    /// Whether no request waits for its posterior. Then the snapshot has the newest trials only.
    is_large: bool,
}

impl StudyResults {
    pub(crate) async fn read(db: &mut Connection, id: StudyId) -> Result<Self, Error> {
        let study = studies::get(db, id).await?;
        consents::may_be_shown(db, id).await?;
        let subject = subjects::get(db, study.plan.subject_id).await?.pseudonym;
        let device = devices::get(db, study.plan.device_id).await?.name;
        let reference_gait = reference_gaits::get(db, study.plan.reference_gait_id).await?.name;
        let counts = trials::counts(db, id).await?;
        let answers = feedback::count(db, id).await? as usize;
        let is_large = too_large_to_wait(counts.total as usize, answers).is_some();
        let snapshot = if is_large {
            StudySnapshot::newest(db, study, NEWEST).await?
        } else {
            StudySnapshot::read(db, study).await?
        };
        Ok(Self { snapshot, subject, device, reference_gait, counts, is_large })
    }

    pub(crate) fn outcome(&self, pool: &OnPool, analyses: &Analyses) -> Result<StudyOutcome, Error> {
        StudyOutcome::of(pool, &self.snapshot, self.is_large, analyses).map_err(Error::Learner)
    }

    /// The utility of the recommended gait over the answers of people; `None` of a large study.
    pub(crate) fn utility(&self, pool: &OnPool, analyses: &Analyses) -> Result<Option<Figure>, Error> {
        if self.is_large {
            return Ok(None);
        }
        utility(pool, &self.snapshot, analyses).map_err(Error::Learner)
    }
}
