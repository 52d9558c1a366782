//! Reads a gait from a file of `solve --out`, or from a gait file of the service.

use super::problem::read;
use gait_optimizer::{Gait, SolveOutcome};
use gaitwright_service::document;
use gaitwright_service::error::Error;
use serde_json::Value;
use std::path::Path;

/// Reads the gait.
///
/// # Errors
/// [`Error::Malformed`] with the file's name and the reason.
pub(super) fn read_gait(path: &Path) -> Result<Gait, Error> {
    let text = read(path)?;
    let bytes = text.as_bytes();
    let gait = document::read::<Value>(bytes).and_then(|value| {
        if value.get("gait").is_some() {
            document::read::<SolveOutcome>(bytes).map(|outcome| outcome.gait)
        } else {
            document::read(bytes)
        }
    });
    gait.map_err(|e| Error::Malformed(format!("{} is not a gait file: {e}", path.display())))
}
