//! The access spool: a file next to the record in which commands note exports, until the owner of the record writes
//! them to the access log.

use super::access_log::{Access, Tally};
use super::record_file_names::path_with_suffix;
use super::{Instant, StoreError, StoreResult};
use serde::{Deserialize, Serialize};
use std::fs::{File, OpenOptions, TryLockError};
use std::io::{BufRead, BufReader, Read, Write};
use std::path::{Path, PathBuf};

/// Number of lines that are read at a time.
const LINES_PER_READ: usize = 200;
/// A longer line is no access.
const MAX_LINE_BYTES: u64 = 1 << 16;

#[derive(Serialize, Deserialize)]
struct SpoolLine {
    at: Instant,
    access: Access,
}

fn path_of(record: &Path) -> PathBuf {
    path_with_suffix(record, ".access")
}

/// Notes an access durably.
///
/// # Errors
/// If the file cannot be written, as on a read-only medium.
pub fn note(record: &Path, access: &Access) -> StoreResult<()> {
    let path = path_of(record);
    let failed = |source| StoreError::Open { path: path.clone(), source };
    let line = SpoolLine { at: super::now(), access: access.clone() };
    let mut text = super::json_columns::to_text("access", &line)?;
    text.push('\n');
    let mut options = OpenOptions::new();
    options.create(true).append(true);
    #[cfg(unix)]
    std::os::unix::fs::OpenOptionsExt::mode(&mut options, 0o600);
    let mut file = options.open(&path).map_err(failed)?;
    file.lock().and_then(|()| file.write_all(text.as_bytes())).and_then(|()| file.sync_all()).map_err(failed)
}

/// The accesses that commands logged, oldest first. While this is held, no command can add any.
#[derive(Debug)]
pub struct Spool {
    file: BufReader<File>,
    path: PathBuf,
}

/// Takes the accesses that were logged next to a record, if any.
///
/// # Errors
/// If the file cannot be read.
pub fn take(record: &Path) -> StoreResult<Option<Spool>> {
    let path = path_of(record);
    if !std::fs::metadata(&path).is_ok_and(|file| file.len() > 0) {
        return Ok(None);
    }
    let failed = |source| StoreError::Open { path: path.clone(), source };
    let file = OpenOptions::new().read(true).write(true).open(&path).map_err(failed)?;
    match file.try_lock() {
        Ok(()) => {}
        // A command is writing, so take it next time.
        Err(TryLockError::WouldBlock) => return Ok(None),
        Err(TryLockError::Error(source)) => return Err(failed(source)),
    }
    Ok(Some(Spool { file: BufReader::new(file), path }))
}

impl Spool {
    /// The next accesses, a limited number at a time; `None` at the end. Lines that no command wrote are ignored, with a warning.
    ///
    /// # Errors
    /// If the file cannot be read.
    pub fn more(&mut self) -> StoreResult<Option<Vec<(Access, Tally)>>> {
        let (mut accesses, mut lines) = (Vec::new(), 0);
        while lines < LINES_PER_READ {
            let mut line = Vec::new();
            let read = (&mut self.file).take(MAX_LINE_BYTES).read_until(b'\n', &mut line);
            if read.map_err(|source| StoreError::Open { path: self.path.clone(), source })? == 0 {
                break;
            }
            lines += 1;
            if let Ok(SpoolLine { at, access }) = serde_json::from_slice(&line) {
                accesses.push((access, Tally { first_at: at, last_at: at, times: 1 }));
            } else {
                tracing::warn!(file = %self.path.display(), "ignoring a malformed line of the access spool");
            }
        }
        Ok((lines > 0).then_some(accesses))
    }

    /// Clears the spool after its accesses were written to the log.
    ///
    /// # Errors
    /// If the file cannot be cleared.
    pub fn clear(self) -> StoreResult<()> {
        self.file.get_ref().set_len(0).map_err(|source| StoreError::Open { path: self.path, source })
    }
}

#[cfg(test)]
mod tests {
    use super::super::access_log::AccessKind;
    use super::*;

    fn access(object: String) -> Access {
        let text = |text: &str| text.to_owned();
        Access {
            kind: AccessKind::Export,
            actor: text("command line"),
            address: String::new(),
            method: String::new(),
            route: text("export"),
            object,
            status: 0,
            named: Vec::new(),
        }
    }

    #[test]
    fn accesses_between_damaged_lines_are_read() {
        let folder = tempfile::tempdir().unwrap();
        let record = folder.path().join("a.db");
        let garbage = || {
            let mut file = OpenOptions::new().append(true).create(true).open(path_of(&record)).unwrap();
            file.write_all(b"\xff\xfe\n{}\n").unwrap();
        };
        garbage();
        for number in 0..LINES_PER_READ + 5 {
            note(&record, &access(format!("study {number}, {}", "x".repeat(6000)))).unwrap();
        }
        garbage();
        let mut spool = take(&record).unwrap().unwrap();
        let mut found = Vec::new();
        while let Some(accesses) = spool.more().unwrap() {
            found.extend(accesses.into_iter().map(|(access, _)| access.object));
        }
        assert_eq!(found.len(), LINES_PER_READ + 5);
        assert!(found.iter().enumerate().all(|(at, object)| object.starts_with(&format!("study {at},"))));
        spool.clear().unwrap();
        assert!(take(&record).unwrap().is_none());
    }
}
