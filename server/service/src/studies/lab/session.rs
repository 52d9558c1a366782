//! Lab sessions: planning, controller files, recording of walks, closing.

use super::question::{AnswerView, WALKS, can_be_retracted, next_walk, requested_answer, takes_report};
use crate::error::Error;
use crate::printable;
use crate::studies::identical_gaits::is_same_gait;
use crate::studies::walkable::{self, Grounds, NotWalkable, WalkableGait};
use gaitwright_store::allocations::{self, RandomDraw};
use gaitwright_store::audit::{self, Actor};
use gaitwright_store::lab_sessions::{self, LabSession, SessionStep};
use gaitwright_store::trial_list::{self, ListStart, ListedTrial, Listing};
use gaitwright_store::trials::{self, Trial, TrialState};
use gaitwright_store::{Connection, Instant, LabSessionId, StoreResult, StudyId, TrialId, Writer, consents, studies};
use serde::{Deserialize, Serialize};
use serde_json::json;
use utoipa::ToSchema;

/// Maximum length of a note, characters.
const MAX_NOTE: usize = 2000;

/// Lab session to plan.
#[derive(Debug, Clone, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct NewLabSession {
    /// Trial with gait A, which must be walkable.
    pub trial_a: TrialId,
    /// Trial with gait B, which must be walkable.
    pub trial_b: TrialId,
    /// Free text, at most 2000 characters.
    #[serde(default)]
    #[schema(max_length = 2000)]
    pub notes: String,
}

/// Checks that a number is that of a walk with the device.
///
/// # Errors
/// [`Error::Invalid`].
pub(super) fn checked_device_walk(walk: u8) -> Result<u8, Error> {
    match checked_walk(walk)? {
        1 => Err(Error::invalid("walk", walk, "2 or 3, because walk 1 is without the device")),
        with_device => Ok(with_device),
    }
}

/// The gaits of a study for a lab session, each motion once.
#[derive(Debug, Default)]
pub struct GaitsToPlanWith {
    /// The walkable ones.
    pub walkable: Vec<ListedTrial>,
    /// Those that lack nothing but a certificate.
    pub without_certificate: Vec<ListedTrial>,
}

/// The gaits of a study for a lab session, among the `limit` converged trials of lowest Gait RMSE, lowest first.
///
/// # Errors
/// Errors of the database.
pub async fn gaits_to_plan_with(db: &mut Connection, study: StudyId, limit: u32) -> StoreResult<GaitsToPlanWith> {
    let listing = Listing {
        sort: "gait_rmse_rad",
        descending: false,
        state: Some(TrialState::Converged),
        contains: String::new(),
        range: None,
        limit,
        start: ListStart::First,
    };
    let grounds = Grounds::read(db, study).await?;
    let mut converged = Vec::new();
    for listed in trial_list::of_study(db, study, &listing).await? {
        let trial = trials::get(db, listed.id).await?;
        converged.push((listed, trial));
    }
    // A walkable gait stands for equal ones without a certificate.
    converged.sort_by_key(|(_, trial)| grounds.admit(trial).is_err());
    let (mut found, mut kept) = (GaitsToPlanWith::default(), Vec::<Trial>::new());
    for (listed, trial) in converged {
        if kept.iter().any(|other| is_same_gait(other, &trial)) {
            continue;
        }
        if grounds.admit(&trial).is_ok() {
            found.walkable.push(listed);
        } else if grounds.may_become_walkable(&trial) {
            found.without_certificate.push(listed);
        } else {
            continue;
        }
        kept.push(trial);
    }
    Ok(found)
}

/// The two gaits of a session for the next walk, gait A first.
///
/// # Errors
/// [`Error::Invalid`] for a walk without the device or an unknown walk, [`Error::Conflict`] if the session is closed or
/// one of its gaits is not walkable.
pub async fn gaits_to_walk_with(
    db: &mut Connection,
    session: &LabSession,
    walk: u8,
) -> Result<(WalkableGait, WalkableGait), Error> {
    checked_device_walk(walk)?;
    if session.done(SessionStep::Closed).is_some() {
        return Err(Error::conflict("The session is closed."));
    }
    both_walkable(db, session).await
}

/// Both gaits of a session. The error does not say which one is not walkable: to a user who knows which walk is next,
/// that would reveal the allocation.
async fn both_walkable(db: &mut Connection, session: &LabSession) -> Result<(WalkableGait, WalkableGait), Error> {
    let one = walkable::admit(db, session.trial_a).await?;
    let two = walkable::admit(db, session.trial_b).await?;
    one.and_then(|one| Ok((one, two?))).map_err(|reason| match reason {
        NotWalkable::Withdrawn => reason.into(),
        _ => Error::conflict(
            "One of the two gaits of this session must no longer be used for walking. Close the session and \
             plan another one.",
        ),
    })
}

/// Checks the number of a walk.
///
/// # Errors
/// [`Error::Invalid`].
pub fn checked_walk(walk: u8) -> Result<u8, Error> {
    if (1..=WALKS).contains(&walk) { Ok(walk) } else { Err(Error::invalid("walk", walk, "1, 2 or 3")) }
}

/// Plans a session and draws its allocation.
///
/// # Errors
/// [`Error::Invalid`] naming the field, [`Error::NotFound`]; errors of the database.
pub async fn plan(
    writer: &mut Writer,
    actor: &Actor,
    study: StudyId,
    new: &NewLabSession,
) -> Result<LabSession, Error> {
    studies::get(writer, study).await?;
    printable::note("notes", &new.notes, MAX_NOTE)?;
    walkable::admit_pair(writer, study, ("trial_a", "trial_b"), (new.trial_a, new.trial_b)).await?;
    let before = lab_sessions::of_study(writer, study).await?.len();
    let row = lab_sessions::UnsavedLabSession {
        study_id: study,
        number: u32::try_from(before).unwrap_or(u32::MAX).saturating_add(1),
        trial_a: new.trial_a,
        trial_b: new.trial_b,
        notes: &new.notes,
    };
    let id = lab_sessions::insert(writer, actor, &row).await?;
    allocations::of_session(writer, id, row.number, RandomDraw::draw()?).await?;
    let detail = json!({ "study": study, "number": row.number, "trial_a": row.trial_a, "trial_b": row.trial_b });
    audit::append(writer, actor, "lab_session.plan", &format!("lab session {id}"), &detail).await?;
    Ok(lab_sessions::get(writer, id).await?)
}

/// Session as shown in the lab, without anything that reveals a gait.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct LabSessionProgress {
    /// Identifier of the session.
    pub lab_session_id: LabSessionId,
    /// Next walk, 1 to 3. Null after the last walk and in a closed session.
    pub walk: Option<u8>,
    /// Number of walks.
    pub walks: u8,
    /// Time at which the last walk was recorded. Null before the first walk.
    pub last_recorded: Option<Instant>,
    /// Number to send with the answer. Null before the last walk and after an answer.
    pub answer_number: Option<u32>,
    /// Number to send with a report of an unsafe walk. Null until the subject may have walked with the device.
    pub report_number: Option<u32>,
    /// Current answer of the subject. Null if there is none.
    pub answer: Option<AnswerView>,
    /// Whether the current answer can be retracted: the session is neither closed nor unblinded, and the answer is not
    /// a safety report.
    pub can_be_retracted: bool,
    /// Whether the session is closed.
    pub closed: bool,
}

impl LabSessionProgress {
    /// Whether the answer reports an unsafe walk, which ends the walks.
    pub fn was_unsafe(&self) -> bool {
        self.answer.as_ref().is_some_and(|answer| answer.answer.is_about_safety())
    }
}

/// The session as shown in the lab.
///
/// # Errors
/// [`Error::NotFound`], [`Error::Conflict`] if the subject withdrew consent; errors of the database.
pub async fn session_progress(db: &mut Connection, id: LabSessionId) -> Result<LabSessionProgress, Error> {
    let session = still_shown(db, id).await?;
    let closed = session.done(SessionStep::Closed).is_some();
    Ok(LabSessionProgress {
        lab_session_id: id,
        walk: next_walk(&session).filter(|_| !closed && session.answer().is_none()),
        walks: WALKS,
        last_recorded: (1..=WALKS).rev().find_map(|walk| session.done(SessionStep::Walk(walk))).map(|done| done.at),
        answer_number: requested_answer(&session),
        report_number: takes_report(&session),
        answer: session.answer().map(|answer| AnswerView::of(&session, answer)),
        can_be_retracted: can_be_retracted(&session),
        closed,
    })
}

/// Walk to record.
#[derive(Debug, Clone, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct RecordedWalk {
    /// Number of the walk. Walks are recorded in order.
    #[schema(minimum = 1, maximum = 3)]
    pub walk: u8,
    /// Free text, at most 2000 characters.
    #[serde(default)]
    #[schema(max_length = 2000)]
    pub note: String,
}

/// Records a walk.
///
/// # Errors
/// [`Error::Invalid`] for an unknown walk, [`Error::Conflict`] if it is not the next one.
pub async fn record_walk(
    writer: &mut Writer,
    actor: &Actor,
    id: LabSessionId,
    walked: &RecordedWalk,
) -> Result<LabSessionProgress, Error> {
    let walk = checked_walk(walked.walk)?;
    printable::note("note", &walked.note, MAX_NOTE)?;
    let session = still_open(writer, id).await?;
    match next_walk(&session) {
        Some(next) if next == walk => {}
        Some(next) => return Err(Error::conflict(format!("Walk {next} comes next, not walk {walk}."))),
        None => return Err(Error::conflict("All walks of this session are already recorded.")),
    }
    if walk > 1 {
        both_walkable(writer, &session).await?;
    }
    lab_sessions::add_step(writer, actor, id, SessionStep::Walk(walk), &walked.note).await?;
    let detail = json!({ "walk": walk, "note": walked.note });
    audit::append(writer, actor, "lab_session.record_walk", &format!("lab session {id}"), &detail).await?;
    session_progress(writer, id).await
}

/// Whether the last recorded walk is this one, with the same note, as when a form is sent twice.
///
/// # Errors
/// [`Error::NotFound`], [`Error::Conflict`] if the subject withdrew consent; errors of the database.
pub async fn was_recorded(db: &mut Connection, id: LabSessionId, walked: &RecordedWalk) -> Result<bool, Error> {
    let session = still_shown(db, id).await?;
    Ok(session.done(SessionStep::Walk(walked.walk)).is_some_and(|done| done.note == walked.note))
}

/// The session, unless its subject withdrew consent.
///
/// # Errors
/// [`Error::NotFound`], [`Error::Conflict`] if the subject withdrew consent.
pub(super) async fn still_shown(db: &mut Connection, id: LabSessionId) -> Result<LabSession, Error> {
    let session = lab_sessions::get(db, id).await?;
    consents::may_be_shown(db, session.study_id).await?;
    Ok(session)
}

/// The session, if it is open.
///
/// # Errors
/// [`Error::NotFound`], [`Error::Conflict`] if it is closed or the subject withdrew consent.
pub async fn still_open(writer: &mut Writer, id: LabSessionId) -> Result<LabSession, Error> {
    let session = still_shown(writer, id).await?;
    if session.done(SessionStep::Closed).is_some() {
        return Err(Error::conflict("The session is closed and accepts no more data."));
    }
    Ok(session)
}

/// Closes a session, which then accepts no more data.
///
/// # Errors
/// [`Error::NotFound`], [`Error::Conflict`] if it is already closed.
pub async fn close(writer: &mut Writer, actor: &Actor, id: LabSessionId, note: &str) -> Result<LabSession, Error> {
    printable::note("note", note, MAX_NOTE)?;
    still_open(writer, id).await?;
    lab_sessions::add_step(writer, actor, id, SessionStep::Closed, note).await?;
    let detail = json!({ "note": note });
    audit::append(writer, actor, "lab_session.close", &format!("lab session {id}"), &detail).await?;
    Ok(lab_sessions::get(writer, id).await?)
}
