//! Lab sessions.

use gaitwright_service::studies::lab::{self, AnswerView, LabSessionState, WalkCondition};
use gaitwright_store::{Instant, LabSessionId, StudyId, TrialId, allocations, lab_sessions};
use serde::Serialize;
use utoipa::ToSchema;

/// Completed step of a session.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct LabSessionStep {
    /// Reason or note.
    note: String,
    /// Actor of the step.
    actor: String,
    /// Time of the step.
    created_at: Instant,
}

impl From<lab_sessions::LabSessionStep> for LabSessionStep {
    fn from(row: lab_sessions::LabSessionStep) -> Self {
        let lab_sessions::LabSessionStep { note, actor, at } = row;
        Self { note, actor, created_at: at }
    }
}

/// Download of the controller file of a walk.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct ControllerFileDownload {
    /// Number of the walk, 2 or 3.
    walk: u8,
    /// Whether the device itself fetched the file. If not, the caller may know which gait the walk uses.
    to_device: bool,
    /// Actor of the download.
    actor: String,
    /// Time of the download.
    created_at: Instant,
}

impl From<allocations::ControllerFileDownload> for ControllerFileDownload {
    fn from(row: allocations::ControllerFileDownload) -> Self {
        let allocations::ControllerFileDownload { walk, to_device, actor, at } = row;
        Self { walk, to_device, actor, created_at: at }
    }
}

/// Walk of a session.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct WalkView {
    /// Number of the walk, 1 to 3.
    number: u8,
    /// Condition of the walk. Null while it is blinded.
    condition: Option<WalkCondition>,
    /// Actor and time of the recording of the walk. Null if it is not recorded yet.
    recorded: Option<LabSessionStep>,
    /// Whether it was recorded after unblinding, or by a user who had fetched a controller file.
    recorded_after_unblinding: bool,
}

impl From<lab::WalkView> for WalkView {
    fn from(walk: lab::WalkView) -> Self {
        let lab::WalkView { number, condition, recorded, recorded_after_unblinding } = walk;
        Self { number, condition, recorded: recorded.map(Into::into), recorded_after_unblinding }
    }
}

/// Lab session, without blinded data.
#[derive(Debug, Serialize, ToSchema)]
#[schema(as = LabSession)]
pub(crate) struct LabSessionView {
    /// Identifier.
    id: LabSessionId,
    /// Identifier of the study.
    study_id: StudyId,
    /// Number of the session in this study, from 1.
    number: u32,
    /// State of the session.
    state: LabSessionState,
    /// The trial with gait A. Does not imply the order of the walks.
    trial_a: TrialId,
    /// The trial with gait B.
    trial_b: TrialId,
    /// Free text.
    notes: String,
    /// The three walks.
    walks: Vec<WalkView>,
    /// Current answer of the subject. Null if there is none.
    answer: Option<AnswerView>,
    /// Actor, time and reason of the unblinding. Null while the session is blinded.
    unblinded: Option<LabSessionStep>,
    /// Whether the allocation is in this record. It is missing if the study was exported while the session was blinded,
    /// and then imported.
    allocation_included: bool,
    /// Downloads of the controller files of the walks.
    controller_files: Vec<ControllerFileDownload>,
    /// Actor and time of the closing. Null while the session is open.
    closed: Option<LabSessionStep>,
    /// Actor who planned the session.
    planned_by: String,
    /// Time of planning.
    created_at: Instant,
}

impl From<lab::LabSessionView> for LabSessionView {
    fn from(session: lab::LabSessionView) -> Self {
        let lab::LabSessionView {
            id,
            study_id,
            number,
            state,
            trial_a,
            trial_b,
            notes,
            walks,
            answer,
            unblinded,
            allocation_included,
            controller_files,
            closed,
            planned_by,
            created_at,
        } = session;
        Self {
            id,
            study_id,
            number,
            state,
            trial_a,
            trial_b,
            notes,
            walks: walks.into_iter().map(Into::into).collect(),
            answer,
            unblinded: unblinded.map(Into::into),
            allocation_included,
            controller_files: controller_files.into_iter().map(Into::into).collect(),
            closed: closed.map(Into::into),
            planned_by,
            created_at,
        }
    }
}
