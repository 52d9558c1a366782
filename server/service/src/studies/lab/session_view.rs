//! Views of lab sessions that conceal the allocation.

use super::question::{AnswerView, WALKS, has_file};
use gaitwright_store::allocations::ControllerFileDownload;
use gaitwright_store::lab_sessions::{LabSession, LabSessionStep, SessionStep};
use gaitwright_store::{Instant, LabSessionId, StudyId, TrialId};
use serde::Serialize;
use utoipa::ToSchema;

/// Condition of a walk: `normal`, without the device; `gait_a` and `gait_b`, with that gait of the session.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum WalkCondition {
    /// Without the device.
    Normal,
    /// With gait A.
    GaitA,
    /// With gait B.
    GaitB,
}

/// State of a lab session: `planned`, no walk is recorded; `under_way`, at least one walk is recorded; `answered`, the
/// subject has answered, so no walk is left; `closed`, the session accepts no more data except
/// safety reports.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum LabSessionState {
    /// No walk is recorded yet.
    Planned,
    /// At least one walk is recorded.
    UnderWay,
    /// The subject has answered, so no walk is left.
    Answered,
    /// The session accepts no more data except safety reports.
    Closed,
}

impl LabSessionState {
    /// The name of the state.
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Planned => "planned",
            Self::UnderWay => "under_way",
            Self::Answered => "answered",
            Self::Closed => "closed",
        }
    }

    fn of(session: &LabSession) -> Self {
        if session.done(SessionStep::Closed).is_some() {
            Self::Closed
        } else if session.answer().is_some() {
            Self::Answered
        } else if session.done(SessionStep::Walk(1)).is_some() {
            Self::UnderWay
        } else {
            Self::Planned
        }
    }
}

/// Walk of a session.
#[derive(Debug, Clone, PartialEq)]
pub struct WalkView {
    /// Number of the walk, 1 to 3.
    pub number: u8,
    /// Condition of the walk. Absent while it is blinded.
    pub condition: Option<WalkCondition>,
    /// Actor and time of the recording of the walk.
    pub recorded: Option<LabSessionStep>,
    /// Whether it was recorded after unblinding, or by a user who had fetched a controller file.
    pub recorded_after_unblinding: bool,
}

/// Lab session, without blinded data.
#[derive(Debug, Clone, PartialEq)]
pub struct LabSessionView {
    /// Identifier.
    pub id: LabSessionId,
    /// Identifier of the study.
    pub study_id: StudyId,
    /// Number of the session in this study, from 1.
    pub number: u32,
    /// State of the session.
    pub state: LabSessionState,
    /// The trial with gait A. Does not imply the order of the walks.
    pub trial_a: TrialId,
    /// The trial with gait B.
    pub trial_b: TrialId,
    /// Free text.
    pub notes: String,
    /// The three walks.
    pub walks: Vec<WalkView>,
    /// Current answer of the subject. Absent if there is none.
    pub answer: Option<AnswerView>,
    /// Actor, time and reason of the unblinding. Absent while the session is blinded.
    pub unblinded: Option<LabSessionStep>,
    /// Whether the allocation is in this record. It is missing if the study was exported while the session was blinded,
    /// and then imported.
    pub allocation_included: bool,
    /// Downloads of controller files of the walks.
    pub controller_files: Vec<ControllerFileDownload>,
    /// Actor and time of the closing.
    pub closed: Option<LabSessionStep>,
    /// Actor who planned the session.
    pub planned_by: String,
    /// Time of planning.
    pub created_at: Instant,
}

impl From<&LabSession> for LabSessionView {
    fn from(session: &LabSession) -> Self {
        let walk = |number| {
            let place = |step| session.steps.iter().position(|(known, _)| *known == step);
            let recorded = session.done(SessionStep::Walk(number));
            let unblinded_before = place(SessionStep::Unblinded)
                .zip(place(SessionStep::Walk(number)))
                .is_some_and(|(unblinded, walked)| unblinded < walked);
            WalkView {
                number,
                condition: condition(session, number),
                recorded: recorded.cloned(),
                recorded_after_unblinding: unblinded_before
                    || recorded.is_some_and(|done| has_file(session, &done.actor, done.at)),
            }
        };
        Self {
            id: session.id,
            study_id: session.study_id,
            number: session.number,
            state: LabSessionState::of(session),
            trial_a: session.trial_a,
            trial_b: session.trial_b,
            notes: session.notes.clone(),
            walks: (1..=WALKS).map(walk).collect(),
            answer: session.answer().map(|answer| AnswerView::of(session, answer)),
            unblinded: session.done(SessionStep::Unblinded).cloned(),
            allocation_included: session.allocation.included,
            controller_files: session.allocation.files.clone(),
            closed: session.done(SessionStep::Closed).cloned(),
            planned_by: session.actor.clone(),
            created_at: session.created_at,
        }
    }
}

/// The condition of a walk; `None` while it is blinded.
fn condition(session: &LabSession, walk: u8) -> Option<WalkCondition> {
    if walk == 1 {
        return Some(WalkCondition::Normal);
    }
    let one_first = session.allocation.gait_a_first?;
    Some(if one_first == (walk == 2) { WalkCondition::GaitA } else { WalkCondition::GaitB })
}

/// The gait of a walk; `None` without the device, and while the session is blinded.
pub(super) fn gait_of(session: &LabSession, walk: u8) -> Option<TrialId> {
    match condition(session, walk)? {
        WalkCondition::Normal => None,
        WalkCondition::GaitA => Some(session.trial_a),
        WalkCondition::GaitB => Some(session.trial_b),
    }
}
