//! The actions of a rater: take a pair, answer it, retract the answer.

use super::could_have_known;
use super::next_pair::next_pair;
use crate::access::{Caller, secret};
use crate::error::Error;
use crate::printable;
use crate::studies::feedback_log::{self, AttributedAnswer, SecondAnswer};
use crate::studies::new_safety_report;
use crate::studies::pending_comparison::pending_comparison;
use crate::studies::preference_answer as answering;
use crate::studies::safety_reports::SafetyReports;
use crate::studies::snapshot::StudySnapshot;
use crate::studies::walkable;
use gaitwright_store::allocations::{self, PairWithSides, RandomDraw};
use gaitwright_store::audit;
use gaitwright_store::blind_pairs::{self, BlindPair, BlindPairKind, NewBlindPair, NewPairAnswer, OrderedAnswer};
use gaitwright_store::feedback::{self, Attribution, Source};
use gaitwright_store::studies::{AnswerSource, StudyState};
use gaitwright_store::{
    BorrowedWriter, Connection, Store, StudyId, TrialId, Writer, accessible_studies, consents, events, studies, trials,
};
use serde::{Deserialize, Serialize};
use serde_json::json;
use std::collections::BTreeSet;
use utoipa::ToSchema;

/// The refusal of a pair that a rule excluded after it was chosen.
const NO_LONGER_SHOWN: &str = "This pair is no longer shown. Continue with the next pair.";

/// Answer of a rater.
#[derive(Debug, Clone, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct RaterAnswer {
    /// The answer.
    pub answer: OrderedAnswer,
    /// Response time of the rater, ms.
    #[serde(default)]
    #[schema(minimum = 0)]
    pub response_ms: Option<i64>,
    /// Free text, at most 2000 characters.
    #[serde(default)]
    #[schema(max_length = 2000)]
    pub note: String,
}

/// Confirmation of a rater's answer. The response is stored, and sent again if the request is repeated. It omits the
/// gaits and the answer, because others who can read the study must not learn which gait was shown on which side.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct AnswerReceipt {
    /// Number of the pair for this rater.
    pub number: u32,
}

/// The pending comparison of a study, the newer gait first. Computed outside any transaction.
async fn pending_trials(store: &mut Store, study: StudyId) -> Result<Option<(TrialId, TrialId)>, Error> {
    let mut db = store.read().await?;
    let study = studies::get(&mut db, study).await?;
    consents::may_be_shown(&mut db, study.id).await?;
    let study_id = study.id;
    if study.plan.answer_source == AnswerSource::GaitRmse || study.state == StudyState::Stopped {
        return Ok(None);
    }
    let snapshot = StudySnapshot::read(&mut db, study).await?;
    drop(db);
    let found = store.compute(move |pool| pending_comparison(pool, &snapshot)).await?;
    // The learner's error may name bounds, so the rater sees only an internal error.
    let found =
        found.map_err(|error| Error::Internal(format!("cannot choose the comparison of study {study_id}: {error}")))?;
    Ok(found.trials())
}

/// A pair for a rater.
#[derive(Debug)]
pub struct HandedOut {
    /// The pair.
    pub shown: PairWithSides,
    /// Whether it was drawn for this request; `false` if it still waits for its answer.
    pub is_new: bool,
}

/// The pair for a rater: the open one, or a new one. `None` if no comparison is pending.
///
/// # Errors
/// [`Error::NotFound`], or errors of the database and the learner.
pub async fn next<'a>(
    store: &'a mut Store,
    caller: &Caller,
    study: StudyId,
) -> Result<(BorrowedWriter<'a>, Option<HandedOut>), Error> {
    let pending = pending_trials(store, study).await?;
    let mut writer = store.write().await?;
    let safety_reports = SafetyReports::read(&mut writer, study).await?;
    let mut own = blind_pairs::of_study(&mut writer, study).await?;
    own.retain(|shown| shown.rater == caller.name);
    let reported = reported_among(&mut writer, &safety_reports, own.iter().map(BlindPair::trials)).await?;
    if let Some(open) = own.iter().find(|shown| shown.answer.is_none()) {
        // An imported study does not have the sides of pairs that were still blinded.
        let settled =
            open.kind == BlindPairKind::New && is_answered(&mut writer, study, open.trials(), &caller.name).await?;
        if !settled
            && walkable::are_walkable(&mut writer, open.trials()).await?
            && allocations::is_included(&mut writer, open.id).await?
        {
            note(&mut writer, caller, open, "blind_pair.show").await?;
            let shown = own_pair(&mut writer, caller, &open.code).await?;
            return Ok((writer, Some(HandedOut { shown, is_new: false })));
        }
        cancel(&mut writer, open).await?;
    }
    let Some(pair) = pending.filter(|pair| !safety_reports.is_skipped(*pair)) else { return Ok((writer, None)) };
    // The study may go on asking others; this person has answered, here or elsewhere.
    if !walkable::are_walkable(&mut writer, pair).await? || is_answered(&mut writer, study, pair, &caller.name).await? {
        return Ok((writer, None));
    }
    let next = next_pair(RandomDraw::draw()?.number(), pair, &own, &reported);
    let code = secret::fresh()?;
    let new = NewBlindPair {
        code: code.clone(),
        study_id: study,
        rater: caller.name.clone(),
        number: u32::try_from(own.len()).unwrap_or(u32::MAX).saturating_add(1),
        kind: next.kind,
        pair: next.pair,
        repeats: next.repeats,
        could_have_known: could_have_known(&mut writer, caller, study).await?,
    };
    let id = blind_pairs::insert(&mut writer, &new).await?;
    allocations::of_pair(&mut writer, id, next.same_sides_as, RandomDraw::draw()?).await?;
    let shown = own_pair(&mut writer, caller, &code).await?;
    note(&mut writer, caller, &shown.pair, "blind_pair.draw").await?;
    Ok((writer, Some(HandedOut { shown, is_new: true })))
}

/// The trials of pairs whose gaits have a safety report in force.
async fn reported_among(
    db: &mut Connection,
    safety_reports: &SafetyReports,
    pairs: impl Iterator<Item = (TrialId, TrialId)>,
) -> Result<Vec<TrialId>, Error> {
    let mut reported = Vec::new();
    for trial in pairs.flat_map(|(a, b)| [a, b]).collect::<BTreeSet<_>>() {
        if safety_reports.unsafe_motions.include(&trials::get(db, trial).await?) {
            reported.push(trial);
        }
    }
    Ok(reported)
}

async fn is_answered(
    db: &mut Connection,
    study: StudyId,
    pair: (TrialId, TrialId),
    rater: &str,
) -> Result<bool, Error> {
    Ok(feedback_log::current_answer(db, study, pair, rater).await?.is_some())
}

async fn cancel(writer: &mut Writer, open: &BlindPair) -> Result<(), Error> {
    let retracted = NewPairAnswer {
        answer: OrderedAnswer::Retracted,
        response_ms: None,
        note: "",
        feedback: None,
        could_have_known: open.could_have_known,
    };
    blind_pairs::answer(writer, open.id, retracted).await?;
    Ok(())
}

async fn note(writer: &mut Writer, caller: &Caller, shown: &BlindPair, action: &str) -> Result<(), Error> {
    let detail = json!({ "study": shown.study_id, "rater": shown.rater, "number": shown.number });
    Ok(audit::append(writer, &caller.actor, action, &format!("blind pair {}", shown.id), &detail).await?)
}

/// Records the answer of a rater. A pair has one answer, but a safety report is accepted at any time.
///
/// # Errors
/// [`Error::NotFound`] for another rater's pair, [`Error::Conflict`] for an answer other than a safety report if the pair
/// was already answered, [`Error::Invalid`] naming the field.
pub async fn answer(
    writer: &mut Writer,
    caller: &Caller,
    code: &str,
    given: &RaterAnswer,
) -> Result<(StudyId, AnswerReceipt), Error> {
    let sided = own(writer, caller, code).await?;
    let shown = &sided.pair;
    answering::refuse_retracted(given.answer)?;
    printable::note("note", &given.note, 2000)?;
    if given.response_ms.is_some_and(|ms| ms < 0) {
        return Err(Error::invalid("response_ms", json!(given.response_ms), "0 or more"));
    }
    let source = if caller.source() == Source::Script { Source::Subject } else { caller.source() };
    let attribution = Attribution { source, author: &caller.name, note: &given.note };
    // From here on the answer refers to gaits, not to sides.
    let answer = sided.turned(given.answer);
    if shown.answer.is_some() {
        if !answer.is_about_safety() {
            return Err(Error::conflict(answered_already(sided.answer())));
        }
        let gaits = answer.unsafe_of(shown.trials());
        let is_repeated = shown.answer == Some(answer) && shown.note == given.note;
        if !(is_repeated && SafetyReports::read(writer, shown.study_id).await?.are_all_in_force(&gaits)) {
            new_safety_report::after_an_answer(writer, caller, &gaits, attribution).await?;
        }
        return Ok((shown.study_id, AnswerReceipt { number: shown.number }));
    }
    let second_answer = if shown.kind == BlindPairKind::Repeat { SecondAnswer::Allowed } else { SecondAnswer::Refused };
    let (study, pair, fields) = (shown.study_id, shown.trials(), ("first", "second"));
    // A pair has one answer, and a repeat replaces nothing: both answers count.
    let statement = AttributedAnswer { study, pair, fields, answer, attribution, second_answer, replaces: None };
    let feedback_id = feedback_log::record(writer, statement).await.map_err(without_gaits)?;
    let could_have_known = could_have_known(writer, caller, shown.study_id).await?;
    let row = NewPairAnswer {
        answer,
        response_ms: given.response_ms,
        note: &given.note,
        feedback: feedback_id,
        could_have_known,
    };
    if !blind_pairs::answer(writer, shown.id, row).await? {
        return Err(Error::conflict(answered_already(sided.answer())));
    }
    let payload = json!({ "feedback_id": feedback_id, "pair_id": shown.id });
    events::append(writer, shown.study_id, "feedback_given", &payload).await?;
    // The audit trail omits the answer in terms of sides, because it would reveal the allocation.
    let detail = json!({ "study": shown.study_id, "number": shown.number, "could_have_known": could_have_known });
    audit::append(writer, &caller.actor, "blind_pair.answer", &format!("blind pair {}", shown.id), &detail).await?;
    Ok((shown.study_id, AnswerReceipt { number: shown.number }))
}

/// Replaces an error by one that names no gait.
fn without_gaits(error: Error) -> Error {
    match error {
        Error::Invalid(_) => Error::conflict(NO_LONGER_SHOWN),
        other => other,
    }
}

/// Explains which answer counts after a second one was refused.
fn answered_already(before: Option<OrderedAnswer>) -> String {
    match before {
        Some(OrderedAnswer::Retracted) => "This pair was already answered, and the answer was retracted.".to_owned(),
        Some(answer) => {
            format!("This pair was already answered. Your first answer counts: {}.", sides_in_words(answer))
        }
        None => "This pair was already answered.".to_owned(),
    }
}

/// The answer of a rater about the two sides of a pair.
pub fn sides_in_words(answer: OrderedAnswer) -> &'static str {
    match answer {
        OrderedAnswer::First => "the first gait is better",
        OrderedAnswer::Second => "the second gait is better",
        OrderedAnswer::NoDifference => "no difference",
        OrderedAnswer::CannotTell => "cannot tell",
        OrderedAnswer::UnsafeFirst => "the first gait is unsafe",
        OrderedAnswer::UnsafeSecond => "the second gait is unsafe",
        OrderedAnswer::UnsafeBoth => "both gaits are unsafe",
        OrderedAnswer::Retracted => "retracted",
    }
}

/// Retracts the last answer of a rater. It stays on record, but no longer counts.
///
/// # Errors
/// [`Error::NotFound`] for another rater's pair, [`Error::Conflict`] if the answer cannot be retracted.
pub async fn retract(writer: &mut Writer, caller: &Caller, code: &str) -> Result<AnswerReceipt, Error> {
    let shown = own(writer, caller, code).await?.pair;
    if !can_be_retracted(writer, &shown).await? {
        let why = "Only the last answer can be retracted, and only once. A safety report cannot be retracted: staff \
                   review it.";
        return Err(Error::conflict(why));
    }
    if let Some(feedback_id) = blind_pairs::feedback_of(writer, shown.id).await?
        // Staff may have retracted it already.
        && feedback::get(writer, feedback_id).await?.retraction.is_none()
    {
        answering::retract(writer, caller, Some(shown.study_id), feedback_id, None, "by the rater").await?;
    }
    blind_pairs::retract(writer, shown.id).await?;
    note(writer, caller, &shown, "blind_pair.retract").await?;
    Ok(AnswerReceipt { number: shown.number })
}

/// Whether the answer can be retracted: it is the rater's last one and not a safety report.
///
/// # Errors
/// Errors of the database.
pub async fn can_be_retracted(db: &mut Connection, shown: &BlindPair) -> Result<bool, Error> {
    let all = blind_pairs::of_study(db, shown.study_id).await?;
    let last = !all.iter().any(|other| other.rater == shown.rater && other.number > shown.number);
    let is_retractable = matches!(
        shown.answer,
        Some(OrderedAnswer::First | OrderedAnswer::Second | OrderedAnswer::NoDifference | OrderedAnswer::CannotTell)
    );
    Ok(last && is_retractable)
}

/// The pair of a code with its sides, if it belongs to this rater and the rater can access its study.
///
/// # Errors
/// [`Error::NotFound`] for a code that is not of this rater; errors of the database.
pub async fn own(db: &mut Connection, caller: &Caller, code: &str) -> Result<PairWithSides, Error> {
    let shown = own_pair(db, caller, code).await?;
    if !accessible_studies::reaches(db, caller.reach(), shown.pair.study_id).await? {
        return Err(unknown_pair());
    }
    consents::may_be_shown(db, shown.pair.study_id).await?;
    Ok(shown)
}

/// The pair of a code, if its motions may still be shown to this rater.
///
/// # Errors
/// As [`own`], and [`Error::Conflict`] if a gait of the pair must no longer be shown.
pub async fn own_showable_pair(db: &mut Connection, caller: &Caller, code: &str) -> Result<PairWithSides, Error> {
    let shown = own(db, caller, code).await?;
    if !walkable::are_walkable(db, shown.pair.trials()).await? {
        return Err(Error::conflict(NO_LONGER_SHOWN));
    }
    Ok(shown)
}

async fn own_pair(db: &mut Connection, caller: &Caller, code: &str) -> Result<PairWithSides, Error> {
    allocations::own_pair(db, code, &caller.name).await?.ok_or_else(unknown_pair)
}

fn unknown_pair() -> Error {
    Error::NotFound { what: "blind pair".to_owned(), id: "with this code".to_owned() }
}
