//! Measurement files.

use gaitwright_store::measurement_files::{self, MeasurementKind};
use gaitwright_store::{Instant, LabSessionId, MeasurementFileId};
use serde::Serialize;
use utoipa::ToSchema;

/// Measurement file, without its content.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct MeasurementFile {
    /// Identifier.
    id: MeasurementFileId,
    /// Identifier of the lab session.
    lab_session_id: LabSessionId,
    /// Number of the walk, 1 to 3.
    walk: u8,
    /// Kind of measurement.
    kind: MeasurementKind,
    /// Name of the file. Null if unknown.
    file_name: Option<String>,
    /// SHA-256 of the file.
    raw_sha256: String,
    /// Actor of the upload.
    actor: String,
    /// Time of the upload.
    created_at: Instant,
}

impl From<measurement_files::MeasurementFile> for MeasurementFile {
    fn from(row: measurement_files::MeasurementFile) -> Self {
        let measurement_files::MeasurementFile {
            id,
            lab_session_id,
            walk,
            kind,
            file_name,
            raw_sha256,
            actor,
            created_at,
        } = row;
        Self { id, lab_session_id, walk, kind, file_name, raw_sha256, actor, created_at }
    }
}
