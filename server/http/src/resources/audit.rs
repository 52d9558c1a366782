//! Rows of the audit trail.

use super::document_schemas;
use gaitwright_store::{Instant, audit};
use serde::Serialize;
use serde_json::Value;
use utoipa::ToSchema;

/// Entry of the audit trail.
#[derive(Debug, Serialize, ToSchema)]
#[schema(as = AuditEntry)]
pub(crate) struct AuditRow {
    /// Sequence number.
    seq: i64,
    /// Time of the change.
    created_at: Instant,
    /// Actor of the change.
    actor: String,
    /// Kind of change, such as `subject.add` or `study.pause`.
    change: String,
    /// Changed object, such as `study 0190...`.
    object: String,
    /// Details of the change, with the reason if there is one.
    #[schema(value_type = document_schemas::AuditDetail)]
    detail: Value,
    /// Hash of the previous row.
    previous: String,
    /// Hash over this row and the hash of the previous row.
    hash: String,
}

impl From<audit::AuditRow> for AuditRow {
    fn from(row: audit::AuditRow) -> Self {
        let audit::AuditRow { seq, created_at, actor, change, object, detail, previous, hash } = row;
        Self { seq, created_at, actor, change, object, detail, previous, hash }
    }
}
