//! Names of the files that lie next to a record.

use std::path::{Path, PathBuf};

/// The path next to the record with this suffix.
pub(crate) fn companion(path: &Path, ending: &str) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(ending);
    PathBuf::from(name)
}
