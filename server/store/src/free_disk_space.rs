//! Free space on the disk of the record. Below a reserve, nothing large is started, so that answers of people still
//! fit.

use super::{StoreError, StoreResult};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

/// Default reserve.
pub const DEFAULT_RESERVE_BYTES: u64 = 500_000_000;
/// An ordinary change takes less.
const ONE_CHANGE_BYTES: u64 = 1_000_000;

/// The disk of the record.
#[derive(Debug)]
pub(super) struct Space {
    folder: PathBuf,
    reserve: AtomicU64,
}

impl Space {
    pub(super) fn of(file: &Path) -> Self {
        let folder = file.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
        Self { folder: folder.to_owned(), reserve: AtomicU64::new(DEFAULT_RESERVE_BYTES) }
    }

    pub(super) fn set_reserve(&self, bytes: u64) {
        self.reserve.store(bytes, Ordering::Relaxed);
    }

    /// Free bytes for this process, if the system reports them.
    pub(super) fn free_bytes(&self) -> Option<u64> {
        free_bytes(&self.folder)
    }

    /// Fails if less space is free than the reserve.
    pub(super) fn check_free_space(&self) -> StoreResult<()> {
        self.check_free_space_for(0)
    }

    /// Refuses if less than the reserve would be free after writing this number of bytes.
    pub(super) fn check_free_space_for(&self, bytes: u64) -> StoreResult<()> {
        let reserve = self.reserve.load(Ordering::Relaxed).max(ONE_CHANGE_BYTES);
        match self.free_bytes() {
            Some(free) if free < reserve.saturating_add(bytes) => {
                Err(StoreError::NearlyFull { free_mb: free / 1_000_000, reserve_mb: reserve / 1_000_000 })
            }
            _ => Ok(()),
        }
    }

    /// Whether a change fits. The write-ahead log has room for small writes when the disk has none for an ordinary one.
    pub(super) fn has_room_for_change(&self) -> bool {
        can_allocate(&self.folder, ONE_CHANGE_BYTES)
    }

    /// Whether a file would lie on the disk of the record.
    pub(super) fn holds(&self, file: &Path) -> bool {
        let own = Self::of(file);
        match (device(&self.folder), device(&own.folder)) {
            (Some(here), Some(there)) => here == there,
            _ => true,
        }
    }
}

/// Free bytes for this process, if the system reports them.
#[cfg(target_os = "linux")]
pub fn free_bytes(folder: &Path) -> Option<u64> {
    let found = rustix::fs::statvfs(folder).ok()?;
    Some(found.f_bavail.saturating_mul(found.f_frsize))
}

/// Free bytes for this process, if the system reports them.
#[cfg(not(target_os = "linux"))]
pub fn free_bytes(_: &Path) -> Option<u64> {
    None
}

/// Reserves space in a file without a name, so that quotas count as well as the size of the disk.
#[cfg(target_os = "linux")]
fn can_allocate(folder: &Path, bytes: u64) -> bool {
    use rustix::fs::{FallocateFlags, Mode, OFlags, fallocate, open};
    use rustix::io::Errno;
    let nameless = OFlags::TMPFILE | OFlags::WRONLY | OFlags::CLOEXEC;
    let allocated = open(folder, nameless, Mode::RUSR | Mode::WUSR)
        .and_then(|file| fallocate(&file, FallocateFlags::empty(), 0, bytes));
    // Without O_TMPFILE, assume that there is space.
    !matches!(allocated, Err(Errno::NOSPC | Errno::DQUOT))
}

#[cfg(not(target_os = "linux"))]
fn can_allocate(_: &Path, _: u64) -> bool {
    true
}

#[cfg(unix)]
fn device(folder: &Path) -> Option<u64> {
    use std::os::unix::fs::MetadataExt;
    std::fs::metadata(folder).ok().map(|about| about.dev())
}

#[cfg(not(unix))]
fn device(_: &Path) -> Option<u64> {
    None
}
