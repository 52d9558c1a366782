//! A gait in a safety report: who reported it, where and why.

use gaitwright_store::safety_reviews::SafetyReview;
use gaitwright_store::{AssessmentId, BlindPairId, Instant, LabSessionId, SafetyReportId, TrialId};

/// A gait in a safety report. While the report is in force, the gait is neither recommended nor compared nor walked.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ReportedGait {
    /// The trial.
    pub trial: TrialId,
    /// Author of the report, as shown to people.
    pub by: String,
    /// Time of the report.
    pub at: Instant,
    /// Note of staff in a report or an assessment. Empty for raters and for the subject in a blinded lab session, whose
    /// notes could tell which gait was shown first.
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
