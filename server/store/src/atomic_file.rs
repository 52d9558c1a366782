//! Files that get their final name only when they are complete and on the disk. Until then they are hidden.

use std::fs::{File, OpenOptions};
use std::io;
use std::path::{Path, PathBuf};

/// Suffix of an incomplete file.
const PART: &str = ".copying";
/// SQLite's companion files.
const COMPANIONS: [&str; 3] = ["-journal", "-wal", "-shm"];

/// An incomplete file. Dropping it deletes the file.
#[derive(Debug)]
pub(crate) struct WholeFile {
    part: PathBuf,
    file: File,
    kept: bool,
}

impl WholeFile {
    /// Creates an empty hidden file next to `target`, readable by its owner only. Its name starts with `family`, whatever
    /// the target, so that the next one of the family deletes it if this process is killed.
    pub(crate) fn begin(target: &Path, family: &str) -> io::Result<Self> {
        let folder = folder_of(target);
        remove_left_over(folder, family);
        for number in 0_u32.. {
            let part = folder.join(format!(".{family}.{}-{number}{PART}", std::process::id()));
            match private().write(true).read(true).create_new(true).open(&part) {
                Ok(file) => {
                    // Locked while this process lives. Without file locks, leftovers must be deleted by hand.
                    let _ = file.try_lock();
                    return Ok(Self { part, file, kept: false });
                }
                Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {}
                Err(error) => return Err(error),
            }
        }
        Err(io::ErrorKind::AlreadyExists.into())
    }

    /// The hidden path.
    pub(crate) fn part(&self) -> &Path {
        &self.part
    }

    /// The file, for writing.
    pub(crate) fn file(&mut self) -> &mut File {
        &mut self.file
    }

    /// Gives the file its final name. If that name is taken, the existing file stays and this one is deleted.
    pub(crate) fn keep_as(mut self, target: &Path) -> io::Result<()> {
        self.file.sync_all()?;
        rename_to_new(&self.part, target)?;
        self.kept = true;
        sync_folder(target)
    }

    /// Gives the file its final name, and replaces an existing file.
    pub(crate) fn replace(mut self, target: &Path) -> io::Result<()> {
        self.file.sync_all()?;
        std::fs::rename(&self.part, target)?;
        self.kept = true;
        sync_folder(target)
    }
}

impl Drop for WholeFile {
    fn drop(&mut self) {
        if !self.kept {
            remove(&self.part);
        }
    }
}

/// Options for a file that only its owner can read.
pub(crate) fn private() -> OpenOptions {
    #[allow(unused_mut, reason = "only mutated on Unix")]
    let mut options = OpenOptions::new();
    #[cfg(unix)]
    std::os::unix::fs::OpenOptionsExt::mode(&mut options, 0o600);
    options
}

/// Syncs the folder of a file, so that its name is durable.
///
/// # Errors
/// Errors of the file system.
pub fn sync_folder(of: &Path) -> io::Result<()> {
    // On other systems folders cannot be opened, and names are durable with their files.
    if cfg!(unix) { File::open(folder_of(of))?.sync_all() } else { Ok(()) }
}

/// The folder that a file lies in.
pub(crate) fn folder_of(file: &Path) -> &Path {
    file.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or_else(|| Path::new("."))
}

fn remove_left_over(folder: &Path, family: &str) {
    let start = format!(".{family}");
    for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
        let name = entry.file_name();
        let Some(name) = name.to_str().filter(|name| name.starts_with(&start)) else { continue };
        let name = COMPANIONS.iter().find_map(|ending| name.strip_suffix(ending)).unwrap_or(name);
        let part = folder.join(name);
        // A companion file without its part is a leftover.
        if name.ends_with(PART) && File::open(&part).map_or(true, |part| part.try_lock().is_ok()) {
            remove(&part);
        }
    }
}

/// Deletes a part and its companions. A failure is handled as a leftover later.
fn remove(part: &Path) {
    for ending in std::iter::once("").chain(COMPANIONS) {
        let mut name = part.as_os_str().to_owned();
        name.push(ending);
        let _ = std::fs::remove_file(name);
    }
}

fn rename_to_new(part: &Path, target: &Path) -> io::Result<()> {
    #[cfg(target_os = "linux")]
    {
        use rustix::fs::{CWD, RenameFlags, renameat_with};
        use rustix::io::Errno;
        match renameat_with(CWD, part, CWD, target, RenameFlags::NOREPLACE) {
            // Some file systems do not support this.
            Err(Errno::INVAL | Errno::NOSYS) => {}
            done => return Ok(done?),
        }
    }
    if target.exists() {
        return Err(io::ErrorKind::AlreadyExists.into());
    }
    std::fs::rename(part, target)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Write;

    fn names(folder: &Path) -> Vec<String> {
        let names = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap());
        let mut names: Vec<String> = names.collect();
        names.sort();
        names
    }

    #[test]
    fn file_gets_its_name_only_when_kept_and_never_replaces_another() {
        let folder = tempfile::tempdir().unwrap();
        let target = folder.path().join("a.db.backup-1");
        let mut first = WholeFile::begin(&target, "a.db").unwrap();
        first.file().write_all(b"whole").unwrap();
        assert!(!target.exists());
        let second = WholeFile::begin(&target, "a.db").unwrap();
        first.keep_as(&target).unwrap();
        assert!(second.keep_as(&target).is_err());
        assert_eq!(std::fs::read(&target).unwrap(), b"whole");
        drop(WholeFile::begin(&target, "a.db").unwrap());
        assert_eq!(names(folder.path()), ["a.db.backup-1"]);
        #[cfg(unix)]
        {
            use std::os::unix::fs::PermissionsExt;
            assert_eq!(std::fs::metadata(&target).unwrap().permissions().mode() & 0o777, 0o600);
        }
    }

    #[test]
    fn leftover_is_deleted_by_a_next_copy_with_another_name() {
        let folder = tempfile::tempdir().unwrap();
        let killed = WholeFile::begin(&folder.path().join("copy1.db"), "a.db").unwrap();
        let name = killed.part().to_owned();
        let bytes = std::fs::read(&name).unwrap();
        drop(killed);
        std::fs::write(&name, bytes).unwrap();
        drop(WholeFile::begin(&folder.path().join("copy2.db"), "a.db").unwrap());
        assert_eq!(names(folder.path()), [""; 0]);
    }

    #[test]
    fn leftovers_of_killed_processes_are_deleted_but_not_files_in_use() {
        let folder = tempfile::tempdir().unwrap();
        let target = folder.path().join("a.db.backup-2");
        std::fs::write(folder.path().join(".a.db.backup-1.77-0.copying"), "half").unwrap();
        std::fs::write(folder.path().join(".a.db.backup-0.77-0.copying-journal"), "half").unwrap();
        std::fs::write(folder.path().join(".b.csv.77-0.copying"), "of another family").unwrap();
        let at_work = WholeFile::begin(&target, "a.db").unwrap();
        let other = WholeFile::begin(&target, "a.db").unwrap();
        assert!(at_work.part().exists() && other.part().exists() && names(folder.path()).len() == 3);
        drop((at_work, other));
        assert_eq!(names(folder.path()), [".b.csv.77-0.copying"]);
    }
}
