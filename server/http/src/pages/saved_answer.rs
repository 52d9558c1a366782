//! An answer to a comparison as the page of the comparison shows it, read from the record.

use super::compare_answer::AnswerForm;
use super::study::{answer_in_words, assessment_in_words};
use super::undo::undo_seconds;
use gaitwright_service::error::Error;
use gaitwright_service::studies::preference_answer;
use gaitwright_service::studies::recorded_answer::RecordedAnswer;
use gaitwright_service::studies::snapshot::StudySnapshot;
use gaitwright_store::feedback::{FeedbackContent, FeedbackRow, Source};
use gaitwright_store::{AnswerId, Connection, Instant, TrialId};

/// An answer, read from the record.
pub(super) struct SavedAnswer {
    pub(super) id: AnswerId,
    pub(super) text: String,
    /// The answer as the form sends it.
    given: &'static str,
    pub(super) author: String,
    source: Source,
    note: String,
    pub(super) at: Instant,
    pub(super) retracted: bool,
    /// Whether it counts again because a change to it was undone.
    pub(super) restored: bool,
    pub(super) is_safety_report: bool,
    is_by_rater: bool,
    /// The gaits of the comparison, the earlier trial first, so that the order does not repeat the answer.
    pub(super) pair: Option<(TrialId, TrialId)>,
    /// Answers of others to the same comparison: author and text.
    pub(super) other_answers: Vec<(String, String)>,
}

impl SavedAnswer {
    /// Reads an answer of a study; `None` if its trials are not in the snapshot.
    pub(super) async fn read(
        db: &mut Connection,
        snapshot: &StudySnapshot,
        id: AnswerId,
    ) -> Result<Option<Self>, Error> {
        let answer = RecordedAnswer::get(db, Some(snapshot.study.id), id).await?;
        let (text, given, note) = match &answer {
            RecordedAnswer::Preference(row) => (answer_in_words(row, snapshot), given(&row.content), &row.note),
            RecordedAnswer::Assessment(row) => (assessment_in_words(row, snapshot), "cannot_tell", &row.note),
        };
        let Some(text) = text else { return Ok(None) };
        let (source, author) = answer.given_by();
        let other_answers = match &answer {
            RecordedAnswer::Preference(row) => preference_answer::other_answers(db, row).await?,
            RecordedAnswer::Assessment(_) => Vec::new(),
        };
        let in_words = |other: FeedbackRow| Some((other.author.clone(), answer_in_words(&other, snapshot)?));
        Ok(Some(Self {
            id,
            text,
            given,
            author: author.to_owned(),
            source,
            note: note.clone(),
            at: answer.created_at(),
            retracted: answer.retraction().is_some(),
            restored: answer.restores().is_some(),
            is_safety_report: answer.is_safety_report(),
            is_by_rater: answer.is_by_rater(),
            pair: answer.pair(),
            other_answers: other_answers.into_iter().filter_map(in_words).collect(),
        }))
    }

    /// Whether another answer can replace it.
    pub(super) fn may_be_changed(&self) -> bool {
        !self.retracted && !self.is_safety_report && !self.is_by_rater && self.pair.is_some()
    }

    /// Seconds for which the page offers *Undo*, if the answer is new.
    pub(super) fn undo(&self) -> Option<f64> {
        let may_be_undone = !self.retracted && !self.is_safety_report && !self.is_by_rater && !self.restored;
        undo_seconds(self.at).filter(|_| may_be_undone)
    }

    /// The form with this answer.
    pub(super) fn form(&self) -> AnswerForm {
        AnswerForm {
            answer: self.given.to_owned(),
            source: self.source.as_str().to_owned(),
            author: self.author.clone(),
            note: self.note.clone(),
            ..AnswerForm::default()
        }
    }
}

/// A preference as the form sends it, for the pair of the answer.
fn given(content: &FeedbackContent) -> &'static str {
    match content {
        FeedbackContent::Preference { winner, loser } if winner < loser => "a",
        FeedbackContent::Preference { .. } => "b",
        FeedbackContent::NoDifference { .. } => "no_difference",
        FeedbackContent::Label { .. } | FeedbackContent::Suggestion { .. } => "",
    }
}
