//! Collects the safety reports and the "cannot tell" answers of a study from all places where people give them.

use crate::access::Reach;
use crate::error::Error;
use gaitwright_store::presentations::Judgement;
use gaitwright_store::safety_reviews::{self, SafetyReview, SafetyVerdict};
use gaitwright_store::studies::{self, Study};
use gaitwright_store::{
    AssessmentId, Connection, Instant, PresentationId, StoreResult, StudyId, TrialId, assessments, lab_sessions,
    presentations,
};
use std::collections::HashSet;

/// A safety report. While it is open, the gait is neither recommended nor compared nor walked.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Closed {
    /// The trial.
    pub trial: TrialId,
    /// Who reported it, as shown to people.
    pub by: String,
    /// Time of the report.
    pub at: Instant,
    /// Where it was given.
    pub said: SafetyReportSource,
    /// The newest review by staff.
    pub review: Option<SafetyReview>,
}

/// Where a safety report was given.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SafetyReportSource {
    /// In a blind comparison by a rater.
    Rater(PresentationId),
    /// In an assessment.
    Staff(AssessmentId),
    /// The subject, in a lab session that is not unblinded.
    Subject,
}

/// Accessible studies with safety reports that await review, and the number of such gaits.
///
/// # Errors
/// Errors of the database.
pub async fn undecided(db: &mut Connection, reach: Reach, limit: u32) -> StoreResult<Vec<(Study, usize)>> {
    let mut found = Vec::new();
    for study in studies::with_safety_reports(db, reach, limit).await? {
        let closed = SafetyReports::read(db, study.id).await?.closed.into_iter();
        let waiting: HashSet<TrialId> = closed.filter(|c| c.review.is_none()).map(|c| c.trial).collect();
        if !waiting.is_empty() {
            found.push((study, waiting.len()));
        }
    }
    Ok(found)
}

/// The safety reports of a study, and the pairs that are not compared again.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct SafetyReports {
    /// Open reports: their gaits must not be walked.
    pub closed: Vec<Closed>,
    /// Reports after which staff decided that the gait may be walked again.
    pub lifted: Vec<Closed>,
    /// Pairs of which somebody could not tell which gait is better.
    pub skipped: Vec<(TrialId, TrialId)>,
}

impl SafetyReports {
    /// Reads the reports of a study that were not retracted.
    ///
    /// # Errors
    /// Errors of the database.
    pub async fn read(db: &mut Connection, study: StudyId) -> StoreResult<Self> {
        let mut found = Self::default();
        for shown in presentations::assessments_of_study(db, study).await? {
            if let Some((said, at)) = shown.answer.zip(shown.answered_at) {
                let by = format!("rater {}", shown.rater);
                let closed = |trial| Closed {
                    trial,
                    by: by.clone(),
                    at,
                    said: SafetyReportSource::Rater(shown.id),
                    review: None,
                };
                found.hear(said, shown.pair(), closed);
            }
        }
        for assessment in
            assessments::of_study(db, study).await?.iter().filter(|assessment| assessment.retraction.is_none())
        {
            let (by, at, said) = (&assessment.author, assessment.created_at, SafetyReportSource::Staff(assessment.id));
            found.hear(assessment.answer, assessment.pair(), |trial| Closed {
                trial,
                by: by.clone(),
                at,
                said,
                review: None,
            });
        }
        for session in lab_sessions::of_study(db, study).await? {
            if session.done(lab_sessions::Act::Unblinded).is_some() {
                // After unblinding its answers are assessments or preferences.
                continue;
            }
            if let Some(answer) = session.answer().filter(|answer| answer.said.is_about_safety()) {
                // Naming one of the two gaits would reveal the allocation, so both are closed until unblinding.
                let by =
                    format!("the subject in lab session {} (blinded, so either gait may be meant)", session.number);
                let (at, said) = (answer.at, SafetyReportSource::Subject);
                let closed = |trial| Closed { trial, by: by.clone(), at, said, review: None };
                found.closed.extend([session.gait_one, session.gait_two].map(closed));
            }
        }
        found.review(&safety_reviews::of_study(db, study).await?);
        Ok(found)
    }

    /// Lifts the reports that are older than a review that lets the gait be walked again.
    fn review(&mut self, reviews: &[SafetyReview]) {
        for mut closed in std::mem::take(&mut self.closed) {
            let of_it = |review: &&SafetyReview| review.trial_id == closed.trial && closed.at <= review.said_until;
            closed.review = reviews.iter().rfind(of_it).cloned();
            let lifted = closed.review.as_ref().is_some_and(|review| review.verdict == SafetyVerdict::Walkable);
            if lifted { self.lifted.push(closed) } else { self.closed.push(closed) }
        }
    }

    fn hear(&mut self, said: Judgement, pair: (TrialId, TrialId), closed: impl Fn(TrialId) -> Closed) {
        if said == Judgement::CannotTell {
            self.skipped.push(pair);
        }
        self.closed.extend(said.unsafe_of(pair).into_iter().map(closed));
    }

    /// The open reports about the gait of this trial.
    pub fn closing(mut self, trial: TrialId) -> Vec<Closed> {
        self.closed.retain(|closed| closed.trial == trial);
        self.closed
    }

    /// Whether the gait of this trial has an open report.
    pub fn closes(&self, trial: TrialId) -> bool {
        self.closed.iter().any(|closed| closed.trial == trial)
    }

    /// Whether somebody could not tell which of the two gaits is better.
    pub fn is_skipped(&self, (a, b): (TrialId, TrialId)) -> bool {
        self.skipped.iter().any(|pair| *pair == (a, b) || *pair == (b, a))
    }

    /// Refuses a gait with an open report; `field` names its trial.
    ///
    /// # Errors
    /// [`Error::Invalid`].
    pub fn refuse(&self, field: &str, trial: TrialId) -> Result<(), Error> {
        match self.closed.iter().find(|closed| closed.trial == trial) {
            None => Ok(()),
            Some(closed) => {
                let allowed =
                    format!("a gait without an open safety report. This gait was reported as unsafe by {}", closed.by);
                Err(Error::invalid(field, trial.to_string(), &allowed))
            }
        }
    }
}
