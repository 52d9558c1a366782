//! Motions that were reported as unsafe: a safety report about one trial is about every trial of the subject with the same
//! motion, in any study.

use super::identical_gaits::MotionIdentity;
use super::reported_gait::ReportedGait;
use gait_optimizer::TunedBounds;
use gaitwright_store::trials::{self, Trial};
use gaitwright_store::{Connection, StoreResult, StudyId};

/// A report in force with the motion that it is about, which other trials of the subject can have, too.
#[derive(Debug, Clone, PartialEq)]
pub struct ReportedMotion {
    /// The report.
    pub report: ReportedGait,
    /// The study of the report.
    study: StudyId,
    /// Number of the trial of the report.
    number: u32,
    /// Whether its study has the device of the study for which the reports were read.
    same_device: bool,
    motion: Option<MotionIdentity>,
}

impl ReportedMotion {
    /// Whether the report is about this motion of a trial of the study for which the reports were read.
    fn has(&self, motion: &MotionIdentity) -> bool {
        self.motion.as_ref().is_some_and(|own| {
            if self.same_device { own.is_same(motion) } else { own.is_same_with_another_device(motion) }
        })
    }

    /// The trial of the report, as shown to people, if it is not the given one.
    pub fn other_trial(&self, trial: &Trial) -> Option<String> {
        if self.report.trial == trial.id {
            None
        } else if self.study == trial.study_id {
            Some(format!("trial {}", self.number))
        } else {
            Some(format!("trial {} of another study of this subject", self.number))
        }
    }
}

/// The motions of all reports in force of a subject, as seen from one study.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct MotionsReportedUnsafe(Vec<ReportedMotion>);

impl MotionsReportedUnsafe {
    /// Adds the motions of the reports in force of a study, which may have another device.
    pub(super) async fn add(
        &mut self,
        db: &mut Connection,
        (study, same_device): (StudyId, bool),
        reports: Vec<ReportedGait>,
    ) -> StoreResult<()> {
        for report in reports {
            let trial = trials::get(db, report.trial).await?;
            let (number, motion) = (trial.number, MotionIdentity::of(&trial));
            self.0.push(ReportedMotion { report, study, number, same_device, motion });
        }
        Ok(())
    }

    /// A report in force about the gait of this trial, which may have been given for another trial of the subject.
    pub fn about(&self, trial: &Trial) -> Option<&ReportedMotion> {
        if self.0.is_empty() {
            return None;
        }
        let own = self.0.iter().find(|motion| motion.report.trial == trial.id);
        own.or_else(|| {
            MotionIdentity::of(trial).and_then(|motion| self.0.iter().find(|reported| reported.has(&motion)))
        })
    }

    /// The bounds of gaits with a report in force and with the device of this study. A lab script must not evaluate them
    /// again, because the subject may walk in its evaluation.
    pub fn bounds(&self) -> impl Iterator<Item = TunedBounds> {
        let on_device = self.0.iter().filter(|motion| motion.same_device);
        on_device.filter_map(|reported| reported.motion.as_ref()).map(MotionIdentity::bounds)
    }

    /// Whether a report in force is about the gait of this trial.
    pub fn include(&self, trial: &Trial) -> bool {
        self.about(trial).is_some()
    }
}
