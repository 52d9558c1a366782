//! Assessments.

use super::feedback::Retraction;
use gaitwright_store::feedback::Source;
use gaitwright_store::presentations::Judgement;
use gaitwright_store::{AssessmentId, FeedbackId, Instant, StudyId, TrialId, assessments};
use serde::Serialize;
use utoipa::ToSchema;

/// A recorded assessment.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct Assessment {
    /// Identifier.
    id: AssessmentId,
    /// The study.
    study_id: StudyId,
    /// The trial with the first of the two gaits.
    first: TrialId,
    /// The trial with the second of the two gaits.
    second: TrialId,
    /// `cannot_tell`, `unsafe_first`, `unsafe_second` or `unsafe_both`.
    answer: Judgement,
    /// Who answered.
    source: Source,
    /// Author.
    author: String,
    /// Free text.
    note: String,
    /// Preference that was derived from it, if any.
    feedback_id: Option<FeedbackId>,
    /// Time of recording.
    created_at: Instant,
    /// Retraction, if it was retracted.
    retraction: Option<Retraction>,
}

impl From<assessments::Assessment> for Assessment {
    fn from(row: assessments::Assessment) -> Self {
        let assessments::Assessment {
            id,
            study_id,
            first,
            second,
            answer,
            source,
            author,
            note,
            feedback_id,
            created_at,
            retraction,
        } = row;
        Self {
            id,
            study_id,
            first,
            second,
            answer,
            source,
            author,
            note,
            feedback_id,
            created_at,
            retraction: retraction.map(Into::into),
        }
    }
}
