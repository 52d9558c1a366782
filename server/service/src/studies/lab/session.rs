//! The life of a session: planned, walk after walk recorded, closed; and who may see what of it.

use super::answer::{self, AnswerView};
use crate::access::Caller;
use crate::error::Error;
use crate::printable;
use crate::studies::walkable::{self, NotWalkable, WalkableGait};
use gaitwright_store::allocations::{self, DeviceFile, Lot};
use gaitwright_store::audit::{self, Actor};
use gaitwright_store::lab_sessions::{self, Act, Done, LabSession, NewLabSession};
use gaitwright_store::{Connection, Instant, LabSessionId, StudyId, TrialId, Writer, consents, studies};
use serde::{Deserialize, Serialize};
use serde_json::json;
use utoipa::ToSchema;

/// Walks of a session.
pub const WALKS: u8 = 3;
/// Longest note, characters.
const LONGEST_NOTE: usize = 2000;

/// A session to plan.
#[derive(Debug, Clone, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct NewSession {
    /// One of the two gaits: a converged trial of the study.
    pub gait_one: TrialId,
    /// The other one.
    pub gait_two: TrialId,
    /// Free text, at most 2000 characters.
    #[serde(default)]
    #[schema(max_length = 2000)]
    pub notes: String,
}

/// What a walk is done with.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum Condition {
    /// Without the device.
    Normal,
    /// With gait one.
    GaitOne,
    /// With gait two.
    GaitTwo,
}

/// Where a session stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum SessionState {
    /// Nobody has walked yet.
    Planned,
    /// At least one walk was recorded.
    UnderWay,
    /// Nothing is recorded any more.
    Closed,
}

impl SessionState {
    /// As shown.
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Planned => "planned",
            Self::UnderWay => "under_way",
            Self::Closed => "closed",
        }
    }

    fn of(session: &LabSession) -> Self {
        if session.done(Act::Closed).is_some() {
            Self::Closed
        } else if session.done(Act::Walk(1)).is_some() {
            Self::UnderWay
        } else {
            Self::Planned
        }
    }
}

/// A walk of a session.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct WalkView {
    /// 1, 2, 3.
    pub number: u8,
    /// What it is done with; none as long as that is blinded.
    pub condition: Option<Condition>,
    /// That it was recorded.
    pub recorded: Option<Done>,
    /// Whether it was recorded after the session was unblinded, or by somebody who had fetched a controller file.
    pub after_unblinding: bool,
}

/// A session, without what is blinded.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct SessionView {
    /// Identifier.
    pub id: LabSessionId,
    /// The study.
    pub study_id: StudyId,
    /// 1, 2, ... of this study.
    pub number: u32,
    /// Where it stands.
    pub state: SessionState,
    /// One of the two gaits; not the one that is walked first.
    pub gait_one: TrialId,
    /// The other one.
    pub gait_two: TrialId,
    /// Free text.
    pub notes: String,
    /// Its three walks.
    pub walks: Vec<WalkView>,
    /// What the person who walked said of the two gaits; none: nothing that stands.
    pub answer: Option<AnswerView>,
    /// Who unblinded it and why; none: it is blind.
    pub unblinded: Option<Done>,
    /// Whether the order is in this record. A study that came here while the session was blind has none.
    pub order_included: bool,
    /// Who got the controller files of its walks.
    pub device_files: Vec<DeviceFile>,
    /// That it was closed.
    pub closed: Option<Done>,
    /// Who planned it.
    pub planned_by: String,
    /// When.
    pub created_at: Instant,
}

impl From<&LabSession> for SessionView {
    fn from(session: &LabSession) -> Self {
        let walk = |number| {
            let place = |act| session.acts.iter().position(|(known, _)| *known == act);
            let recorded = session.done(Act::Walk(number));
            let unblinded_before = place(Act::Unblinded)
                .zip(place(Act::Walk(number)))
                .is_some_and(|(unblinded, walked)| unblinded < walked);
            WalkView {
                number,
                condition: condition(session, number),
                recorded: recorded.cloned(),
                after_unblinding: unblinded_before
                    || recorded.is_some_and(|done| has_file(session, &done.actor, done.at)),
            }
        };
        Self {
            id: session.id,
            study_id: session.study_id,
            number: session.number,
            state: SessionState::of(session),
            gait_one: session.gait_one,
            gait_two: session.gait_two,
            notes: session.notes.clone(),
            walks: (1..=WALKS).map(walk).collect(),
            answer: session.answer().map(|answer| AnswerView::of(session, answer)),
            unblinded: session.done(Act::Unblinded).cloned(),
            order_included: session.allocation.included,
            device_files: session.allocation.files.clone(),
            closed: session.done(Act::Closed).cloned(),
            planned_by: session.actor.clone(),
            created_at: session.created_at,
        }
    }
}

/// What a walk is done with; none as long as that is blinded.
fn condition(session: &LabSession, walk: u8) -> Option<Condition> {
    if walk == 1 {
        return Some(Condition::Normal);
    }
    let one_first = session.allocation.gait_one_first?;
    Some(if one_first == (walk == 2) { Condition::GaitOne } else { Condition::GaitTwo })
}

/// The gait of a walk; none without the device, and as long as the session is blinded.
pub(super) fn gait_of(session: &LabSession, walk: u8) -> Option<TrialId> {
    match condition(session, walk)? {
        Condition::Normal => None,
        Condition::GaitOne => Some(session.gait_one),
        Condition::GaitTwo => Some(session.gait_two),
    }
}

/// Whether somebody may have fetched a controller file of this session before an instant. Who holds a token is not known: a
/// token may be anybody's, and anybody may hold one.
pub(super) fn has_file(session: &LabSession, actor: &str, at: Instant) -> bool {
    let may_be = |other: &str| other == actor || Actor::is_token(other) || Actor::is_token(actor);
    session.allocation.files.iter().any(|file| !file.to_device && may_be(&file.actor) && file.at <= at)
}

/// Which of a session's two gaits.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum GaitOfWalk {
    /// Gait one.
    One,
    /// Gait two.
    Two,
}

/// Gives out the controller file of a walk: the file reveals the gait, so the record names whoever took it. Only the device's own
/// token leaves the session blind to its caller.
///
/// # Errors
/// [`Error::Invalid`] for a walk without the device and for one that there is not, [`Error::Conflict`] when the order is not
/// in this record or the subject withdrew.
pub async fn for_device(writer: &mut Writer, caller: &Caller, id: LabSessionId, walk: u8) -> Result<GaitOfWalk, Error> {
    let walk = checked_device_walk(walk)?;
    let session = still_shown(writer, id).await?;
    if !session.allocation.included {
        return Err(not_included());
    }
    let to_device = caller.is_device();
    let is_one = allocations::for_device(writer, id, walk, (&caller.actor, to_device)).await?;
    let detail = json!({ "walk": walk, "to_device": to_device });
    audit::append(writer, &caller.actor, "lab_session.device_file", &format!("lab session {id}"), &detail).await?;
    Ok(if is_one.ok_or_else(not_included)? { GaitOfWalk::One } else { GaitOfWalk::Two })
}

/// The number of a walk, if it is one with the device.
///
/// # Errors
/// [`Error::Invalid`].
fn checked_device_walk(walk: u8) -> Result<u8, Error> {
    match checked_walk(walk)? {
        1 => Err(Error::invalid("walk", walk, "2 or 3: walk 1 is without the device")),
        with_device => Ok(with_device),
    }
}

fn not_included() -> Error {
    Error::conflict(
        "the archive that this session came from left its order out, because the session was blind: unblind it where it was \
         planned",
    )
}

/// The two gaits of a session in which the subject is about to walk: gait one and gait two.
///
/// # Errors
/// [`Error::Invalid`] for a walk without the device and for one that there is not, [`Error::Conflict`] when the session is
/// closed or one of its two gaits may not be walked with.
pub async fn gaits_to_walk_with(
    db: &mut Connection,
    session: &LabSession,
    walk: u8,
) -> Result<(WalkableGait, WalkableGait), Error> {
    checked_device_walk(walk)?;
    if session.done(Act::Closed).is_some() {
        return Err(Error::conflict("the session is closed: nobody walks in it any more"));
    }
    both_walkable(db, session).await
}

/// Both gaits of a session. The refusal does not say which of them may not be walked with: that would tell the order to
/// whoever knows which walk is next.
async fn both_walkable(db: &mut Connection, session: &LabSession) -> Result<(WalkableGait, WalkableGait), Error> {
    let one = walkable::admit(db, session.gait_one).await?;
    let two = walkable::admit(db, session.gait_two).await?;
    one.and_then(|one| Ok((one, two?))).map_err(|reason| match reason {
        NotWalkable::Withdrawn => reason.into(),
        _ => Error::conflict(
            "one of the two gaits of this session may not be walked with any more: close the session and plan another one",
        ),
    })
}

/// The number of a walk, if there is such a walk.
///
/// # Errors
/// [`Error::Invalid`].
pub fn checked_walk(walk: u8) -> Result<u8, Error> {
    if (1..=WALKS).contains(&walk) { Ok(walk) } else { Err(Error::invalid("walk", walk, "1, 2 or 3")) }
}

/// Plans a session: draws its order and writes it.
///
/// # Errors
/// [`Error::Invalid`] naming the field, [`Error::NotFound`], or what the database reports.
pub async fn plan(writer: &mut Writer, actor: &Actor, study: StudyId, new: &NewSession) -> Result<LabSession, Error> {
    studies::get(writer, study).await?;
    printable::note("notes", &new.notes, LONGEST_NOTE)?;
    walkable::admit_pair(writer, study, ("gait_one", "gait_two"), (new.gait_one, new.gait_two)).await?;
    let before = lab_sessions::of_study(writer, study).await?.len();
    let row = NewLabSession {
        study_id: study,
        number: u32::try_from(before).unwrap_or(u32::MAX).saturating_add(1),
        gait_one: new.gait_one,
        gait_two: new.gait_two,
        notes: &new.notes,
    };
    let id = lab_sessions::insert(writer, actor, &row).await?;
    allocations::of_session(writer, id, row.number, Lot::draw()?).await?;
    let detail = json!({ "study": study, "number": row.number, "gait_one": row.gait_one, "gait_two": row.gait_two });
    audit::append(writer, actor, "lab_session.plan", &format!("lab session {id}"), &detail).await?;
    Ok(lab_sessions::get(writer, id).await?)
}

/// What a person in the lab sees of a session: nothing that could tell a gait.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct InTheLab {
    /// What the session is known by.
    pub session: LabSessionId,
    /// The walk that is next, 1 to 3; none when all were recorded or the session is closed.
    pub walk: Option<u8>,
    /// Of how many.
    pub walks: u8,
    /// When the last walk was recorded.
    pub last_recorded: Option<Instant>,
    /// Which walk was better is asked now, under this number: every walk was recorded, and no answer stands.
    pub asks: Option<u32>,
    /// The answer that stands.
    pub answer: Option<AnswerView>,
    /// Whether that answer can be taken back here.
    pub can_be_taken_back: bool,
    /// Whether nothing is recorded any more.
    pub closed: bool,
}

/// The session as the person who walks and the rater see it.
///
/// # Errors
/// [`Error::NotFound`], a conflict when the subject withdrew, or what the database reports.
pub async fn in_the_lab(db: &mut Connection, id: LabSessionId) -> Result<InTheLab, Error> {
    let session = still_shown(db, id).await?;
    let closed = session.done(Act::Closed).is_some();
    Ok(InTheLab {
        session: id,
        walk: next_walk(&session).filter(|_| !closed),
        walks: WALKS,
        last_recorded: (1..=WALKS).rev().find_map(|walk| session.done(Act::Walk(walk))).map(|done| done.at),
        asks: answer::asks(&session),
        answer: session.answer().map(|answer| AnswerView::of(&session, answer)),
        can_be_taken_back: answer::can_be_taken_back(&session),
        closed,
    })
}

pub(super) fn next_walk(session: &LabSession) -> Option<u8> {
    (1..=WALKS).find(|walk| session.done(Act::Walk(*walk)).is_none())
}

/// A walk that was recorded.
#[derive(Debug, Clone, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct RecordedWalk {
    /// Its number: walks are recorded in their order.
    #[schema(minimum = 1, maximum = 3)]
    pub walk: u8,
    /// Free text, at most 2000 characters.
    #[serde(default)]
    #[schema(max_length = 2000)]
    pub note: String,
}

/// Writes that a walk was recorded.
///
/// # Errors
/// [`Error::Invalid`] for a walk that there is not, [`Error::Conflict`] when it is not the next one.
pub async fn record_walk(
    writer: &mut Writer,
    actor: &Actor,
    id: LabSessionId,
    walked: &RecordedWalk,
) -> Result<InTheLab, Error> {
    let walk = checked_walk(walked.walk)?;
    printable::note("note", &walked.note, LONGEST_NOTE)?;
    let session = still_open(writer, id).await?;
    match next_walk(&session) {
        Some(next) if next == walk => {}
        Some(next) => return Err(Error::conflict(format!("walk {next} is next, not walk {walk}"))),
        None => return Err(Error::conflict("every walk of this session was recorded")),
    }
    if walk > 1 {
        both_walkable(writer, &session).await?;
    }
    lab_sessions::act(writer, actor, id, Act::Walk(walk), &walked.note).await?;
    let detail = json!({ "walk": walk, "note": walked.note });
    audit::append(writer, actor, "lab_session.walk", &format!("lab session {id}"), &detail).await?;
    in_the_lab(writer, id).await
}

/// Whether this very walk was recorded, with this note: a form that was sent twice.
///
/// # Errors
/// [`Error::NotFound`], a conflict when the subject withdrew, or what the database reports.
pub async fn was_recorded(db: &mut Connection, id: LabSessionId, walked: &RecordedWalk) -> Result<bool, Error> {
    let session = still_shown(db, id).await?;
    Ok(session.done(Act::Walk(walked.walk)).is_some_and(|done| done.note == walked.note))
}

/// The session, if its subject did not withdraw.
///
/// # Errors
/// [`Error::NotFound`], [`Error::Conflict`] when the subject withdrew.
pub(super) async fn still_shown(db: &mut Connection, id: LabSessionId) -> Result<LabSession, Error> {
    let session = lab_sessions::get(db, id).await?;
    consents::may_be_shown(db, session.study_id).await?;
    Ok(session)
}

/// The session, if something may still be added to it.
///
/// # Errors
/// [`Error::NotFound`], [`Error::Conflict`] when it is closed or the subject withdrew.
pub async fn still_open(writer: &mut Writer, id: LabSessionId) -> Result<LabSession, Error> {
    let session = still_shown(writer, id).await?;
    if session.done(Act::Closed).is_some() {
        return Err(Error::conflict("the session is closed: nothing is added to it"));
    }
    Ok(session)
}

/// Closes a session: nothing is recorded any more.
///
/// # Errors
/// [`Error::NotFound`], [`Error::Conflict`] when it was closed before.
pub async fn close(writer: &mut Writer, actor: &Actor, id: LabSessionId, note: &str) -> Result<LabSession, Error> {
    printable::note("note", note, LONGEST_NOTE)?;
    still_open(writer, id).await?;
    lab_sessions::act(writer, actor, id, Act::Closed, note).await?;
    let detail = json!({ "note": note });
    audit::append(writer, actor, "lab_session.close", &format!("lab session {id}"), &detail).await?;
    Ok(lab_sessions::get(writer, id).await?)
}

/// Unblinds a session: everybody who may read sees which walk is with which gait from now on. The learner then hears what the
/// person who walked said.
///
/// # Errors
/// [`Error::Invalid`] without a reason, [`Error::Conflict`] when it is unblinded, or its order is not in this record.
pub async fn unblind(writer: &mut Writer, actor: &Actor, id: LabSessionId, reason: &str) -> Result<LabSession, Error> {
    let reason = printable::reason("reason", reason, ": why the session is unblinded")?;
    if !still_shown(writer, id).await?.allocation.included {
        return Err(not_included());
    }
    if !lab_sessions::act(writer, actor, id, Act::Unblinded, reason).await? {
        return Err(Error::conflict("this session was unblinded before"));
    }
    let detail = json!({ "reason": reason });
    audit::append(writer, actor, "lab_session.unblind", &format!("lab session {id}"), &detail).await?;
    let session = lab_sessions::get(writer, id).await?;
    answer::hear(writer, &session).await?;
    Ok(session)
}
