//! An answer of a person to a comparison in the record, whether it is a preference or an assessment: finds it, and takes
//! it out of force when its author changes it.

use crate::error::Error;
use crate::printable;
use crate::studies::feedback_log::SecondAnswer;
use gaitwright_store::assessments::{self, Assessment};
use gaitwright_store::feedback::{self, FeedbackContent, FeedbackRow, Retraction, Source};
use gaitwright_store::{AnswerId, Connection, Instant, StoreResult, StudyId, TrialId, Writer, consents, events};
use serde_json::json;

/// The reason in the record of an answer that another one replaced.
const CHANGED: &str = "another answer was given instead";

/// An answer to a comparison.
#[derive(Debug, Clone, PartialEq)]
pub enum RecordedAnswer {
    /// A preference, which may be no difference.
    Preference(FeedbackRow),
    /// An assessment.
    Assessment(Assessment),
}

impl RecordedAnswer {
    /// The answer with this identifier.
    ///
    /// # Errors
    /// [`Error::NotFound`], even for an answer of another study than `study`.
    pub async fn get(db: &mut Connection, study: Option<StudyId>, id: AnswerId) -> Result<Self, Error> {
        let found = match feedback::find(db, id.of_preference()).await? {
            Some(row) => {
                Some(row).filter(|row| !matches!(row.content, FeedbackContent::Suggestion { .. })).map(Self::Preference)
            }
            None => assessments::find(db, id.of_assessment()).await?.map(Self::Assessment),
        };
        found
            .filter(|answer| study.is_none_or(|study| study == answer.study()))
            .ok_or_else(|| Error::NotFound { what: "answer".to_owned(), id: id.to_string() })
    }

    /// Its identifier.
    pub fn id(&self) -> AnswerId {
        match self {
            Self::Preference(row) => row.id.into(),
            Self::Assessment(assessment) => assessment.id.into(),
        }
    }

    /// Its study.
    pub fn study(&self) -> StudyId {
        match self {
            Self::Preference(row) => row.study_id,
            Self::Assessment(assessment) => assessment.study_id,
        }
    }

    /// The two trials that it compares, the earlier one first; `None` for a label or a suggestion.
    pub fn pair(&self) -> Option<(TrialId, TrialId)> {
        let (one, other) = match self {
            Self::Assessment(assessment) => assessment.pair(),
            Self::Preference(row) => match row.content {
                FeedbackContent::Preference { winner, loser } => (winner, loser),
                FeedbackContent::NoDifference { a, b } => (a, b),
                FeedbackContent::Label { .. } | FeedbackContent::Suggestion { .. } => return None,
            },
        };
        Some((one.min(other), one.max(other)))
    }

    /// Source and author.
    pub fn given_by(&self) -> (Source, &str) {
        match self {
            Self::Preference(row) => (row.source, &row.author),
            Self::Assessment(assessment) => (assessment.source, &assessment.author),
        }
    }

    /// Time of recording.
    pub fn created_at(&self) -> Instant {
        match self {
            Self::Preference(row) => row.created_at,
            Self::Assessment(assessment) => assessment.created_at,
        }
    }

    /// Its retraction.
    pub fn retraction(&self) -> Option<&Retraction> {
        match self {
            Self::Preference(row) => row.retraction.as_ref(),
            Self::Assessment(assessment) => assessment.retraction.as_ref(),
        }
    }

    /// The answer in whose place it was given.
    pub fn replaces(&self) -> Option<AnswerId> {
        match self {
            Self::Preference(row) => row.replaces,
            Self::Assessment(assessment) => assessment.replaces,
        }
    }

    /// The answer that it brings back, because the change to another answer was undone.
    pub fn restores(&self) -> Option<AnswerId> {
        match self {
            Self::Preference(row) => row.restores.map(Into::into),
            Self::Assessment(assessment) => assessment.restores.map(Into::into),
        }
    }

    /// Whether it says the same as another answer, in the words of the same person.
    pub fn is_copy_of(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Preference(one), Self::Preference(other)) => {
                (one.content, one.source, &one.author, &one.note)
                    == (other.content, other.source, &other.author, &other.note)
            }
            (Self::Assessment(one), Self::Assessment(other)) => {
                (one.pair(), one.answer, one.source, &one.author, &one.note)
                    == (other.pair(), other.answer, other.source, &other.author, &other.note)
            }
            _ => false,
        }
    }

    /// Whether it is a safety report.
    pub fn is_safety_report(&self) -> bool {
        matches!(self, Self::Assessment(assessment) if assessment.answer.is_about_safety())
    }

    /// Whether this person gave it and it counts.
    pub fn is_in_force_by(&self, author: &str) -> bool {
        self.retraction().is_none() && printable::is_same_name(self.given_by().1, author)
    }

    /// Whether the service computed it.
    pub fn is_computed(&self) -> bool {
        matches!(self.given_by().0, Source::Evaluation | Source::GaitRmse)
    }

    /// Whether a rater gave it about a pair without labels.
    pub fn is_by_rater(&self) -> bool {
        matches!(self, Self::Preference(row) if row.by_rater)
    }

    /// Whether it is a safety report, or a preference that follows from one.
    ///
    /// # Errors
    /// Errors of the database.
    pub async fn is_about_safety(&self, db: &mut Connection) -> StoreResult<bool> {
        match self {
            Self::Assessment(_) => Ok(self.is_safety_report()),
            Self::Preference(row) => assessments::is_derived(db, row.id).await,
        }
    }

    /// The answer that brought it back.
    ///
    /// # Errors
    /// Errors of the database.
    pub async fn restoration(&self, db: &mut Connection) -> StoreResult<Option<AnswerId>> {
        Ok(match self {
            Self::Preference(row) => feedback::restoration(db, row.id).await?.map(Into::into),
            Self::Assessment(row) => assessments::restoration(db, row.id).await?.map(Into::into),
        })
    }

    /// Retracts it and notifies open pages. Returns `false` if it was already retracted.
    pub(super) async fn retract(&self, writer: &mut Writer, author: &str, reason: &str) -> Result<bool, Error> {
        let (done, payload) = match self {
            Self::Preference(row) => {
                (feedback::retract(writer, row, author, reason).await?, json!({ "feedback_id": row.id }))
            }
            Self::Assessment(assessment) => (
                assessments::retract(writer, assessment.id, author, reason).await?,
                json!({ "assessment_id": assessment.id }),
            ),
        };
        if done {
            events::append(writer, self.study(), "feedback_retracted", &payload).await?;
        }
        Ok(done)
    }
}

/// Takes an answer out of force because another one about the same gaits is given in its place. A person who changes an
/// own answer may have others about the same gaits, of further lab sessions.
///
/// # Errors
/// [`Error::Invalid`] for `replaces`, [`Error::Conflict`] for an answer that cannot be changed.
pub(super) async fn replace(
    writer: &mut Writer,
    (study, pair): (StudyId, (TrialId, TrialId)),
    replaced: Option<AnswerId>,
    author: &str,
) -> Result<SecondAnswer, Error> {
    let Some(id) = replaced else { return Ok(SecondAnswer::Refused) };
    let refused = |allowed: &str| Error::invalid("replaces", id.to_string(), allowed);
    let answer = match RecordedAnswer::get(writer, Some(study), id).await {
        Err(Error::NotFound { .. }) => return Err(refused("a preference or an assessment of this study")),
        found => found?,
    };
    consents::may_be_shown(writer, study).await?;
    if answer.is_computed() || answer.pair() != Some((pair.0.min(pair.1), pair.0.max(pair.1))) {
        return Err(refused("a person's answer about the same two trials"));
    }
    if answer.is_by_rater() {
        return Err(Error::conflict("A rater's answer cannot be changed. Give your own answer."));
    }
    if answer.is_about_safety(writer).await? {
        return Err(Error::conflict("A safety report cannot be changed. Staff will review it and can clear the gait."));
    }
    if !answer.retract(writer, author, CHANGED).await? {
        return Err(Error::conflict(
            "The answer that you want to change was already changed or retracted. Check the answers of the study before you \
             try again.",
        ));
    }
    Ok(if answer.is_in_force_by(author) { SecondAnswer::Allowed } else { SecondAnswer::Refused })
}
