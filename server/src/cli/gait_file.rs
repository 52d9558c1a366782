//! Files that hold a gait: what `solve --out` wrote, or the gait alone, as the service gives it.

use super::problem::read;
use gait_optimizer::{Gait, SolveOutcome};
use gaitwright_service::document;
use gaitwright_service::error::Error;
use serde_json::Value;
use std::path::Path;

/// The gait of a file.
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
    gait.map_err(|e| Error::Malformed(format!("{}: not a gait: {e}", path.display())))
}
