//! Preferences and their retractions.

use gaitwright_service::error::Error;
use gaitwright_store::feedback::{self, Source};
use gaitwright_store::{AnswerId, FeedbackId, Instant, StudyId, TrialId};
use serde::Serialize;
use utoipa::ToSchema;

/// A preference of a study.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct Preference {
    /// Sequence number.
    pub(crate) seq: i64,
    /// Identifier.
    id: FeedbackId,
    /// Identifier of the study.
    study_id: StudyId,
    /// Content of the preference, in terms of trials.
    content: PreferenceContent,
    /// Source of the answer.
    source: Source,
    /// Name or pseudonym of the person who answered.
    author: String,
    /// Free text.
    note: String,
    /// Whether it comes from a rater's blind comparison.
    by_rater: bool,
    /// Whether the rater could have known the allocation. If so, it does not count as blind.
    could_have_known: bool,
    /// Identifier of the preference or assessment that it replaced. Null if it replaced none.
    replaces: Option<AnswerId>,
    /// Identifier of the preference that it brings back, because the answer that had replaced that one was undone.
    /// Null otherwise.
    restores: Option<FeedbackId>,
    /// Time of recording.
    created_at: Instant,
    /// Retraction. Null if it was not retracted.
    retraction: Option<Retraction>,
}

impl TryFrom<feedback::FeedbackRow> for Preference {
    type Error = Error;

    /// The label of a trial and a suggestion are not found.
    fn try_from(row: feedback::FeedbackRow) -> Result<Self, Error> {
        let feedback::FeedbackRow {
            seq,
            id,
            study_id,
            content,
            source,
            author,
            note,
            by_rater,
            could_have_known,
            replaces,
            restores,
            created_at,
            retraction,
        } = row;
        let content = PreferenceContent::of(&content)
            .ok_or_else(|| Error::NotFound { what: "preference".to_owned(), id: id.to_string() })?;
        Ok(Self {
            seq,
            id,
            study_id,
            content,
            source,
            author,
            note,
            by_rater,
            could_have_known,
            replaces,
            restores,
            created_at,
            retraction: retraction.map(Into::into),
        })
    }
}

/// Content of a preference, in terms of trials.
#[derive(Debug, Serialize, ToSchema)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub(crate) enum PreferenceContent {
    /// One trial is better than another.
    Preference {
        /// Better trial.
        winner: TrialId,
        /// Worse trial.
        loser: TrialId,
    },
    /// Two trials are equally good.
    NoDifference {
        /// One trial.
        a: TrialId,
        /// The other trial.
        b: TrialId,
    },
}

impl PreferenceContent {
    /// `None` for the label of a trial and for a suggestion.
    fn of(content: &feedback::FeedbackContent) -> Option<Self> {
        match *content {
            feedback::FeedbackContent::Preference { winner, loser } => Some(Self::Preference { winner, loser }),
            feedback::FeedbackContent::NoDifference { a, b } => Some(Self::NoDifference { a, b }),
            feedback::FeedbackContent::Label { .. } | feedback::FeedbackContent::Suggestion { .. } => None,
        }
    }
}

/// Retraction of an answer.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct Retraction {
    /// Author of the retraction.
    author: String,
    /// Reason, never empty.
    reason: String,
    /// Time of the retraction.
    created_at: Instant,
}

impl From<feedback::Retraction> for Retraction {
    fn from(row: feedback::Retraction) -> Self {
        let feedback::Retraction { author, reason, created_at } = row;
        Self { author, reason, created_at }
    }
}
