//! What a rater does: takes the next pair, answers it. And the act that ends blindness.

use super::draw::{self, draw};
use super::hold;
use crate::access::{Caller, secret};
use crate::error::Error;
use crate::printable;
use crate::store::audit;
use crate::store::feedback::{self, Source, Voice};
use crate::store::presentations::{self, Kind, NewAnswer, NewPresentation, Presentation, Said};
use crate::store::studies::{FeedbackMode, StudyState};
use crate::store::trials::TrialState;
use crate::store::{
    Connection, Instant, LentWriter, Store, StudyId, TrialId, Writer, consents, events, members, now, studies,
};
use crate::studies::answer as answering;
use crate::studies::comparison::open_question;
use crate::studies::objections::Objections;
use crate::studies::preference::{self, Again, Statement};
use crate::studies::standing::Standing;
use crate::studies::walkable;
use serde::{Deserialize, Serialize};
use serde_json::json;
use utoipa::ToSchema;

/// What a rater answers.
#[derive(Debug, Clone, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct RaterAnswer {
    /// What the rater says; `withdrawn` is the program's own word.
    pub answer: Said,
    /// How long the rater took, ms.
    #[serde(default)]
    #[schema(minimum = 0)]
    pub response_ms: Option<i64>,
    /// Free text, at most 2000 characters.
    #[serde(default)]
    #[schema(max_length = 2000)]
    pub note: String,
}

/// An answer as read back to the rater: nothing in it says which gaits they were, nor whether the pair was a control.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct Answered {
    /// Number of the pair for this rater.
    pub number: u32,
    /// What was recorded.
    pub answer: Said,
}

/// What a study asks, computed outside any transaction.
struct Question {
    seed: u64,
    /// The newer and the older gait; none: it asks for nothing.
    pair: Option<(TrialId, TrialId)>,
    /// When its gaits were found.
    converged: Vec<Instant>,
}

async fn question(store: &mut Store, study: StudyId) -> Result<Question, Error> {
    let mut db = store.read().await?;
    let study = studies::get(&mut db, study).await?;
    consents::may_be_shown(&mut db, study.id).await?;
    let (study_id, seed) = (study.id, study.plan.seed);
    if study.plan.feedback_mode == FeedbackMode::Automatic || study.state == StudyState::Stopped {
        return Ok(Question { seed, pair: None, converged: Vec::new() });
    }
    let standing = Standing::read(&mut db, study).await?;
    drop(db);
    let found = standing.trials.iter().filter(|trial| trial.state == TrialState::Converged);
    let converged = found.filter_map(|trial| trial.finished_at).collect();
    let found = store.compute(move |pool| open_question(pool, &standing)).await?;
    // What the learner says names bounds: it is logged, and the rater hears that the program failed.
    let found = found.map_err(|error| Error::Internal(format!("the question of study {study_id}: {error}")))?;
    let pair = found.trials();
    Ok(Question { seed, pair, converged })
}

/// What a rater is shown: the open presentation, or a new one. `None`: the study asks for nothing now.
///
/// # Errors
/// [`Error::NotFound`], or what the database and the learner report.
pub async fn next<'a>(
    store: &'a mut Store,
    caller: &Caller,
    study: StudyId,
) -> Result<(LentWriter<'a>, Option<Presentation>), Error> {
    let question = question(store, study).await?;
    let mut writer = store.write().await?;
    let all = presentations::of_study(&mut writer, study).await?;
    let objections = Objections::read(&mut writer, study).await?;
    let closed: Vec<TrialId> = objections.closed.iter().map(|closed| closed.trial).collect();
    let own: Vec<Presentation> = all.iter().filter(|shown| shown.rater == caller.name).cloned().collect();
    if let Some(open) = own.iter().find(|shown| shown.answer.is_none()) {
        if walkable::are_walkable(&mut writer, open.pair()).await? {
            note(&mut writer, caller, open, "presentation.show").await?;
            return Ok((writer, Some(open.clone())));
        }
        let withdrawn = NewAnswer { said: Said::Withdrawn, response_ms: None, note: "", feedback: None };
        presentations::answer(&mut writer, open.id, withdrawn).await?;
    }
    let is_closed = |pair: &(TrialId, TrialId)| {
        closed.contains(&pair.0) || closed.contains(&pair.1) || objections.is_skipped(*pair)
    };
    let Some(pair) = question.pair.filter(|pair| !is_closed(pair)) else { return Ok((writer, None)) };
    let waits = hold::waits(&all, &question.converged);
    let lot = draw::lot(question.seed, &caller.name, &own);
    if hold::until(own.last(), &waits, lot).is_some_and(|until| now() < until) {
        return Ok((writer, None));
    }
    let drawn = draw(question.seed, &caller.name, pair, &own, (&closed, !waits.is_empty()));
    let token = secret::fresh()?;
    let new = NewPresentation {
        token: token.clone(),
        study_id: study,
        rater: caller.name.clone(),
        number: u32::try_from(own.len()).unwrap_or(u32::MAX).saturating_add(1),
        kind: drawn.kind,
        shown_first: drawn.first,
        shown_second: drawn.second,
        repeats: drawn.repeats,
        unblinded: presentations::is_unblinded(&mut writer, study, &caller.name).await?,
    };
    presentations::insert(&mut writer, &new).await?;
    let shown = presentations::by_token(&mut writer, &token).await?;
    note(&mut writer, caller, &shown, "presentation.draw").await?;
    Ok((writer, Some(shown)))
}

async fn note(writer: &mut Writer, caller: &Caller, shown: &Presentation, action: &str) -> Result<(), Error> {
    let detail = json!({ "study": shown.study_id, "rater": shown.rater, "number": shown.number });
    Ok(audit::append(writer, &caller.actor, action, &format!("presentation {}", shown.id), &detail).await?)
}

/// Records what a rater says.
///
/// # Errors
/// [`Error::NotFound`] for another rater's pair, [`Error::Conflict`] when it was answered, [`Error::Invalid`].
pub async fn answer(
    writer: &mut Writer,
    caller: &Caller,
    token: &str,
    given: &RaterAnswer,
) -> Result<(StudyId, Answered), Error> {
    let shown = own(writer, caller, token).await?;
    if given.answer == Said::Withdrawn {
        return Err(Error::invalid("answer", "withdrawn", "what a rater can say"));
    }
    printable::note("note", &given.note, 2000)?;
    if given.response_ms.is_some_and(|ms| ms < 0) {
        return Err(Error::invalid("response_ms", json!(given.response_ms), "0 or more"));
    }
    let source = if caller.source() == Source::Script { Source::Subject } else { caller.source() };
    let voice = Voice { source, author: &caller.name, note: &given.note };
    // What is shown twice, or beside itself, says how the rater judges, and nothing of gaits.
    let heard = if shown.kind == Kind::New {
        let fields = ("first", "second");
        let (study, pair, said) = (shown.study_id, shown.pair(), given.answer);
        // The server drew the pair; that this rater is asked again is meant.
        let statement = Statement { study, pair, fields, said, voice, again: Again::Meant };
        preference::hear(writer, statement).await.map_err(without_gaits)?
    } else {
        None
    };
    let row = NewAnswer { said: given.answer, response_ms: given.response_ms, note: &given.note, feedback: heard };
    if !presentations::answer(writer, shown.id, row).await? {
        return Err(Error::conflict(answered_already(shown.answer)));
    }
    let payload = json!({ "feedback_id": heard, "presentation_id": shown.id });
    events::append(writer, shown.study_id, "feedback_given", &payload).await?;
    let detail = json!({ "study": shown.study_id, "number": shown.number, "answer": given.answer });
    audit::append(writer, &caller.actor, "presentation.answer", &format!("presentation {}", shown.id), &detail).await?;
    Ok((shown.study_id, Answered { number: shown.number, answer: given.answer }))
}

/// A refusal that names no gait.
fn without_gaits(error: Error) -> Error {
    match error {
        Error::Invalid(_) => Error::conflict("this pair is not asked about any more: go on to the next one"),
        other => other,
    }
}

/// Why a second answer is not taken, and what counts.
fn answered_already(before: Option<Said>) -> String {
    match before {
        Some(Said::Withdrawn) => "this pair was answered already, and that answer counts no more".to_owned(),
        Some(said) => {
            let said = said.as_str().replace('_', " ");
            format!(
                "this pair was answered already: your answer \u{201c}{said}\u{201d} counts, and this one was not taken"
            )
        }
        None => "this pair was answered already".to_owned(),
    }
}

/// Takes a rater's last answer back: what was said stays in the record, and counts no more.
///
/// # Errors
/// [`Error::NotFound`] for another rater's pair, [`Error::Conflict`] when it cannot be taken back.
pub async fn take_back(writer: &mut Writer, caller: &Caller, token: &str) -> Result<Answered, Error> {
    let shown = own(writer, caller, token).await?;
    if !can_be_taken_back(writer, &shown).await? {
        let why = "only the last answer can be taken back, once; and a gait that was called unsafe stays closed: tell \
                   whoever runs the study";
        return Err(Error::conflict(why));
    }
    if let Some(heard) = presentations::heard_of(writer, shown.id).await?
        // Somebody else may have: a refusal would tell that the pair was no control.
        && feedback::get(writer, heard).await?.retraction.is_none()
    {
        answering::retract(writer, caller, Some(shown.study_id), heard, None, "the rater took it back").await?;
    }
    presentations::take_back(writer, shown.id).await?;
    note(writer, caller, &shown, "presentation.take_back").await?;
    Ok(Answered { number: shown.number, answer: Said::Withdrawn })
}

/// Whether an answer stands that may go: the rater's last one, and not about safety.
pub(crate) async fn can_be_taken_back(db: &mut Connection, shown: &Presentation) -> Result<bool, Error> {
    let all = presentations::of_study(db, shown.study_id).await?;
    let last = !all.iter().any(|other| other.rater == shown.rater && other.number > shown.number);
    let stands = matches!(shown.answer, Some(Said::First | Said::Second | Said::NoDifference | Said::CannotTell));
    Ok(last && stands)
}

/// The presentation of a token, if it is this rater's and the rater reaches its study.
pub(crate) async fn own(db: &mut Connection, caller: &Caller, token: &str) -> Result<Presentation, Error> {
    let shown = presentations::by_token(db, token).await?;
    if shown.rater != caller.name || !members::reaches(db, caller.reach(), shown.study_id).await? {
        return Err(Error::NotFound { what: "comparison".to_owned(), id: "with this token".to_owned() });
    }
    consents::may_be_shown(db, shown.study_id).await?;
    Ok(shown)
}

/// Tells which gaits a rater was shown; from now on the rater's pairs are marked.
///
/// # Errors
/// [`Error::Invalid`] without a reason or for an unknown rater, [`Error::NotFound`].
pub async fn unblind(
    writer: &mut Writer,
    caller: &Caller,
    study: StudyId,
    rater: &str,
    reason: &str,
) -> Result<Vec<Presentation>, Error> {
    studies::get(writer, study).await?;
    consents::may_be_shown(writer, study).await?;
    let reason = printable::reason("reason", reason, ": why blindness ends")?;
    let mut shown = presentations::of_study(writer, study).await?;
    shown.retain(|shown| shown.rater == rater);
    if shown.is_empty() {
        return Err(Error::invalid("rater", rater, "somebody who was shown a pair of this study"));
    }
    presentations::unblind(writer, study, rater, caller.actor.as_str(), reason).await?;
    let detail = json!({ "rater": rater, "reason": reason });
    audit::append(writer, &caller.actor, "study.unblind", &format!("study {study}"), &detail).await?;
    Ok(shown)
}
