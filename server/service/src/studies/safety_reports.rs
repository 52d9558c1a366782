//! Collects the safety reports and the "cannot tell" answers of a study from all places where people give them.

use super::identical_gaits::MotionIdentity;
use crate::access::Reach;
use gait_optimizer::TunedBounds;
use gaitwright_store::blind_pairs::OrderedAnswer;
use gaitwright_store::safety_reports as reports;
use gaitwright_store::safety_reviews::{self, SafetyDecision, SafetyReview};
use gaitwright_store::studies::{self, Study};
use gaitwright_store::trials::{self, Trial};
use gaitwright_store::{
    AssessmentId, BlindPairId, Connection, Instant, LabSessionId, SafetyReportId, StoreResult, StudyId, TrialId,
    assessments, blind_pairs, lab_sessions,
};
use std::collections::HashSet;

/// A gait in a safety report. While the report is in force, the gait is neither recommended nor compared nor walked.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ReportedGait {
    /// The trial.
    pub trial: TrialId,
    /// Who reported it, as shown to people.
    pub by: String,
    /// Time of the report.
    pub at: Instant,
    /// What staff wrote in a report or an assessment. Empty for raters and for the subject in a blinded lab session, whose notes
    /// could tell which gait was shown first.
    pub note: String,
    /// Where it was given.
    pub source: SafetyReportSource,
    /// The newest review by staff.
    pub review: Option<SafetyReview>,
}

/// Where a safety report was given.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SafetyReportSource {
    /// In a blind comparison by a rater.
    Rater(BlindPairId),
    /// In an assessment.
    Staff(AssessmentId),
    /// In a report about this gait alone.
    Alone(SafetyReportId),
    /// By the subject, in a lab session that is not unblinded.
    Subject(LabSessionId),
}

impl ReportedGait {
    /// The identifier of the report, which is that of the object that holds it. The reports about both gaits of a pair
    /// have the same one.
    pub fn id(&self) -> SafetyReportId {
        match self.source {
            SafetyReportSource::Rater(id) => id.into(),
            SafetyReportSource::Staff(id) => id.into(),
            SafetyReportSource::Alone(id) => id,
            SafetyReportSource::Subject(id) => id.into(),
        }
    }
}

/// Accessible studies with safety reports that await review, and the number of such gaits.
///
/// # Errors
/// Errors of the database.
pub async fn undecided(db: &mut Connection, reach: Reach, limit: u32) -> StoreResult<Vec<(Study, usize)>> {
    let mut found = Vec::new();
    for study in studies::with_safety_reports(db, reach, limit).await? {
        let reports = SafetyReports::read(db, study.id).await?.in_force.into_iter();
        let waiting: HashSet<TrialId> =
            reports.filter(|report| report.review.is_none()).map(|report| report.trial).collect();
        if !waiting.is_empty() {
            found.push((study, waiting.len()));
        }
    }
    Ok(found)
}

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

/// The safety reports of a study, and the pairs that are not compared again.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct SafetyReports {
    /// Reports in force: their gaits must not be used for walking.
    pub in_force: Vec<ReportedGait>,
    /// Reports in force of every study of the subject, with their motions.
    motions: Vec<ReportedMotion>,
    /// Reports after which staff cleared the gait for walking.
    pub cleared: Vec<ReportedGait>,
    /// Pairs with an answer "cannot tell".
    pub skipped: Vec<(TrialId, TrialId)>,
}

impl SafetyReports {
    /// Reads the reports of a study that were not retracted, and the motions that reports in any study of its subject are
    /// about.
    ///
    /// # Errors
    /// Errors of the database.
    pub async fn read(db: &mut Connection, study: StudyId) -> StoreResult<Self> {
        let mut found = Self::default();
        for (of, same_device) in studies::of_subject_with_safety_reports(db, study).await? {
            let given = Self::given_in(db, of).await?;
            found.add_motions(db, (of, same_device), given.in_force.clone()).await?;
            if of == study {
                found = Self { motions: found.motions, ..given };
            }
        }
        Ok(found)
    }

    async fn add_motions(
        &mut self,
        db: &mut Connection,
        (study, same_device): (StudyId, bool),
        reports: Vec<ReportedGait>,
    ) -> StoreResult<()> {
        for report in reports {
            let trial = trials::get(db, report.trial).await?;
            let (number, motion) = (trial.number, MotionIdentity::of(&trial));
            self.motions.push(ReportedMotion { report, study, number, same_device, motion });
        }
        Ok(())
    }

    /// The reports of one study.
    async fn given_in(db: &mut Connection, study: StudyId) -> StoreResult<Self> {
        let mut found = Self::default();
        for shown in blind_pairs::assessments_of_study(db, study).await? {
            if let Some((answer, at)) = shown.answer.zip(shown.answered_at) {
                let by = format!("rater {}", shown.rater);
                let report = |trial| ReportedGait {
                    trial,
                    by: by.clone(),
                    at,
                    note: String::new(),
                    source: SafetyReportSource::Rater(shown.id),
                    review: None,
                };
                found.add(answer, shown.trials(), report);
            }
        }
        for assessment in
            assessments::of_study(db, study).await?.iter().filter(|assessment| assessment.retraction.is_none())
        {
            let (by, at, source) =
                (&assessment.author, assessment.created_at, SafetyReportSource::Staff(assessment.id));
            found.add(assessment.answer.into(), assessment.pair(), |trial| ReportedGait {
                trial,
                by: by.clone(),
                at,
                note: assessment.note.clone(),
                source,
                review: None,
            });
        }
        for report in reports::of_study(db, study).await? {
            let (trial, by, at) = (report.trial_id, report.author, report.created_at);
            found.in_force.push(ReportedGait {
                trial,
                by,
                at,
                note: report.note,
                source: SafetyReportSource::Alone(report.id),
                review: None,
            });
        }
        for session in lab_sessions::of_study(db, study).await? {
            if session.done(lab_sessions::SessionStep::Unblinded).is_some() {
                // After unblinding its answers are assessments or preferences.
                continue;
            }
            if let Some(answer) = session.answer().filter(|answer| answer.answer.is_about_safety()) {
                // Naming one of the two gaits would reveal the allocation, so both are kept from walking until unblinding.
                let which = match answer.answer {
                    OrderedAnswer::UnsafeBoth => "both gaits",
                    _ => "blinded: it may be either gait",
                };
                let by = format!("the subject in lab session {} ({which})", session.number);
                let (at, source) = (answer.at, SafetyReportSource::Subject(session.id));
                let report =
                    |trial| ReportedGait { trial, by: by.clone(), at, note: String::new(), source, review: None };
                found.in_force.extend([session.trial_a, session.trial_b].map(report));
            }
        }
        found.review(&safety_reviews::of_study(db, study).await?);
        Ok(found)
    }

    /// Moves the reports whose newest review cleared the gait for walking to `cleared`.
    fn review(&mut self, reviews: &[SafetyReview]) {
        for mut report in std::mem::take(&mut self.in_force) {
            let id = report.id();
            let of_it = |review: &&SafetyReview| review.trial_id == report.trial && review.reports.contains(&id);
            report.review = reviews.iter().rfind(of_it).cloned();
            let is_cleared = report.review.as_ref().is_some_and(|review| review.decision == SafetyDecision::Cleared);
            if is_cleared { self.cleared.push(report) } else { self.in_force.push(report) }
        }
    }

    fn add(&mut self, answer: OrderedAnswer, pair: (TrialId, TrialId), report: impl Fn(TrialId) -> ReportedGait) {
        if answer == OrderedAnswer::CannotTell {
            self.skipped.push(pair);
        }
        self.in_force.extend(answer.unsafe_of(pair).into_iter().map(report));
    }

    /// The reports in force about the gait of this trial.
    pub fn in_force_about(&self, trial: TrialId) -> Vec<ReportedGait> {
        self.in_force.iter().filter(|report| report.trial == trial).cloned().collect()
    }

    /// Whether each of these gaits has a report in force of its own. A report that is sent twice counts once as long as this
    /// holds: after a review it is a new report.
    pub fn are_all_in_force(&self, gaits: &[TrialId]) -> bool {
        gaits.iter().all(|gait| self.in_force.iter().any(|report| report.trial == *gait))
    }

    /// A report in force about the gait of this trial, which may have been given for another trial of the subject.
    pub fn about_motion_of(&self, trial: &Trial) -> Option<&ReportedMotion> {
        if self.motions.is_empty() {
            return None;
        }
        let own = self.motions.iter().find(|motion| motion.report.trial == trial.id);
        own.or_else(|| {
            MotionIdentity::of(trial).and_then(|motion| self.motions.iter().find(|reported| reported.has(&motion)))
        })
    }

    /// The bounds of gaits with a report in force and with the device of this study. A lab script must not evaluate them
    /// again, because the subject may walk in its evaluation.
    pub fn reported_bounds(&self) -> impl Iterator<Item = TunedBounds> {
        let on_device = self.motions.iter().filter(|motion| motion.same_device);
        on_device.filter_map(|reported| reported.motion.as_ref()).map(MotionIdentity::bounds)
    }

    /// Whether the gait of this trial has a report in force.
    pub fn forbids(&self, trial: &Trial) -> bool {
        self.about_motion_of(trial).is_some()
    }

    /// Whether an answer about the two gaits is "cannot tell".
    pub fn is_skipped(&self, (a, b): (TrialId, TrialId)) -> bool {
        self.skipped.iter().any(|pair| *pair == (a, b) || *pair == (b, a))
    }
}
