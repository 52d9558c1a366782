//! Format and name of a measurement file.

use crate::error::{Error, FieldError};
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

/// How to convert a C3D file.
pub const C3D_FILE: &str = "C3D files are not read. Export the signals to CSV, for example with Mokka or with ezc3d in Python, or to a \
                            .mot or .sto file with OpenSim, and choose that file.";

/// Refuses a file by its name if it is a C3D file.
///
/// # Errors
/// [`Error::Invalid`] naming the file.
pub fn check_not_c3d(name: &str) -> Result<(), Error> {
    let is_c3d = name.trim().to_ascii_lowercase().ends_with(".c3d");
    if is_c3d { Err(FieldError::in_words(WHAT, C3D_FILE).into()) } else { Ok(()) }
}

/// Longest name of a file, characters.
const MAX_FILE_NAME: usize = 200;

pub(super) fn check_file_name(name: Option<&str>) -> Result<(), Error> {
    let Some(name) = name else { return Ok(()) };
    check_not_c3d(name)?;
    printable::name("reading.file_name", name, MAX_FILE_NAME).map(|_| ())
}
