//! Format and name of a measurement file.

use crate::error::Error;
use crate::printable;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// Name of an uploaded file in errors.
pub(super) const WHAT: &str = "recording";

/// Format of a measurement file: `csv`, comma-separated values with column names in the first line; `opensim`, a motion
/// or storage file (.mot, .sto).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, Serialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum MeasurementFormat {
    /// Comma-separated values, with column names in the first line that is not a comment.
    #[default]
    Csv,
    /// OpenSim motion or storage file (.mot, .sto).
    Opensim,
}

/// Longest name of a file, characters.
const LONGEST_FILE_NAME: usize = 200;

pub(super) fn check_file_name(name: Option<&str>) -> Result<(), Error> {
    name.map_or(Ok(()), |name| printable::name("reading.file_name", name, LONGEST_FILE_NAME).map(|_| ()))
}
