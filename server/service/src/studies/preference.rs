//! The one way into the learner's log. Forms, REST, raters, lab sessions, suggestions and computed answers all end here:
//! a test finds every other writer of the table.

use super::walkable::{self, Grounds, NotWalkable, WalkablePair, is_same_gait, trial_of_study};
use crate::error::Error;
use crate::printable;
use gait_learner::ActionIndex;
use gaitwright_store::feedback::{self, Attribution, FeedbackContent, Source};
use gaitwright_store::presentations::Judgement;
use gaitwright_store::trials::{Trial, TrialState};
use gaitwright_store::{Connection, FeedbackId, StudyId, TrialId, Writer, consents, remarks};

/// Author of what the program itself says.
pub(super) const PROGRAM: &str = concat!("gaitwright ", env!("CARGO_PKG_VERSION"));

/// Whether a person may answer the same comparison twice.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Again {
    /// A second answer of the same person is a mistake: the first one is to be retracted.
    Refused,
    /// The program asked this person again on purpose.
    Meant,
}

/// What a person says of two gaits.
#[derive(Debug, Clone, Copy)]
pub struct GivenJudgement<'a> {
    /// The study.
    pub study: StudyId,
    /// The two gaits, in the order in which they were shown or walked.
    pub pair: (TrialId, TrialId),
    /// What the request calls them.
    pub fields: (&'a str, &'a str),
    /// What the person says.
    pub said: Judgement,
    /// Who says it.
    pub attribution: Attribution<'a>,
    /// Whether this person may have answered before.
    pub again: Again,
}

/// Applies every rule to what a person says and tells the learner. `None`: the learner hears nothing of it, because it is
/// no preference.
///
/// A preference needs two different gaits that may be walked with, and no earlier answer of the same person. A safety
/// report is always taken while the subject takes part; the learner hears that the other gait is better only if people may
/// still be asked about that one.
///
/// # Errors
/// [`Error::NotFound`], [`Error::Invalid`] naming the field, [`Error::Conflict`] after a withdrawal and for a second answer.
pub async fn hear(writer: &mut Writer, statement: GivenJudgement<'_>) -> Result<Option<FeedbackId>, Error> {
    let GivenJudgement { study, pair, fields, said, attribution, again } = statement;
    if !matches!(attribution.source, Source::Subject | Source::Clinician | Source::Script) {
        return Err(Error::invalid("source", attribution.source.as_str(), "subject, clinician, script"));
    }
    if pair.0 == pair.1 {
        let allowed = format!("another trial than {}: a gait cannot be compared with itself", fields.0);
        return Err(Error::invalid(fields.1, pair.1.to_string(), &allowed));
    }
    if said.is_about_safety() {
        return report_unsafe(writer, statement).await;
    }
    let pair = walkable::admit_pair(writer, study, fields, pair).await?;
    if again == Again::Refused {
        refuse_second_answer(writer, study, &pair, attribution.author).await?;
    }
    match said.heard(pair.trials()) {
        Some(said) => Ok(Some(feedback::append(writer, study, &said, attribution).await?)),
        None => Ok(None),
    }
}

/// A safety report names gaits of this study that exist. What the learner hears of it says nothing of a gait that was
/// reported before.
async fn report_unsafe(writer: &mut Writer, statement: GivenJudgement<'_>) -> Result<Option<FeedbackId>, Error> {
    let GivenJudgement { study, pair, fields, said, attribution, .. } = statement;
    let first = converged(writer, study, fields.0, pair.0).await?;
    let second = converged(writer, study, fields.1, pair.1).await?;
    let grounds = Grounds::read_for(writer, study, &[first.id, second.id]).await?;
    if grounds.withdrawn {
        return Err(NotWalkable::Withdrawn.into());
    }
    let both_open = [&first, &second].iter().all(|trial| !grounds.safety_reports.closes(trial.id));
    let heard = said.heard(pair).filter(|_| both_open && !is_same_gait(&first, &second));
    match heard {
        Some(said) => Ok(Some(feedback::append(writer, study, &said, attribution).await?)),
        None => Ok(None),
    }
}

async fn converged(db: &mut Connection, study: StudyId, field: &str, id: TrialId) -> Result<Trial, Error> {
    let trial = trial_of_study(db, study, field, id).await?;
    if trial.state != TrialState::Converged {
        let allowed = format!("a converged trial; trial {} is {}", trial.number, trial.state.as_str());
        return Err(Error::invalid(field, id.to_string(), &allowed));
    }
    Ok(trial)
}

/// One standing answer of a person to a comparison.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StandingAnswer {
    /// A preference or a tie.
    Preference(FeedbackId),
    /// That the person cannot tell.
    Note(gaitwright_store::RemarkId),
}

/// The newest answer of a person to a comparison that was not retracted; blind answers are not shown.
///
/// # Errors
/// What the database reports.
pub async fn standing_answer(
    db: &mut Connection,
    study: StudyId,
    (a, b): (TrialId, TrialId),
    author: &str,
) -> Result<Option<StandingAnswer>, Error> {
    let of_pair = |pair: (TrialId, TrialId)| pair == (a, b) || pair == (b, a);
    let noted = remarks::of_study(db, study).await?;
    let noted = noted
        .iter()
        .rfind(|r| r.retraction.is_none() && printable::is_same_name(&r.author, author) && of_pair(r.pair()));
    if let Some(noted) = noted {
        return Ok(Some(StandingAnswer::Note(noted.id)));
    }
    let given = feedback::authors_of_pair(db, (a, b)).await?;
    let own = given.into_iter().find(|(_, other)| printable::is_same_name(other, author));
    Ok(own.map(|(id, _)| StandingAnswer::Preference(id)))
}

async fn refuse_second_answer(
    db: &mut Connection,
    study: StudyId,
    pair: &WalkablePair,
    author: &str,
) -> Result<(), Error> {
    if standing_answer(db, study, pair.trials(), author).await?.is_some() {
        let why =
            format!("{author} has answered this comparison already: retract that answer first, then answer again");
        return Err(Error::conflict(why));
    }
    Ok(())
}

/// Tells the learner that an action would have been better than a trial. Nothing is said against the trial: its gait may have
/// been reported as unsafe.
///
/// # Errors
/// [`Error::Conflict`] after a withdrawal, a violated constraint or trigger, or what the database reports.
pub(super) async fn suggest(
    writer: &mut Writer,
    over: &Trial,
    suggested: ActionIndex,
    attribution: Attribution<'_>,
) -> Result<FeedbackId, Error> {
    if consents::is_withdrawn(writer, over.study_id).await? {
        return Err(NotWalkable::Withdrawn.into());
    }
    let said = FeedbackContent::Suggestion { suggested, over: over.id };
    Ok(feedback::append(writer, over.study_id, &said, attribution).await?)
}

/// Tells the learner the result of a trial, and what Gait RMSE answers about it.
///
/// # Errors
/// A violated constraint or trigger, or what the database reports.
pub(super) async fn compute(
    writer: &mut Writer,
    study: StudyId,
    (trial, state): (TrialId, TrialState),
    answers: &[FeedbackContent],
    author: &str,
) -> Result<(), Error> {
    let attribution = |source| Attribution { source, author, note: "" };
    let label = FeedbackContent::Label { trial, category: u32::from(state == TrialState::Converged) };
    feedback::append(writer, study, &label, attribution(Source::Convergence)).await?;
    for answer in answers {
        feedback::append(writer, study, answer, attribution(Source::GaitRmse)).await?;
    }
    Ok(())
}
