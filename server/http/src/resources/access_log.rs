//! Rows of the access log.

use gaitwright_store::access_log::{self, AccessKind};
use gaitwright_store::{Instant, StudyId, SubjectId};
use serde::Serialize;
use utoipa::ToSchema;

/// Entry of the access log.
#[derive(Debug, Serialize, ToSchema)]
#[schema(as = AccessLogEntry)]
pub(crate) struct AccessRow {
    /// Sequence number.
    seq: i64,
    /// Time of the first access.
    created_at: Instant,
    /// Time of the last access.
    last_at: Instant,
    /// Number of identical accesses within a minute.
    times: u32,
    /// Kind of the access.
    kind: AccessKind,
    /// Actor of the request.
    actor: String,
    /// Client address; empty for the command line.
    address: String,
    /// HTTP method; empty for the command line.
    method: String,
    /// Route, or command.
    route: String,
    /// Requested URL, without secrets.
    object: String,
    /// HTTP status; 0 for the command line.
    status: u16,
    /// Study of the request, if any.
    study_id: Option<StudyId>,
    /// Subject of the request, if any.
    subject_id: Option<SubjectId>,
}

impl From<access_log::AccessRow> for AccessRow {
    fn from(row: access_log::AccessRow) -> Self {
        let access_log::AccessRow {
            seq,
            created_at,
            last_at,
            times,
            kind,
            actor,
            address,
            method,
            route,
            object,
            status,
            study_id,
            subject_id,
        } = row;
        Self {
            seq,
            created_at,
            last_at,
            times,
            kind,
            actor,
            address,
            method,
            route,
            object,
            status,
            study_id,
            subject_id,
        }
    }
}
