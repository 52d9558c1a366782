//! Reads the files that commands take.

use gaitwright_service::error::Error;
use gaitwright_service::json_document;
use serde::de::DeserializeOwned;
use std::path::Path;

pub(super) fn read(path: &Path) -> Result<String, Error> {
    let bytes = std::fs::read(path).map_err(|e| Error::Malformed(format!("Cannot read {}: {e}.", path.display())))?;
    String::from_utf8(bytes).map_err(|error| {
        let readable = &error.as_bytes()[..error.utf8_error().valid_up_to()];
        let line = readable.split(|byte| *byte == b'\n').count();
        Error::Malformed(format!("{}, line {line}, is not valid UTF-8. Save the file as UTF-8.", path.display()))
    })
}

/// Reads and checks a JSON file. Errors name the file.
pub(super) fn read_document<T: DeserializeOwned>(
    path: &Path,
    what: &str,
    check: impl Fn(&T) -> Result<(), Error>,
) -> Result<T, Error> {
    let read = json_document::read(read(path)?.as_bytes()).and_then(|read| check(&read).map(|()| read));
    read.map_err(|e| Error::Malformed(format!("{} is not {what}: {e}", path.display())))
}
