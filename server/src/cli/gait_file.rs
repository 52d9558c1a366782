//! Reads a gait from a file of `solve --out` or a gait file of the service, and checks the results that it states.

use super::input_file::read;
use gait_optimizer::{Gait, GaitResults, ReferenceGait, SolveOutcome, SolveReport};
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

/// Checks the results that a file states against those of its gait. The error is the reason.
pub(super) fn check_stated_values(gait: &Gait, report: &SolveReport, reference: &ReferenceGait) -> Result<(), String> {
    let results = GaitResults::of(gait, reference).map_err(|e| e.to_string())?;
    match results.difference(&GaitResults::of_report(report)) {
        None => Ok(()),
        Some((name, computed, stated)) if name.starts_with("gait_rmse") => Err(format!(
            "the file says that {name} is {stated}; with the reference gait {:?} it is {computed}. If the solve \
             used another reference gait, name that one with --reference.",
            reference.name
        )),
        Some((name, computed, stated)) => {
            Err(format!("the file says that {name} is {stated}; the value computed from the gait is {computed}."))
        }
    }
}
