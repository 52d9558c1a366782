//! Whether a file can be a database at all, before anything is written beside it.

use super::{StoreError, StoreResult};
use std::fs::File;
use std::io::{ErrorKind, Read};
use std::path::Path;

/// The first bytes of every SQLite file.
const HEADER: &[u8; 16] = b"SQLite format 3\0";

/// SQLite's codes for a file that is damaged and for one that is no database.
const NO_DATABASE: [u32; 2] = [11, 26];
/// Its codes for a file that cannot be written and for one that cannot be opened, or whose companions cannot.
const NO_ACCESS: [u32; 2] = [8, 14];

/// Names the file in what SQLite says when it finds out only later.
pub(super) fn named(path: &Path, error: StoreError) -> StoreError {
    let StoreError::Database(sqlx::Error::Database(found)) = &error else { return error };
    // The lowest byte is the code, what is above it tells more.
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

/// Refuses what is certainly no database. A file that is missing or empty is one to be made.
pub(super) fn check(path: &Path) -> StoreResult<()> {
    let cannot_open = |source| StoreError::Open { path: path.to_owned(), source };
    let no_database = |reason: &str| Err(StoreError::NotADatabase { path: path.to_owned(), reason: reason.to_owned() });
    if path.is_dir() {
        return no_database("it is a folder");
    }
    let file = match File::open(path) {
        Err(e) if e.kind() == ErrorKind::NotFound => return Ok(()),
        other => other.map_err(cannot_open)?,
    };
    let mut start = Vec::with_capacity(HEADER.len());
    file.take(HEADER.len() as u64).read_to_end(&mut start).map_err(cannot_open)?;
    if start.is_empty() || start == HEADER { Ok(()) } else { no_database("its first bytes are not those of SQLite") }
}
