//! Imports of studies.

use gaitwright_store::{Instant, imports};
use serde::Serialize;
use utoipa::ToSchema;

/// Import of a study.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct Import {
    /// SHA-256 of the archive.
    file_sha256: String,
    /// Public key of the signer. Null for an unsigned archive.
    signed_by: Option<String>,
    /// Whether the import required a signature by that key.
    trusted: bool,
    /// Number of trials whose Gait RMSE could not be checked, because the archive does not have their gaits.
    unchecked_rmse: u32,
    /// Actor of the import.
    actor: String,
    /// Time of the import.
    imported_at: Instant,
}

impl From<imports::Import> for Import {
    fn from(row: imports::Import) -> Self {
        let imports::Import { seq: _, file_sha256, signed_by, trusted, unchecked_rmse, actor, imported_at } = row;
        Self { file_sha256, signed_by, trusted, unchecked_rmse, actor, imported_at }
    }
}
