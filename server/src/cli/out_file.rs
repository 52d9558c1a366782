//! A file that a command writes at its end, but tries at its beginning: hours of solving are not lost to a typing
//! error in its name.

use super::output::tell;
use crate::error::Error;
use std::fs::File;
use std::io::Write;
use std::path::{Path, PathBuf};

/// A file that is written whole or not at all. Until then there is an empty `.part` beside it.
#[derive(Debug)]
pub(super) struct OutFile {
    path: PathBuf,
    part: PathBuf,
    file: Option<File>,
}

impl OutFile {
    /// Makes sure that the file can be written.
    ///
    /// # Errors
    /// [`Error::Malformed`] with the reason when it cannot.
    pub(super) fn open(path: &Path) -> Result<Self, Error> {
        if path.is_dir() {
            return Err(failed(path, "it is a folder"));
        }
        let mut part = path.as_os_str().to_owned();
        part.push(".part");
        let part = PathBuf::from(part);
        let file = File::create(&part).map_err(|e| failed(path, e))?;
        Ok(Self { path: path.to_owned(), part, file: Some(file) })
    }

    /// The file.
    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    /// Writes the file.
    ///
    /// # Errors
    /// [`Error::Malformed`] with the reason.
    pub(super) fn write(mut self, text: &str) -> Result<(), Error> {
        let Some(mut file) = self.file.take() else { return Ok(()) };
        let written = file.write_all(text.as_bytes()).and_then(|()| file.sync_all());
        drop(file);
        match written.and_then(|()| std::fs::rename(&self.part, &self.path)) {
            Ok(()) => Ok(()),
            Err(e) => {
                self.clean();
                Err(failed(&self.path, e))
            }
        }
    }

    fn clean(&self) {
        if let Err(e) = std::fs::remove_file(&self.part)
            && e.kind() != std::io::ErrorKind::NotFound
        {
            tell(&format!("gaitwright: {} is left over: {e}", self.part.display()));
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
