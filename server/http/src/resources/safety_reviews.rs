//! Safety reviews.

use gaitwright_store::safety_reviews::{self, SafetyDecision};
use gaitwright_store::{Instant, SafetyReportId, SafetyReviewId, TrialId};
use serde::Serialize;
use utoipa::ToSchema;

/// A decision about the safety reports of a gait.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct SafetyReview {
    /// Identifier.
    id: SafetyReviewId,
    /// Trial of the reviewed gait.
    trial_id: TrialId,
    /// The reports that the review covers. Another report about the same gait needs another review.
    reports: Vec<SafetyReportId>,
    /// Decision about the reports.
    decision: SafetyDecision,
    /// Name or pseudonym of the reviewer.
    author: String,
    /// Reason for the decision.
    reason: String,
    /// Time of the review.
    created_at: Instant,
}

impl From<safety_reviews::SafetyReview> for SafetyReview {
    fn from(row: safety_reviews::SafetyReview) -> Self {
        let safety_reviews::SafetyReview { id, trial_id, reports, decision, author, reason, created_at } = row;
        Self { id, trial_id, reports, decision, author, reason, created_at }
    }
}
