//! Collects the safety reports and the "cannot tell" answers of a study from all places where people give them.

use super::motions_reported_unsafe::MotionsReportedUnsafe;
use super::reported_gait::{ReportedGait, SafetyReportSource};
use crate::access::Reach;
use gaitwright_store::blind_pairs::OrderedAnswer;
use gaitwright_store::safety_reports as reports;
use gaitwright_store::safety_reviews::{self, SafetyDecision, SafetyReview};
use gaitwright_store::studies::{self, Study};
use gaitwright_store::{Connection, StoreResult, StudyId, TrialId, assessments, blind_pairs, lab_sessions};
use std::collections::HashSet;

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

/// The safety reports of a study, and the pairs that are not compared again.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct SafetyReports {
    /// Reports in force: their gaits must not be used for walking.
    pub in_force: Vec<ReportedGait>,
    /// Motions that reports in force in any study of the subject are about.
    pub unsafe_motions: MotionsReportedUnsafe,
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
            found.unsafe_motions.add(db, (of, same_device), given.in_force.clone()).await?;
            if of == study {
                found = Self { unsafe_motions: found.unsafe_motions, ..given };
            }
        }
        Ok(found)
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

    /// Whether an answer about the two gaits is "cannot tell".
    pub fn is_skipped(&self, (a, b): (TrialId, TrialId)) -> bool {
        self.skipped.iter().any(|pair| *pair == (a, b) || *pair == (b, a))
    }
}
