//! The forms with which staff and subjects answer about two gaits of a study, and retract the answer.

use crate::AppState;
use crate::refused_fields::FieldLabels;
use gaitwright_service::access::Caller;
use gaitwright_service::error::Error;
use gaitwright_service::printable;
use gaitwright_service::studies::answer_giver::AnswerGiver;
use gaitwright_service::studies::assessment_answer::{self, NewAssessment};
use gaitwright_service::studies::feedback_log::{self, CurrentAnswer};
use gaitwright_service::studies::preference_answer::{self, Answer, PairAnswer};
use gaitwright_service::studies::recorded_answer::RecordedAnswer;
use gaitwright_service::studies::safety_reports::SafetyReports;
use gaitwright_store::assessments::AssessmentAnswer;
use gaitwright_store::blind_pairs::OrderedAnswer;
use gaitwright_store::idempotency::{self, StoredResponse, fingerprint};
use gaitwright_store::{AnswerId, Connection, FeedbackId, StudyId, commit};
use serde::Deserialize;
use std::str::FromStr;

/// The fields as typed, to show a refused form again.
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct AnswerForm {
    pub(super) a: String,
    pub(super) b: String,
    #[serde(default)]
    pub(super) answer: String,
    pub(super) source: String,
    pub(super) author: String,
    #[serde(default)]
    pub(super) note: String,
    /// The answer that this one replaces; empty for a new answer.
    #[serde(default)]
    pub(super) changes: String,
    pub(super) key: String,
}

/// An answer as given in the form.
enum GivenAnswer {
    Preference(Answer),
    Assessment(NewAssessment),
}

impl GivenAnswer {
    fn is_about_safety(&self) -> bool {
        matches!(self, Self::Assessment(assessment) if assessment.answer.is_about_safety())
    }

    /// Whether every gait that this answer calls unsafe still has a report in force.
    async fn is_still_in_force(&self, db: &mut Connection, study: StudyId) -> Result<bool, Error> {
        match self {
            Self::Assessment(given) if self.is_about_safety() => {
                let gaits = OrderedAnswer::from(given.answer).unsafe_of((given.trial_a, given.trial_b));
                Ok(SafetyReports::read(db, study).await?.are_all_in_force(&gaits))
            }
            _ => Ok(true),
        }
    }
}

impl AnswerForm {
    /// The answer that this one replaces.
    pub(super) fn changed(&self) -> Result<Option<AnswerId>, Error> {
        if self.changes.is_empty() { Ok(None) } else { identifier("changes", &self.changes).map(Some) }
    }

    fn read(&self) -> Result<(GivenAnswer, FeedbackId), Error> {
        let source = AnswerGiver::from_str(&self.source)?;
        let (a, b) = (identifier("trial_a", &self.a)?, identifier("trial_b", &self.b)?);
        let (source, author, note) = (Some(source), Some(self.author.clone()), self.note.clone());
        let replaces = self.changed()?;
        let preference = |answer| {
            let (author, note) = (author.clone(), note.clone());
            GivenAnswer::Preference(Answer { trial_a: a, trial_b: b, answer, source, author, note, replaces })
        };
        let assessment = |answer| {
            let (author, note) = (author.clone(), note.clone());
            GivenAnswer::Assessment(NewAssessment { trial_a: a, trial_b: b, answer, source, author, note, replaces })
        };
        let given = match self.answer.as_str() {
            "a" => preference(PairAnswer::A),
            "b" => preference(PairAnswer::B),
            "no_difference" => preference(PairAnswer::NoDifference),
            "cannot_tell" => assessment(AssessmentAnswer::CannotTell),
            "unsafe_a" => assessment(AssessmentAnswer::UnsafeA),
            "unsafe_b" => assessment(AssessmentAnswer::UnsafeB),
            "unsafe_both" => assessment(AssessmentAnswer::UnsafeBoth),
            other => {
                return Err(Error::invalid("answer", other, "one of the answers on the form"));
            }
        };
        Ok((given, identifier("key", &self.key)?))
    }

    /// A digest that distinguishes this answer from another one with the same key.
    fn fingerprint(&self, study: StudyId) -> String {
        let Self { a, b, answer, source, author, note, changes, key } = self;
        let sent =
            [a, b, answer, source, author, note, changes, key].map(|part| format!("{}:{part}", part.len())).join(" ");
        fingerprint("form", &format!("/studies/{study}/compare"), sent.as_bytes())
    }
}

fn identifier<T: FromStr>(field: &str, text: &str) -> Result<T, Error> {
    text.parse().map_err(|_| Error::invalid(field, text, "an identifier from this form"))
}

/// The outcome of a submitted form.
pub(super) enum AnswerOutcome {
    /// The answer is recorded, now or before.
    Saved(AnswerId),
    /// The same form was sent before with another answer, which is the recorded one.
    SameForm(AnswerId),
    /// The same author answered this comparison before; that answer is the recorded one.
    AnsweredBefore(AnswerId),
}

/// The labels of the form.
pub(super) const LABELS: FieldLabels = &[
    ("a", "First gait"),
    ("b", "Second gait"),
    ("answer", "Answer"),
    ("source", "This person is"),
    ("author", "Name or code"),
    ("note", "Note"),
];

/// Records the answer of a form.
pub(super) async fn give(
    app: &AppState,
    caller: &Caller,
    id: StudyId,
    form: &AnswerForm,
) -> Result<AnswerOutcome, Error> {
    let (given, key) = form.read()?;
    let mut writer = app.write().await?;
    // The key of the form makes a repeated form (double click, reload, two tabs) count once.
    let request = form.fingerprint(id);
    // A safety report has a key of its own, because it is recorded even if the form was sent before with another answer.
    let key = if given.is_about_safety() { format!("form {key} {request}") } else { format!("form {key}") };
    let before = idempotency::find(&mut writer, &caller.actor, &key).await?;
    // After a review, sending the report again records a new one.
    let is_reviewed = before.is_some() && !given.is_still_in_force(&mut writer, id).await?;
    if let Some(before) = before.filter(|_| !is_reviewed) {
        let same = before.request == request;
        let recorded = identifier("saved", &before.body)?;
        return Ok(if same { AnswerOutcome::Saved(recorded) } else { AnswerOutcome::SameForm(recorded) });
    }
    // A second answer is refused, and the page shows the first one. A safety report is always accepted.
    if !given.is_about_safety()
        && let Some(saved) = answered_elsewhere(&mut writer, id, form).await?
        && !changes_own(&mut writer, id, form).await?
    {
        return Ok(AnswerOutcome::AnsweredBefore(saved));
    }
    let saved = match given {
        GivenAnswer::Preference(answer) => {
            AnswerId::from(preference_answer::give(&mut writer, caller, id, &answer).await?)
        }
        GivenAnswer::Assessment(new) => assessment_answer::give(&mut writer, caller, id, &new).await?.into(),
    };
    if !is_reviewed {
        let kept = StoredResponse { request, status: 303, location: None, body: saved.to_string() };
        idempotency::insert(&mut writer, &caller.actor, &key, &kept).await?;
    }
    commit(writer).await?;
    app.scheduler.changed();
    Ok(AnswerOutcome::Saved(saved))
}

/// The current answer of the same author to the same comparison, given in another tab or elsewhere.
async fn answered_elsewhere(db: &mut Connection, study: StudyId, form: &AnswerForm) -> Result<Option<AnswerId>, Error> {
    let pair = (identifier("trial_a", &form.a)?, identifier("trial_b", &form.b)?);
    let author = printable::name("author", &form.author, 80)?;
    Ok(feedback_log::current_answer(db, study, pair, author).await?.and_then(|answer| match answer {
        CurrentAnswer::Preference(id) => Some(id.into()),
        CurrentAnswer::Assessment(id) => Some(id.into()),
        // The page shows no blinded answer, and no suggestion as an answer: the refusal says that there is one.
        CurrentAnswer::Blind(_) | CurrentAnswer::Suggestion(_) => None,
    }))
}

/// Whether the form changes an answer of the same author that counts.
async fn changes_own(db: &mut Connection, study: StudyId, form: &AnswerForm) -> Result<bool, Error> {
    let Some(changed) = form.changed()? else { return Ok(false) };
    Ok(RecordedAnswer::get(db, Some(study), changed).await?.is_in_force_by(&form.author))
}

/// The form to retract an answer.
#[derive(Debug, Deserialize)]
pub(super) struct RetractForm {
    pub(super) saved: AnswerId,
    author: String,
    reason: String,
}

/// The labels of the form to retract an answer.
pub(super) const RETRACT_LABELS: FieldLabels = &[("author", "Your name or code"), ("reason", "Reason")];

/// Retracts the answer that the form names.
pub(super) async fn retract(app: &AppState, caller: &Caller, id: StudyId, form: &RetractForm) -> Result<(), Error> {
    let mut writer = app.write().await?;
    let (author, reason) = (Some(form.author.as_str()), form.reason.as_str());
    match RecordedAnswer::get(&mut writer, Some(id), form.saved).await? {
        RecordedAnswer::Preference(row) => {
            preference_answer::retract(&mut writer, caller, Some(id), row.id, author, reason).await?;
        }
        RecordedAnswer::Assessment(row) => {
            assessment_answer::retract(&mut writer, caller, Some(id), row.id, (author, reason)).await?;
        }
    }
    commit(writer).await?;
    app.scheduler.changed();
    Ok(())
}
