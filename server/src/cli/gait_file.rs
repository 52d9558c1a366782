//! Reads a gait from a file of `solve --out`, or from a gait file of the service.

use super::input_file::read;
use gait_optimizer::{Gait, SolveOutcome, SolveReport};
use gaitwright_service::error::Error;
use gaitwright_service::json_document;
use serde_json::Value;
use std::path::Path;

/// A gait, with the report of its solve if the file has one.
pub(super) struct GaitFile {
    pub(super) gait: Gait,
    pub(super) report: Option<SolveReport>,
}

/// Reads a gait file.
///
/// # Errors
/// [`Error::Malformed`] with the file's name and the reason.
pub(super) fn read_gait_file(path: &Path) -> Result<GaitFile, Error> {
    let text = read(path)?;
    let bytes = text.as_bytes();
    let file = json_document::read::<Value>(bytes).and_then(|value| {
        if value.get("gait").is_some() {
            let SolveOutcome { gait, report, .. } = json_document::read(bytes)?;
            Ok(GaitFile { gait, report: Some(report) })
        } else {
            Ok(GaitFile { gait: json_document::read(bytes)?, report: None })
        }
    });
    file.map_err(|e| Error::Malformed(format!("{} is not a gait file: {e}", path.display())))
}
