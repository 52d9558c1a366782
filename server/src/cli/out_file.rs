//! An output file that is checked before a long command starts, and gets its name when it is complete. Appended rows
//! survive if the process is killed.

use super::output::tell;
use gaitwright_service::error::Error;
use gaitwright_store::atomic_file::sync_folder;
use std::fs::{File, OpenOptions};
use std::io::Write;
use std::path::{Path, PathBuf};

/// A file that appears only when it is complete. Until then, appended text is in a hidden file next to it. Follows
/// links, and writes directly to devices and pipes.
#[derive(Debug)]
pub(super) struct OutFile {
    path: PathBuf,
    /// The hidden file; `None` for a device or pipe.
    part: Option<PathBuf>,
    file: Option<File>,
}

impl OutFile {
    /// Checks that the file can be written. Refuses to overwrite one of `inputs`, which the command reads.
    ///
    /// # Errors
    /// [`Error::Malformed`] with the reason when it cannot.
    pub(super) fn open(path: &Path, inputs: &[&Path]) -> Result<Self, Error> {
        if path == Path::new("-") {
            return Err(Error::Malformed("Cannot write to \"-\", which is not a file name. Give a file.".to_owned()));
        }
        let known = path.canonicalize().ok();
        if let (Some(known), Some(input)) = (&known, inputs.iter().find(|i| i.canonicalize().ok() == known)) {
            return Err(failed(path, format!("{} is an input of this command ({})", input.display(), known.display())));
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
        remove_left_over(&path, &name);
        let part = path.with_file_name(format!(".{name}.{}.part", std::process::id()));
        let file = OpenOptions::new().write(true).create_new(true).open(&part).map_err(|e| failed(&path, e))?;
        // Held while this process lives. Without file locks, no part counts as left over.
        let _ = file.try_lock();
        Ok(Self { path, part: Some(part), file: Some(file) })
    }

    /// Opens the file given to --out, without which a command writes to standard output.
    ///
    /// # Errors
    /// [`Error::Malformed`] with the reason when it cannot.
    pub(super) fn instead_of_stdout(path: Option<&Path>, inputs: &[&Path]) -> Result<Option<Self>, Error> {
        if path == Some(Path::new("-")) {
            let why = "Cannot write to \"-\", which is not a file name. Omit --out to write to standard output.";
            return Err(Error::Malformed(why.to_owned()));
        }
        path.map(|path| Self::open(path, inputs)).transpose()
    }

    /// Opens a new file that only its owner can read.
    ///
    /// # Errors
    /// [`Error::Malformed`] if the file exists or cannot be written.
    pub(super) fn open_new(path: &Path) -> Result<Self, Error> {
        if path.exists() {
            return Err(failed(path, "it already exists"));
        }
        let out = Self::open(path, &[])?;
        #[cfg(unix)]
        if let Some(file) = &out.file {
            let owner_alone = std::os::unix::fs::PermissionsExt::from_mode(0o600);
            file.set_permissions(owner_alone).map_err(|e| failed(path, e))?;
        }
        Ok(out)
    }

    /// The file.
    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    /// The hidden file, until the file is complete.
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

    /// Appends text.
    ///
    /// # Errors
    /// [`Error::Malformed`] with the reason.
    pub(super) fn append(&mut self, text: &str) -> Result<(), Error> {
        let Some(file) = &mut self.file else { return Ok(()) };
        file.write_all(text.as_bytes()).map_err(|e| failed(&self.path, e))
    }

    /// Gives the completed file its name.
    ///
    /// # Errors
    /// [`Error::Malformed`] with the reason.
    pub(super) fn finish(mut self) -> Result<(), Error> {
        let (Some(file), Some(part)) = (self.file.take(), &self.part) else { return Ok(()) };
        let renamed = file.sync_all().and_then(|()| std::fs::rename(part, &self.path));
        let done = renamed.and_then(|()| sync_folder(&self.path));
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
            tell(&format!("gaitwright: cannot remove {}: {e}", part.display()));
        }
    }
}

impl Write for OutFile {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        match &mut self.file {
            Some(file) => file.write(bytes),
            None => Ok(bytes.len()),
        }
    }

    fn flush(&mut self) -> std::io::Result<()> {
        self.file.as_mut().map_or(Ok(()), Write::flush)
    }
}

impl Drop for OutFile {
    fn drop(&mut self) {
        if self.file.take().is_some() {
            self.clean();
        }
    }
}

/// Removes empty hidden files of killed processes. One with rows may still be wanted.
fn remove_left_over(path: &Path, name: &str) {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let (start, end) = (format!(".{name}."), ".part");
    for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
        let other = entry.file_name();
        let process = other.to_str().and_then(|other| other.strip_prefix(&start)?.strip_suffix(end));
        let is_part = process.is_some_and(|number| number.parse::<u32>().is_ok());
        if is_part
            && entry.metadata().is_ok_and(|part| part.len() == 0)
            && File::open(entry.path()).is_ok_and(|part| part.try_lock().is_ok())
        {
            // A failure does not prevent writing.
            let _ = std::fs::remove_file(entry.path());
        }
    }
}

fn failed(path: &Path, reason: impl std::fmt::Display) -> Error {
    Error::Malformed(format!("Cannot write {}: {reason}.", path.display()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn left_over_parts_are_removed_unless_they_have_rows() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        for (part, text) in [("1", ""), ("2", "a1,a2\n"), ("3", ""), ("x", "")] {
            std::fs::write(at(&format!(".out.csv.{part}.part")), text).unwrap();
        }
        let at_work = File::open(at(".out.csv.3.part")).unwrap();
        at_work.lock().unwrap();
        OutFile::open(&at("out.csv"), &[]).unwrap().write("a1\n").unwrap();
        let left = ["1", "2", "3", "x"].map(|part| at(&format!(".out.csv.{part}.part")).exists());
        assert_eq!(left, [false, true, true, true]);
        assert_eq!(std::fs::read_to_string(at("out.csv")).unwrap(), "a1\n");
        let refusal = |result: Result<Option<OutFile>, Error>| result.unwrap_err().to_string();
        let dash = Path::new("-");
        assert!(!refusal(OutFile::open(dash, &[]).map(Some)).contains("--out"));
        assert!(refusal(OutFile::instead_of_stdout(Some(dash), &[])).contains("Omit --out"));
    }
}
