//! A file that a command finishes at its end, but tries at its beginning: hours of solving are not lost to a typing
//! error in its name. What is appended before the end is there even if the process is killed.

use super::output::tell;
use crate::error::Error;
use std::fs::{File, OpenOptions};
use std::io::Write;
use std::path::{Path, PathBuf};

/// A file that is written whole or not at all. Until then there is a hidden one beside it, with what was appended so
/// far. A link is followed; a device or pipe is written to as it is.
#[derive(Debug)]
pub(super) struct OutFile {
    path: PathBuf,
    /// `None`: no regular file.
    part: Option<PathBuf>,
    file: Option<File>,
}

impl OutFile {
    /// Makes sure that the file can be written. `inputs` are files that the command reads: writing over one of them is
    /// refused.
    ///
    /// # Errors
    /// [`Error::Malformed`] with the reason when it cannot.
    pub(super) fn open(path: &Path, inputs: &[&Path]) -> Result<Self, Error> {
        let known = path.canonicalize().ok();
        if let (Some(known), Some(input)) = (&known, inputs.iter().find(|i| i.canonicalize().ok() == known)) {
            return Err(failed(path, format!("{} is read by this command ({})", input.display(), known.display())));
        }
        if path.is_dir() {
            return Err(failed(path, "it is a folder"));
        }
        if known.as_ref().is_some_and(|known| !known.is_file()) {
            let file = OpenOptions::new().write(true).open(path).map_err(|e| failed(path, e))?;
            return Ok(Self { path: path.to_owned(), part: None, file: Some(file) });
        }
        let path = known.unwrap_or_else(|| path.to_owned());
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        let part = path.with_file_name(format!(".{name}.{}.part", std::process::id()));
        let file = OpenOptions::new().write(true).create_new(true).open(&part).map_err(|e| failed(&path, e))?;
        Ok(Self { path, part: Some(part), file: Some(file) })
    }

    /// The file.
    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    /// Where the file grows until it is whole.
    pub(super) fn part(&self) -> &Path {
        self.part.as_deref().unwrap_or(&self.path)
    }

    /// Writes the file.
    ///
    /// # Errors
    /// [`Error::Malformed`] with the reason.
    pub(super) fn write(mut self, text: &str) -> Result<(), Error> {
        self.append(text)?;
        self.finish()
    }

    /// Adds to what will be the file.
    ///
    /// # Errors
    /// [`Error::Malformed`] with the reason.
    pub(super) fn append(&mut self, text: &str) -> Result<(), Error> {
        let Some(file) = &mut self.file else { return Ok(()) };
        file.write_all(text.as_bytes()).map_err(|e| failed(&self.path, e))
    }

    /// Puts what was appended in the place of the file.
    ///
    /// # Errors
    /// [`Error::Malformed`] with the reason.
    pub(super) fn finish(mut self) -> Result<(), Error> {
        let (Some(file), Some(part)) = (self.file.take(), &self.part) else { return Ok(()) };
        let done = file.sync_all().and_then(|()| std::fs::rename(part, &self.path));
        if done.is_err() {
            self.clean();
        }
        done.map_err(|e| failed(&self.path, e))
    }

    fn clean(&self) {
        if let Some(part) = &self.part
            && let Err(e) = std::fs::remove_file(part)
            && e.kind() != std::io::ErrorKind::NotFound
        {
            tell(&format!("gaitwright: {} is left over: {e}", part.display()));
        }
    }
}

impl Drop for OutFile {
    fn drop(&mut self) {
        if self.file.take().is_some() {
            self.clean();
        }
    }
}

fn failed(path: &Path, reason: impl std::fmt::Display) -> Error {
    Error::Malformed(format!("cannot write {}: {reason}", path.display()))
}
