//! The only writer of the learner's log: every answer of pages, REST, raters, lab sessions, suggestions and Gait RMSE
//! ends here. A test fails if another module writes the table.

use super::gait_rmse_answers::ComputedAnswer;
use super::identical_gaits::is_same_gait;
use super::trial_transitions::has_state;
use super::walkable::{self, Grounds, NotWalkable, trial_of_study};
use crate::error::{Error, FieldError};
use crate::printable;
use gait_learner::ActionIndex;
use gaitwright_store::blind_pairs::{self, BlindPair, OrderedAnswer};
use gaitwright_store::feedback::{self, Attribution, FeedbackContent, FeedbackRow, Origin, Source};
use gaitwright_store::trials::{Label, Trial, TrialState};
use gaitwright_store::{
    AnswerId, BlindPairId, Connection, FeedbackId, StudyId, TrialId, Writer, assessments, authors, trials,
};
use serde_json::Value;

/// The author of computed answers.
pub(super) const PROGRAM: &str = concat!("gaitwright ", env!("CARGO_PKG_VERSION"));

/// Whether a person may answer the same comparison twice.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SecondAnswer {
    /// A second answer is refused until the first one is retracted.
    Refused,
    /// The study repeated the comparison on purpose.
    Allowed,
}

/// An answer about two gaits.
#[derive(Debug, Clone, Copy)]
pub struct AttributedAnswer<'a> {
    /// The study.
    pub study: StudyId,
    /// The two gaits, in the order in which they were shown or walked.
    pub pair: (TrialId, TrialId),
    /// The names of their fields in the request.
    pub fields: (&'a str, &'a str),
    /// The answer.
    pub answer: OrderedAnswer,
    /// The author.
    pub attribution: Attribution<'a>,
    /// Whether the author may have answered before.
    pub second_answer: SecondAnswer,
    /// The answer in whose place it is given, which no longer counts.
    pub replaces: Option<AnswerId>,
}

/// Checks an answer and passes it to the learner. Returns `None` if it states no preference.
///
/// A preference needs two different walkable gaits, and no earlier answer of the same person. A safety report is
/// accepted unless the subject withdrew consent; the learner takes it as a preference for the other gait only if that
/// one is walkable.
///
/// # Errors
/// [`Error::NotFound`], [`Error::Invalid`] naming the field, [`Error::Conflict`] after withdrawal of consent or for a
/// second answer.
pub async fn record(writer: &mut Writer, statement: AttributedAnswer<'_>) -> Result<Option<FeedbackId>, Error> {
    let AttributedAnswer { study, pair, fields, answer, attribution, second_answer, replaces } = statement;
    if !matches!(attribution.source, Source::Subject | Source::Clinician | Source::Script) {
        return Err(Error::invalid("source", attribution.source.as_str(), "subject, clinician or script"));
    }
    if pair.0 == pair.1 {
        let allowed = "a different trial: a gait cannot be compared with itself";
        return Err(Error::invalid(fields.1, pair.1.to_string(), allowed));
    }
    if answer.is_about_safety() {
        return report_unsafe(writer, statement).await;
    }
    let pair = walkable::admit_pair(writer, study, fields, pair).await?;
    if second_answer == SecondAnswer::Refused {
        let before = current_answer(writer, study, pair.trials(), attribution.author).await?;
        before.map_or(Ok(()), |_| Err(answered_before(attribution.author)))?;
    }
    match answer.feedback(pair.trials()) {
        Some(content) => {
            Ok(Some(feedback::append(writer, study, &content, attribution, Origin::replacing(replaces)).await?))
        }
        None => Ok(None),
    }
}

/// Handles a safety report. A gait that was already reported does not lose again in the learner's log.
async fn report_unsafe(writer: &mut Writer, statement: AttributedAnswer<'_>) -> Result<Option<FeedbackId>, Error> {
    let AttributedAnswer { study, pair, fields, answer, attribution, .. } = statement;
    let first = converged(writer, study, fields.0, pair.0).await?;
    let second = converged(writer, study, fields.1, pair.1).await?;
    let grounds = Grounds::read_for(writer, study, &[first.id, second.id]).await?;
    if grounds.withdrawn {
        return Err(NotWalkable::Withdrawn.into());
    }
    let neither_is_reported =
        [&first, &second].iter().all(|trial| !grounds.safety_reports.unsafe_motions.include(trial));
    let preference = answer.feedback(pair).filter(|_| neither_is_reported && !is_same_gait(&first, &second));
    match preference {
        // The assessment itself names the answer that it replaces.
        Some(content) => Ok(Some(feedback::append(writer, study, &content, attribution, Origin::New).await?)),
        None => Ok(None),
    }
}

async fn converged(db: &mut Connection, study: StudyId, field: &str, id: TrialId) -> Result<Trial, Error> {
    let trial = trial_of_study(db, study, field, id).await?;
    if trial.state != TrialState::Converged {
        let allowed = format!("a converged trial, but trial {} {}", trial.number, has_state(trial.state));
        return Err(Error::invalid(field, id.to_string(), &allowed));
    }
    Ok(trial)
}

/// An answer of a person to a comparison that was not retracted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CurrentAnswer {
    /// A preference, which may be no difference.
    Preference(FeedbackId),
    /// An assessment: the person cannot tell, or reported a gait as unsafe.
    Assessment(gaitwright_store::AssessmentId),
    /// A rater's answer to a blinded pair.
    Blind(BlindPairId),
    /// A suggestion whose bounds are those of the other gait.
    Suggestion(FeedbackId),
}

/// The newest answer of a person to a comparison, whichever entry point it came through, without retracted answers.
///
/// # Errors
/// Errors of the database.
pub async fn current_answer(
    db: &mut Connection,
    study: StudyId,
    (a, b): (TrialId, TrialId),
    author: &str,
) -> Result<Option<CurrentAnswer>, Error> {
    let is_own = |other: &str| printable::is_same_name(other, author);
    // Most people answer a comparison once, and each further statement delays every other change.
    if !authors::of_pair(db, study, (a, b)).await?.iter().any(|name| is_own(name)) {
        return Ok(None);
    }
    let of_pair = |pair: (TrialId, TrialId)| pair == (a, b) || pair == (b, a);
    let assessments = assessments::of_study(db, study).await?;
    let assessment = assessments.iter().rfind(|r| r.retraction.is_none() && is_own(&r.author) && of_pair(r.pair()));
    if let Some(assessment) = assessment {
        return Ok(Some(CurrentAnswer::Assessment(assessment.id)));
    }
    let given = feedback::authors_of_pair(db, (a, b)).await?;
    if let Some((id, _)) = given.into_iter().find(|(_, other)| is_own(other)) {
        return Ok(Some(CurrentAnswer::Preference(id)));
    }
    for shown in blind_pairs::of_pair(db, (a, b)).await? {
        if is_own(&shown.rater) && is_current(db, &shown).await? {
            return Ok(Some(CurrentAnswer::Blind(shown.id)));
        }
    }
    let (one, other) = (trials::get(db, a).await?.action_index, trials::get(db, b).await?.action_index);
    current_suggestion(db, study, (one, other), author).await
}

/// Whether a rater's answer counts: staff can retract the preference derived from it.
async fn is_current(db: &mut Connection, shown: &BlindPair) -> Result<bool, Error> {
    if shown.answer.is_none_or(|answer| answer == OrderedAnswer::Retracted) {
        return Ok(false);
    }
    Ok(match blind_pairs::feedback_of(db, shown.id).await? {
        Some(feedback_id) => feedback::get(db, feedback_id).await?.retraction.is_none(),
        None => true,
    })
}

/// The suggestion of a person that compares two actions, in either direction.
async fn current_suggestion(
    db: &mut Connection,
    study: StudyId,
    (one, other): (ActionIndex, ActionIndex),
    author: &str,
) -> Result<Option<CurrentAnswer>, Error> {
    let found = feedback::suggestions_between(db, study, (one, other)).await?;
    let own = found.into_iter().find(|(_, name)| printable::is_same_name(name, author));
    Ok(own.map(|(id, _)| CurrentAnswer::Suggestion(id)))
}

fn answered_before(author: &str) -> Error {
    Error::conflict(format!(
        "{author} has already answered this comparison. Retract that answer first, then answer again."
    ))
}

/// Writes a suggestion into the learner's log: a preference for the suggested bounds over the gait of a trial. That gait
/// must be walkable. If another trial already has these bounds, its gait must be walkable too, and differ.
///
/// # Errors
/// [`Error::Invalid`] naming the field, [`Error::Conflict`] after withdrawal of consent or for a second answer.
pub(super) async fn suggest(
    writer: &mut Writer,
    over: &Trial,
    (suggested, bounds): (ActionIndex, &Value),
    attribution: Attribution<'_>,
) -> Result<FeedbackId, Error> {
    let study = over.study_id;
    let tried = trials::of_action(writer, study, suggested).await?;
    let ids: Vec<TrialId> = tried.iter().chain([over]).map(|trial| trial.id).collect();
    let grounds = Grounds::read_for(writer, study, &ids).await?;
    if grounds.withdrawn {
        return Err(NotWalkable::Withdrawn.into());
    }
    grounds.admit(over).map_err(|reason| reason.of_field("over", over.id))?;
    for trial in tried.iter().filter(|trial| trial.state.is_result()) {
        let refuse = |allowed: &str| FieldError::new("bounds", bounds.clone(), allowed);
        grounds.admit(trial).map_err(|reason| refuse("the bounds of a walkable gait").because(&reason))?;
        if is_same_gait(trial, over) {
            let reason = format!(
                "Trial {} already has these bounds, and its gait is the same as that of trial {}.",
                trial.number, over.number
            );
            return Err(refuse("the bounds of a different gait").because(&reason).into());
        }
        if current_answer(writer, study, (trial.id, over.id), attribution.author).await?.is_some() {
            return Err(Error::conflict(format!(
                "{} has already compared trials {} and {}. Retract that answer first, then suggest these bounds again.",
                attribution.author, trial.number, over.number
            )));
        }
    }
    // Without a trial of these bounds, only another suggestion can be about them.
    if current_suggestion(writer, study, (suggested, over.action_index), attribution.author).await?.is_some() {
        return Err(Error::conflict(format!(
            "{} has already compared these bounds with those of trial {} in a suggestion. Retract that suggestion first, then \
             suggest again.",
            attribution.author, over.number
        )));
    }
    let content = FeedbackContent::Suggestion { suggested, over: over.id };
    Ok(feedback::append(writer, study, &content, attribution, Origin::New).await?)
}

/// Brings a preference back whose change was undone, with its content and its author.
///
/// # Errors
/// A violated constraint if it was brought back before; errors of the database.
pub(super) async fn restore(writer: &mut Writer, row: &FeedbackRow) -> Result<FeedbackId, Error> {
    let attribution = Attribution { source: row.source, author: &row.author, note: &row.note };
    Ok(feedback::append(writer, row.study_id, &row.content, attribution, Origin::Restores(row.id)).await?)
}

/// Tells the learner the result of a trial, and the preferences that Gait RMSE implies.
///
/// # Errors
/// Errors of the database.
pub(super) async fn compute(
    writer: &mut Writer,
    study: StudyId,
    (trial, label): (TrialId, Label),
    answers: &[ComputedAnswer],
    author: &str,
) -> Result<(), Error> {
    let attribution = |source, note| Attribution { source, author, note };
    let label = FeedbackContent::Label { trial, label };
    feedback::append(writer, study, &label, attribution(Source::Evaluation, ""), Origin::New).await?;
    for ComputedAnswer { content, note } in answers {
        feedback::append(writer, study, content, attribution(Source::GaitRmse, note.as_str()), Origin::New).await?;
    }
    Ok(())
}
