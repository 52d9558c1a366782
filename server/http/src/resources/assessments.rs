//! Assessments.

use super::feedback::Retraction;
use gaitwright_store::assessments::{self, AssessmentAnswer};
use gaitwright_store::feedback::Source;
use gaitwright_store::{AnswerId, AssessmentId, FeedbackId, Instant, StudyId, TrialId};
use serde::Serialize;
use utoipa::ToSchema;

/// A recorded assessment.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct Assessment {
    /// Identifier.
    id: AssessmentId,
    /// Identifier of the study.
    study_id: StudyId,
    /// The trial with gait A.
    trial_a: TrialId,
    /// The trial with gait B.
    trial_b: TrialId,
    /// The answer.
    answer: AssessmentAnswer,
    /// Source of the answer.
    source: Source,
    /// Name or pseudonym of the person who answered.
    author: String,
    /// Free text.
    note: String,
    /// Preference that was derived from it. Null if there is none.
    feedback_id: Option<FeedbackId>,
    /// Identifier of the preference or assessment that it replaced. Null if it replaced none.
    replaces: Option<AnswerId>,
    /// Identifier of the assessment that it brings back, because the answer that had replaced that one was undone.
    /// Null otherwise.
    restores: Option<AssessmentId>,
    /// Time of recording.
    created_at: Instant,
    /// Retraction. Null if the assessment was not retracted.
    retraction: Option<Retraction>,
}

impl From<assessments::Assessment> for Assessment {
    fn from(row: assessments::Assessment) -> Self {
        let assessments::Assessment {
            id,
            study_id,
            trial_a,
            trial_b,
            answer,
            source,
            author,
            note,
            feedback_id,
            replaces,
            restores,
            created_at,
            retraction,
        } = row;
        Self {
            id,
            study_id,
            trial_a,
            trial_b,
            answer,
            source,
            author,
            note,
            feedback_id,
            replaces,
            restores,
            created_at,
            retraction: retraction.map(Into::into),
        }
    }
}
