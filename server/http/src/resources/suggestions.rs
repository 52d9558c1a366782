//! Suggestions.

use super::feedback::Retraction;
use gait_learner::SearchSpace;
use gaitwright_service::error::Error;
use gaitwright_store::feedback::{self, FeedbackContent, Source};
use gaitwright_store::{FeedbackId, Instant, StudyId, TrialId};
use serde::Serialize;
use std::collections::BTreeMap;
use utoipa::ToSchema;

/// Bounds with which a gait would have been better than that of a trial.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct Suggestion {
    /// Sequence number.
    pub(crate) seq: i64,
    /// Identifier.
    id: FeedbackId,
    /// Identifier of the study.
    study_id: StudyId,
    /// Trial whose gait could be better.
    over: TrialId,
    /// Suggested values of all tuned bounds.
    bounds: BTreeMap<String, f64>,
    /// Source of the suggestion.
    source: Source,
    /// Name or pseudonym of the author.
    author: String,
    /// Free text.
    note: String,
    /// Time of recording.
    created_at: Instant,
    /// Retraction. Null if it was not retracted.
    retraction: Option<Retraction>,
}

impl Suggestion {
    /// The suggestion of a row, in the search space of its study.
    ///
    /// # Errors
    /// [`Error::NotFound`] if the row is no suggestion.
    pub(crate) fn of(row: feedback::FeedbackRow, space: &SearchSpace) -> Result<Self, Error> {
        let feedback::FeedbackRow { seq, id, study_id, content, source, author, note, created_at, retraction, .. } =
            row;
        let FeedbackContent::Suggestion { suggested, over } = content else {
            return Err(Error::NotFound { what: "suggestion".to_owned(), id: id.to_string() });
        };
        let names = space.dimensions().iter().map(|dimension| dimension.name.clone());
        let bounds = names.zip(space.values(suggested)).collect();
        let retraction = retraction.map(Into::into);
        Ok(Self { seq, id, study_id, over, bounds, source, author, note, created_at, retraction })
    }
}
