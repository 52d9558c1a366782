//! The solves of an unfinished atlas, one JSON object in a line, so that a killed command can continue.

use super::solved_action::SolvedAction;
use crate::error::Error;
use crate::studies::problem_file::SolveInput;
use gait_learner::ActionIndex;
use serde::{Deserialize, Serialize};
use std::collections::VecDeque;
use std::fs::{File, OpenOptions};
use std::io::{Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

/// The first line.
#[derive(Debug, PartialEq, Serialize, Deserialize)]
struct ProgressFileHeader {
    version: String,
    /// SHA-256 of problem, options and root gait.
    problem_sha256: String,
}

/// The file, and the solves in it that were not taken yet.
pub(super) struct ProgressFile {
    path: PathBuf,
    file: File,
    earlier: VecDeque<SolvedAction>,
}

impl ProgressFile {
    /// Opens or creates the file. Refuses that of another problem. A line that was cut off is dropped.
    pub(super) fn open(path: &Path, input: &SolveInput) -> Result<Self, Error> {
        let failed = |reason: String| Error::Malformed(format!("{}: {reason}", path.display()));
        let io = |e: std::io::Error| Error::Malformed(format!("Cannot open or write {}: {e}.", path.display()));
        let mut file = OpenOptions::new().read(true).write(true).create(true).truncate(false).open(path).map_err(io)?;
        if file.try_lock().is_err() {
            return Err(failed("another process is using it.".to_owned()));
        }
        let mut text = String::new();
        file.read_to_string(&mut text).map_err(io)?;
        let header = ProgressFileHeader {
            version: env!("CARGO_PKG_VERSION").to_owned(),
            problem_sha256: gaitwright_store::sha256(input.to_json()?.as_bytes()),
        };
        let whole = text.rfind('\n').map_or(0, |end| end + 1);
        let mut lines = text[..whole].lines();
        match lines.next().map(serde_json::from_str::<ProgressFileHeader>) {
            None => {
                let line = serde_json::to_string(&header).map_err(|e| Error::Internal(e.to_string()))?;
                file.set_len(0).and_then(|()| file.rewind()).and_then(|()| writeln!(file, "{line}")).map_err(io)?;
                return Ok(Self { path: path.to_owned(), file, earlier: VecDeque::new() });
            }
            Some(Ok(found)) if found == header => {}
            Some(_) => {
                let why = "it belongs to an atlas of another problem or version. Delete it, or choose another --out.";
                return Err(failed(why.to_owned()));
            }
        }
        let earlier: Result<VecDeque<SolvedAction>, _> = lines.map(serde_json::from_str).collect();
        let earlier = earlier.map_err(|e| failed(format!("it is damaged ({e}). Delete it to start again.")))?;
        file.set_len(whole as u64).and_then(|()| file.seek(SeekFrom::End(0))).map_err(io)?;
        Ok(Self { path: path.to_owned(), file, earlier })
    }

    /// The earlier solves of the first actions of a batch. Batches are always the same, so they are next in the file.
    pub(super) fn take(&mut self, batch: &[ActionIndex]) -> Vec<SolvedAction> {
        let same = self.earlier.iter().zip(batch).take_while(|(solved, action)| solved.action == **action).count();
        self.earlier.drain(..same).collect()
    }

    /// Adds solves durably.
    pub(super) fn append(&mut self, solved: &[SolvedAction]) -> Result<(), Error> {
        let mut text = String::new();
        for solved in solved {
            text.push_str(&serde_json::to_string(solved).map_err(|e| Error::Internal(e.to_string()))?);
            text.push('\n');
        }
        let written = self.file.write_all(text.as_bytes()).and_then(|()| self.file.sync_data());
        written.map_err(|e| Error::Malformed(format!("Cannot write {}: {e}.", self.path.display())))
    }

    /// Deletes the file of a complete atlas.
    pub(super) fn remove(self) -> std::io::Result<()> {
        std::fs::remove_file(&self.path)
    }
}
