//! Files that hold a gait: what `solve --out` wrote, or the gait alone, as the service gives it.

use super::problem::read;
use crate::error::Error;
use gait_optimizer::{Gait, SolveOutcome};
use serde_json::Value;
use std::path::Path;

/// The gait of a file.
///
/// # Errors
/// [`Error::Malformed`] with the file's name and the reason.
pub(super) fn read_gait(path: &Path) -> Result<Gait, Error> {
    let refused = |e: serde_json::Error| Error::Malformed(format!("{}: not a gait: {e}", path.display()));
    let text = read(path)?;
    let value: Value = serde_json::from_str(&text).map_err(refused)?;
    // From the text again, so that a refusal names line and column.
    let gait = if value.get("gait").is_some() {
        serde_json::from_str::<SolveOutcome>(&text).map_err(refused)?.gait
    } else {
        serde_json::from_str(&text).map_err(refused)?
    };
    Ok(gait)
}
