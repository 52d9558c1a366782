//! Free space on the disk of the record. Below a reserve, nothing large is started, so that answers of people still
//! fit.

use super::{StoreError, StoreResult};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

/// Default reserve.
pub const DEFAULT_RESERVE_BYTES: u64 = 500 << 20;

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

    /// Fails if less space is free than the reserve.
    pub(super) fn room(&self) -> StoreResult<()> {
        let reserve = self.reserve.load(Ordering::Relaxed);
        match free_bytes(&self.folder) {
            Some(free) if free < reserve => {
                Err(StoreError::NearlyFull { free_mb: free >> 20, reserve_mb: reserve >> 20 })
            }
            _ => Ok(()),
        }
    }
}

/// Free bytes for this process, if the system reports them.
#[cfg(target_os = "linux")]
fn free_bytes(folder: &Path) -> Option<u64> {
    let found = rustix::fs::statvfs(folder).ok()?;
    Some(found.f_bavail.saturating_mul(found.f_frsize))
}

/// Free bytes for this process, if the system reports them.
#[cfg(not(target_os = "linux"))]
fn free_bytes(_: &Path) -> Option<u64> {
    None
}
