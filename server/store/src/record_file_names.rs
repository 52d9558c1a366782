//! Names of the files that lie next to a record.

use super::now;
use std::path::{Path, PathBuf};

/// The path next to the record with this suffix.
pub(crate) fn path_with_suffix(path: &Path, ending: &str) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(ending);
    PathBuf::from(name)
}

/// `gaitwright.db.WHAT-20260501T101500`, with a number if that name is taken.
pub(super) fn free_name(of: &Path, what: &str) -> PathBuf {
    let stamp: String = now().to_string().chars().filter(char::is_ascii_alphanumeric).take(15).collect();
    let first = path_with_suffix(of, &format!(".{what}-{stamp}"));
    let mut name = first.clone();
    let mut number = 1_u32;
    while name.exists() {
        number += 1;
        name = path_with_suffix(&first, &format!("-{number}"));
    }
    name
}
