//! The actions of a rater (take a pair, answer it, retract the answer), and unblinding of a rater.

use super::could_have_known;
use super::next_pair::draw;
use crate::access::{Caller, secret};
use crate::error::Error;
use crate::printable;
use crate::studies::answer as answering;
use crate::studies::comparison::open_question;
use crate::studies::preference::{self, Again, GivenJudgement};
use crate::studies::safety_report;
use crate::studies::safety_reports::SafetyReports;
use crate::studies::snapshot::StudySnapshot;
use crate::studies::walkable;
use gaitwright_store::allocations::{self, Lot, Sided};
use gaitwright_store::audit;
use gaitwright_store::feedback::{self, Attribution, Source};
use gaitwright_store::presentations::{self, Judgement, Kind, NewAnswer, NewPresentation, Presentation};
use gaitwright_store::studies::{FeedbackMode, StudyState};
use gaitwright_store::{
    Connection, Instant, LentWriter, PresentationId, Store, StudyId, TrialId, Writer, consents, events, members,
    studies, trials,
};
use serde::{Deserialize, Serialize};
use serde_json::json;
use std::collections::BTreeSet;
use utoipa::ToSchema;

/// The refusal of a pair that a rule excluded after it was drawn.
const NO_LONGER_SHOWN: &str = "This pair is no longer shown. Continue with the next pair.";

/// Answer of a rater.
#[derive(Debug, Clone, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct RaterAnswer {
    /// The answer. `retracted` is reserved for the service.
    pub answer: Judgement,
    /// Response time of the rater, ms.
    #[serde(default)]
    #[schema(minimum = 0)]
    pub response_ms: Option<i64>,
    /// Free text, at most 2000 characters.
    #[serde(default)]
    #[schema(max_length = 2000)]
    pub note: String,
}

/// Confirmation of a rater's answer. The response is stored, to be sent again if the request is repeated. It contains
/// neither the gaits nor the answer, so that anybody who can read the study does not learn which gait was shown on
/// which side.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct Answered {
    /// Number of the pair for this rater.
    pub number: u32,
}

/// The pending comparison of a study, the newer gait first. Computed outside any transaction.
async fn question(store: &mut Store, study: StudyId) -> Result<Option<(TrialId, TrialId)>, Error> {
    let mut db = store.read().await?;
    let study = studies::get(&mut db, study).await?;
    consents::may_be_shown(&mut db, study.id).await?;
    let study_id = study.id;
    if study.plan.feedback_mode == FeedbackMode::Automatic || study.state == StudyState::Stopped {
        return Ok(None);
    }
    let snapshot = StudySnapshot::read(&mut db, study).await?;
    drop(db);
    let found = store.compute(move |pool| open_question(pool, &snapshot)).await?;
    // The learner's error may name bounds, so the rater sees only an internal error.
    let found =
        found.map_err(|error| Error::Internal(format!("choosing the comparison of study {study_id}: {error}")))?;
    Ok(found.trials())
}

/// The presentation for a rater: the open one, or a new one. `None` if no comparison is pending.
///
/// # Errors
/// [`Error::NotFound`], or errors of the database and the learner.
pub async fn next<'a>(
    store: &'a mut Store,
    caller: &Caller,
    study: StudyId,
) -> Result<(LentWriter<'a>, Option<Sided>), Error> {
    let question = question(store, study).await?;
    let mut writer = store.write().await?;
    let safety_reports = SafetyReports::read(&mut writer, study).await?;
    let mut own = presentations::of_study(&mut writer, study).await?;
    own.retain(|shown| shown.rater == caller.name);
    let closed = closed_among(&mut writer, &safety_reports, own.iter().map(Presentation::pair)).await?;
    if let Some(open) = own.iter().find(|shown| shown.answer.is_none()) {
        // An imported study does not have the sides of pairs that were still blinded.
        let settled = open.kind == Kind::New && is_answered(&mut writer, study, open.pair(), &caller.name).await?;
        if !settled
            && walkable::are_walkable(&mut writer, open.pair()).await?
            && allocations::is_included(&mut writer, open.id).await?
        {
            note(&mut writer, caller, open, "presentation.show").await?;
            let open = own_pair(&mut writer, caller, &open.token).await?;
            return Ok((writer, Some(open)));
        }
        cancel(&mut writer, open).await?;
    }
    let Some(pair) = question.filter(|pair| !safety_reports.is_skipped(*pair)) else { return Ok((writer, None)) };
    // The study may go on asking others; this person has answered, here or elsewhere.
    if !walkable::are_walkable(&mut writer, pair).await? || is_answered(&mut writer, study, pair, &caller.name).await? {
        return Ok((writer, None));
    }
    let lot = Lot::draw()?;
    let drawn = draw(lot.number(), pair, &own, &closed);
    let token = secret::fresh()?;
    let new = NewPresentation {
        token: token.clone(),
        study_id: study,
        rater: caller.name.clone(),
        number: u32::try_from(own.len()).unwrap_or(u32::MAX).saturating_add(1),
        kind: drawn.kind,
        pair: drawn.pair,
        repeats: drawn.repeats,
        could_have_known: could_have_known(&mut writer, caller, study).await?,
    };
    let id = presentations::insert(&mut writer, &new).await?;
    allocations::of_pair(&mut writer, id, drawn.again, Lot::draw()?).await?;
    let shown = own_pair(&mut writer, caller, &token).await?;
    note(&mut writer, caller, &shown.presentation, "presentation.draw").await?;
    Ok((writer, Some(shown)))
}

/// The trials of pairs whose gaits have a safety report in force.
async fn closed_among(
    db: &mut Connection,
    safety_reports: &SafetyReports,
    pairs: impl Iterator<Item = (TrialId, TrialId)>,
) -> Result<Vec<TrialId>, Error> {
    let mut closed = Vec::new();
    for trial in pairs.flat_map(|(a, b)| [a, b]).collect::<BTreeSet<_>>() {
        if safety_reports.forbid(&trials::get(db, trial).await?) {
            closed.push(trial);
        }
    }
    Ok(closed)
}

async fn is_answered(
    db: &mut Connection,
    study: StudyId,
    pair: (TrialId, TrialId),
    rater: &str,
) -> Result<bool, Error> {
    Ok(preference::current_answer(db, study, pair, rater).await?.is_some())
}

async fn cancel(writer: &mut Writer, open: &Presentation) -> Result<(), Error> {
    let retracted = NewAnswer {
        judgement: Judgement::Retracted,
        response_ms: None,
        note: "",
        feedback: None,
        could_have_known: open.could_have_known,
    };
    presentations::answer(writer, open.id, retracted).await?;
    Ok(())
}

async fn note(writer: &mut Writer, caller: &Caller, shown: &Presentation, action: &str) -> Result<(), Error> {
    let detail = json!({ "study": shown.study_id, "rater": shown.rater, "number": shown.number });
    Ok(audit::append(writer, &caller.actor, action, &format!("presentation {}", shown.id), &detail).await?)
}

/// Records the answer of a rater. A pair has one answer, but a safety report is accepted at any time.
///
/// # Errors
/// [`Error::NotFound`] for another rater's pair, [`Error::Conflict`] for an answer other than a safety report if the pair
/// was already answered, [`Error::Invalid`] naming the field.
pub async fn answer(
    writer: &mut Writer,
    caller: &Caller,
    token: &str,
    given: &RaterAnswer,
) -> Result<(StudyId, Answered), Error> {
    let sided = own(writer, caller, token).await?;
    let shown = &sided.presentation;
    if given.answer == Judgement::Retracted {
        return Err(Error::invalid(
            "answer",
            "retracted",
            "one of the other answers, because this value is reserved for the service",
        ));
    }
    printable::note("note", &given.note, 2000)?;
    if given.response_ms.is_some_and(|ms| ms < 0) {
        return Err(Error::invalid("response_ms", json!(given.response_ms), "0 or more"));
    }
    let source = if caller.source() == Source::Script { Source::Subject } else { caller.source() };
    let attribution = Attribution { source, author: &caller.name, note: &given.note };
    // From here on the answer refers to gaits, not to sides.
    let judgement = sided.turned(given.answer);
    if shown.answer.is_some() {
        if !judgement.is_about_safety() {
            return Err(Error::conflict(answered_already(sided.answer())));
        }
        let gaits = judgement.unsafe_of(shown.pair());
        let is_repeated = shown.answer == Some(judgement) && shown.note == given.note;
        if !(is_repeated && SafetyReports::read(writer, shown.study_id).await?.are_all_in_force(&gaits)) {
            safety_report::after_an_answer(writer, caller, &gaits, attribution).await?;
        }
        return Ok((shown.study_id, Answered { number: shown.number }));
    }
    // A presentation of the same gait twice, as in older records, states no preference.
    let heard = if shown.kind == Kind::Null {
        None
    } else {
        let fields = ("first", "second");
        let (study, pair) = (shown.study_id, shown.pair());
        let again = if shown.kind == Kind::Repeat { Again::Meant } else { Again::Refused };
        let statement = GivenJudgement { study, pair, fields, judgement, attribution, again };
        preference::record(writer, statement).await.map_err(without_gaits)?
    };
    let could_have_known = could_have_known(writer, caller, shown.study_id).await?;
    let row =
        NewAnswer { judgement, response_ms: given.response_ms, note: &given.note, feedback: heard, could_have_known };
    if !presentations::answer(writer, shown.id, row).await? {
        return Err(Error::conflict(answered_already(sided.answer())));
    }
    let payload = json!({ "feedback_id": heard, "presentation_id": shown.id });
    events::append(writer, shown.study_id, "feedback_given", &payload).await?;
    // The audit trail omits the answer in terms of sides, because it would reveal the allocation.
    let detail = json!({ "study": shown.study_id, "number": shown.number, "could_have_known": could_have_known });
    audit::append(writer, &caller.actor, "presentation.answer", &format!("presentation {}", shown.id), &detail).await?;
    Ok((shown.study_id, Answered { number: shown.number }))
}

/// Replaces an error by one that names no gait.
fn without_gaits(error: Error) -> Error {
    match error {
        Error::Invalid(_) => Error::conflict(NO_LONGER_SHOWN),
        other => other,
    }
}

/// Explains which answer counts after a second one was refused.
fn answered_already(before: Option<Judgement>) -> String {
    match before {
        Some(Judgement::Retracted) => "This pair was already answered, and the answer was retracted.".to_owned(),
        Some(judgement) => {
            let judgement = judgement.as_str().replace('_', " ");
            format!("This pair was already answered. Your first answer, \u{201c}{judgement}\u{201d}, counts.")
        }
        None => "This pair was already answered.".to_owned(),
    }
}

/// Retracts the last answer of a rater. It stays on record, but no longer counts.
///
/// # Errors
/// [`Error::NotFound`] for another rater's pair, [`Error::Conflict`] if the answer cannot be retracted.
pub async fn retract(writer: &mut Writer, caller: &Caller, token: &str) -> Result<Answered, Error> {
    let shown = own(writer, caller, token).await?.presentation;
    if !can_be_retracted(writer, &shown).await? {
        let why = "Only the last answer can be retracted, and only once. A safety report cannot be retracted: staff \
                   review it.";
        return Err(Error::conflict(why));
    }
    if let Some(heard) = presentations::feedback_of(writer, shown.id).await?
        // Staff may have retracted it already.
        && feedback::get(writer, heard).await?.retraction.is_none()
    {
        answering::retract(writer, caller, Some(shown.study_id), heard, None, "by the rater").await?;
    }
    presentations::retract(writer, shown.id).await?;
    note(writer, caller, &shown, "presentation.retract").await?;
    Ok(Answered { number: shown.number })
}

/// Whether the answer can be retracted: it is the rater's last one and not a safety report.
///
/// # Errors
/// What the record reports.
pub async fn can_be_retracted(db: &mut Connection, shown: &Presentation) -> Result<bool, Error> {
    let all = presentations::of_study(db, shown.study_id).await?;
    let last = !all.iter().any(|other| other.rater == shown.rater && other.number > shown.number);
    let stands = matches!(
        shown.answer,
        Some(Judgement::First | Judgement::Second | Judgement::NoDifference | Judgement::CannotTell)
    );
    Ok(last && stands)
}

/// The pair of a token with its sides, if it belongs to this rater and the rater can access its study.
///
/// # Errors
/// What the record reports, and [`Error::NotFound`] for a token that is not of this rater.
pub async fn own(db: &mut Connection, caller: &Caller, token: &str) -> Result<Sided, Error> {
    let shown = own_pair(db, caller, token).await?;
    if !members::reaches(db, caller.reach(), shown.presentation.study_id).await? {
        return Err(unknown_pair());
    }
    consents::may_be_shown(db, shown.presentation.study_id).await?;
    Ok(shown)
}

/// The pair of a token, if its motions may still be shown to this rater.
///
/// # Errors
/// As [`own`], and [`Error::Conflict`] if a gait of the pair must no longer be shown.
pub async fn own_to_show(db: &mut Connection, caller: &Caller, token: &str) -> Result<Sided, Error> {
    let shown = own(db, caller, token).await?;
    if !walkable::are_walkable(db, shown.presentation.pair()).await? {
        return Err(Error::conflict(NO_LONGER_SHOWN));
    }
    Ok(shown)
}

async fn own_pair(db: &mut Connection, caller: &Caller, token: &str) -> Result<Sided, Error> {
    allocations::own_pair(db, token, &caller.name).await?.ok_or_else(unknown_pair)
}

fn unknown_pair() -> Error {
    Error::NotFound { what: "comparison".to_owned(), id: "with this token".to_owned() }
}

/// Pair shown to a rater who has been unblinded, with the trial shown on each side.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
#[schema(as = Presentation)]
pub struct UnblindedPair {
    /// Identifier.
    pub id: PresentationId,
    /// The study.
    pub study_id: StudyId,
    /// Name of the rater.
    pub rater: String,
    /// Number of the pair for this rater in this study, from 1.
    pub number: u32,
    /// Why it was shown.
    pub kind: Kind,
    /// Trial shown first.
    pub shown_first: TrialId,
    /// Trial shown second.
    pub shown_second: TrialId,
    /// Earlier presentation that it repeats.
    pub repeats: Option<PresentationId>,
    /// Whether the rater could have known the allocation.
    pub could_have_known: bool,
    /// Time at which the pair was drawn.
    pub created_at: Instant,
    /// Answer in terms of what was shown. Absent if there is none yet.
    pub answer: Option<Judgement>,
    /// Time of the answer.
    pub answered_at: Option<Instant>,
}

impl From<&Sided> for UnblindedPair {
    fn from(sided: &Sided) -> Self {
        let row = &sided.presentation;
        let (shown_first, shown_second) = sided.shown();
        Self {
            id: row.id,
            study_id: row.study_id,
            rater: row.rater.clone(),
            number: row.number,
            kind: row.kind,
            shown_first,
            shown_second,
            repeats: row.repeats,
            could_have_known: row.could_have_known,
            created_at: row.created_at,
            answer: sided.answer(),
            answered_at: row.answered_at,
        }
    }
}

/// Unblinds a rater: reveals the sides of all pairs. Later answers of the rater do not count as blind.
///
/// # Errors
/// [`Error::Invalid`] without a reason or for an unknown rater, [`Error::NotFound`], [`Error::Conflict`] if the sides
/// are not in this record.
pub async fn unblind(
    writer: &mut Writer,
    caller: &Caller,
    study: StudyId,
    rater: &str,
    reason: &str,
) -> Result<Vec<UnblindedPair>, Error> {
    studies::get(writer, study).await?;
    consents::may_be_shown(writer, study).await?;
    let reason = printable::reason("reason", reason, " that say why the rater is unblinded")?;
    if !presentations::of_study(writer, study).await?.iter().any(|shown| shown.rater == rater) {
        return Err(Error::invalid("rater", rater, "a rater who was shown a pair of this study"));
    }
    presentations::unblind(writer, study, rater, caller.actor.as_str(), reason).await?;
    let mut pairs = allocations::of_unblinded_raters(writer, study).await?;
    pairs.retain(|sided| sided.presentation.rater == rater);
    if pairs.is_empty() {
        return Err(Error::conflict(
            "The archive of this study did not record which gait was on which side in this rater's pairs. \
             Unblind the rater on the system where the study was created.",
        ));
    }
    let detail = json!({ "rater": rater, "reason": reason });
    audit::append(writer, &caller.actor, "study.unblind", &format!("study {study}"), &detail).await?;
    Ok(pairs.iter().map(UnblindedPair::from).collect())
}
