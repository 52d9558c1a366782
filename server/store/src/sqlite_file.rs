//! Checks that a file is an SQLite database, before anything is written next to it.

use super::{StoreError, StoreResult};
use std::fs::File;
use std::io::{ErrorKind, Read};
use std::path::Path;

/// The first bytes of every SQLite file.
const HEADER: &[u8; 16] = b"SQLite format 3\0";

/// SQLite's error codes for a damaged file and for a file that is not a database.
const NO_DATABASE: [u32; 2] = [11, 26];
/// SQLite's error codes for a file that cannot be written or opened, or whose companion files cannot.
const NO_ACCESS: [u32; 2] = [8, 14];

/// Adds the path to an error that SQLite reports later.
pub(super) fn named(path: &Path, error: StoreError) -> StoreError {
    let StoreError::Database(sqlx::Error::Database(found)) = &error else { return error };
    // The lowest byte is the primary error code.
    let code = found.code().and_then(|code| code.parse().ok()).map(|code: u32| code & 0xff);
    let path = path.to_owned();
    match code {
        Some(code) if NO_DATABASE.contains(&code) => {
            StoreError::NotADatabase { path, reason: found.message().to_owned() }
        }
        Some(code) if NO_ACCESS.contains(&code) => {
            StoreError::Open { path, source: std::io::Error::other(found.message()) }
        }
        _ => error,
    }
}

/// Refuses a file that is not a database. A missing or empty file will become one.
pub(super) fn check(path: &Path) -> StoreResult<()> {
    let cannot_open = |source| StoreError::Open { path: path.to_owned(), source };
    let no_database = |reason: &str| Err(StoreError::NotADatabase { path: path.to_owned(), reason: reason.to_owned() });
    match std::fs::metadata(path) {
        Err(error) if error.kind() == ErrorKind::NotFound => return Ok(()),
        Ok(found) if found.is_dir() => return no_database("it is a folder"),
        // Reading a pipe would wait for its other end.
        Ok(found) if !found.is_file() => return no_database("it is not a file"),
        _ => {}
    }
    let file = File::open(path).map_err(cannot_open)?;
    let mut start = Vec::with_capacity(HEADER.len());
    file.take(HEADER.len() as u64).read_to_end(&mut start).map_err(cannot_open)?;
    if start.is_empty() || start == HEADER { Ok(()) } else { no_database("it does not start with the SQLite header") }
}
