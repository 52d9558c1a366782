//! Replaces a record with a backup. The old record may be damaged or of a newer version, so it is never opened.
//!
//! The backup takes the name of the record in one step, but the log and the anchor of the old record must go as well. A
//! marker beside the record notes this, so that the next owner finishes or undoes the restore of a killed process
//! (`interrupted_restore`).

use super::atomic_file::WholeFile;
use super::interrupted_restore::{COMPANIONS, Marker, RestoreStep, finish, finish_interrupted, hash_of, mark};
use super::record_file_names::free_name;
use super::record_file_names::path_with_suffix;
use super::record_lock::RecordLock;
use super::verified_copy::{self, whole_copy};
use super::{StoreError, StoreResult, anchor, read_only};
use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};

/// Replaces a record with a backup, and updates the anchors to it. Returns where the old record is kept.
///
/// # Errors
/// [`StoreError::InUse`] while a process owns the record, errors of [`read_only::check`] for the backup,
/// [`StoreError::Unverified`], [`StoreError::WrongAnchor`], or a file that cannot be written. The record is unchanged
/// then, or the next start finishes the restore.
pub async fn from_file(from: &Path, to: &Path, elsewhere: Option<&Path>) -> StoreResult<Option<PathBuf>> {
    replace(from, to, elsewhere, &|_| {}).await
}

async fn replace(
    from: &Path,
    to: &Path,
    elsewhere: Option<&Path>,
    reached: &(dyn Fn(RestoreStep) + Sync),
) -> StoreResult<Option<PathBuf>> {
    anchor::refuse_wrong(elsewhere, to, Some(from))?;
    read_only::check(from).await?;
    let _lock = RecordLock::take(to)?;
    finish_interrupted(to)?;
    let cannot_write = |source| StoreError::Open { path: to.to_owned(), source };
    // Copy through SQLite, because part of the backup may be in its log.
    let pool = read_only::open(from).await?;
    let copied = async {
        let ends = anchor::ends(&mut *pool.acquire().await?).await?;
        Ok::<_, StoreError>((ends, whole_copy(&pool, from, to, to).await?))
    };
    let copied = copied.await;
    pool.close().await;
    let (ends, copy) = copied?;
    let kept = to.exists().then(|| free_name(to, "before"));
    if let Some(kept) = &kept {
        keep(to, kept).map_err(|error| verified_copy::cannot_write(kept, error))?;
        like(to, copy.part());
    }
    reached(RestoreStep::OldRecordKept);
    let sha256 = hash_of(copy.part()).map_err(cannot_write)?;
    let elsewhere = elsewhere.map(std::path::absolute).transpose().map_err(cannot_write)?;
    let marker = Marker { sha256, ends, elsewhere };
    mark(to, &marker)?;
    reached(RestoreStep::Marked);
    if let Err(error) = copy.replace(to) {
        finish_interrupted(to)?;
        return Err(cannot_write(error));
    }
    reached(RestoreStep::Renamed);
    finish(to, &marker, reached)?;
    Ok(kept)
}

/// Copies the old record with its log and its anchor.
fn keep(to: &Path, kept: &Path) -> io::Result<()> {
    let family = to.file_name().unwrap_or_default().to_string_lossy();
    for ending in ["", COMPANIONS[0], ".anchor"] {
        let present = path_with_suffix(to, ending);
        if present.exists() {
            let target = path_with_suffix(kept, ending);
            let mut whole = WholeFile::begin(&target, &family)?;
            io::copy(&mut File::open(&present)?, whole.file())?;
            whole.keep_as(&target)?;
        }
    }
    Ok(())
}

/// Gives the backup the owner and the permissions of the old record.
fn like(present: &Path, copy: &Path) {
    #[cfg(unix)]
    if let Ok(about) = std::fs::metadata(present) {
        use std::os::unix::fs::MetadataExt;
        // Only root can change the owner. Otherwise the file keeps its current owner.
        let _ = std::os::unix::fs::chown(copy, Some(about.uid()), Some(about.gid()));
    }
    #[cfg(not(unix))]
    let _ = (present, copy);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Store, backup, commit, verify};
    use std::process::Command;

    /// Step, backup and record of the process that is killed.
    const VARIABLE: &str = "GAITWRIGHT_TEST_KILLED_RESTORE";
    const STEPS: [RestoreStep; 5] = [
        RestoreStep::OldRecordKept,
        RestoreStep::Marked,
        RestoreStep::Renamed,
        RestoreStep::LogRemoved,
        RestoreStep::Anchored,
    ];

    async fn add(store: &Store, name: &str) {
        let sql = "insert into subjects (id, pseudonym, height_m, body_mass_kg, created_at) values (?, ?, 1.8, 70, '')";
        let mut writer = store.write().await.unwrap();
        sqlx::query(sql).bind(name).bind(name).execute(&mut **writer).await.unwrap();
        commit(writer).await.unwrap();
    }

    async fn subjects(store: &Store) -> Vec<String> {
        let mut reader = store.read().await.unwrap();
        sqlx::query_scalar("select id from subjects order by id").fetch_all(&mut **reader).await.unwrap()
    }

    /// The process that [`killed_restore_is_finished_or_undone_and_loses_no_acknowledged_change`] starts.
    #[tokio::test]
    async fn restore_is_killed_at_a_step() {
        let Ok(text) = std::env::var(VARIABLE) else { return };
        let parts: Vec<&str> = text.split('|').collect();
        let die = |step: RestoreStep| {
            if format!("{step:?}") == parts[0] {
                std::process::abort();
            }
        };
        replace(Path::new(parts[1]), Path::new(parts[2]), Some(Path::new(parts[3])), &die).await.unwrap();
    }

    #[tokio::test]
    async fn killed_restore_is_finished_or_undone_and_loses_no_acknowledged_change() {
        for step in STEPS {
            let folder = tempfile::tempdir().unwrap();
            let path = |name: &str| folder.path().join(name);
            let (live, record, copy, elsewhere) =
                (path("live.db"), path("a.db"), path("copy.db"), path("elsewhere.anchor"));
            let store = Store::open(&live).await.unwrap();
            add(&store, "before").await;
            backup::of_store(&store, &copy).await.unwrap();
            add(&store, "after").await;
            // As a killed service leaves them: the last change is in the log.
            for ending in ["", "-wal", ".anchor"] {
                std::fs::copy(path_with_suffix(&live, ending), path_with_suffix(&record, ending)).unwrap();
            }
            std::fs::copy(anchor::path_of(&live), &elsewhere).unwrap();
            store.close().await;

            let [copy, record_text, second] = [&copy, &record, &elsewhere].map(|path| path.to_str().unwrap());
            let killed = Command::new(std::env::current_exe().unwrap())
                .args(["--exact", "restore::tests::restore_is_killed_at_a_step"])
                .env(VARIABLE, format!("{step:?}|{copy}|{record_text}|{second}"))
                .output()
                .unwrap();
            assert!(!killed.status.success(), "{step:?}: {killed:?}");

            let is_renamed = !matches!(step, RestoreStep::OldRecordKept | RestoreStep::Marked);
            if step != RestoreStep::OldRecordKept {
                let refused = verify::file(&record, &[]).await;
                assert!(matches!(refused, Err(StoreError::RestoreInterrupted { .. })), "{step:?}: {refused:?}");
            }
            let store = Store::open_anchored(&record, Some(&elsewhere)).await.unwrap();
            let expected: &[&str] = if is_renamed { &["before"] } else { &["after", "before"] };
            assert_eq!(subjects(&store).await, expected, "{step:?}");
            add(&store, "later").await;
            store.close().await;
            verify::file(&record, std::slice::from_ref(&elsewhere)).await.unwrap();

            // The record that was replaced is whole, with the change in its log.
            let names = std::fs::read_dir(folder.path()).unwrap().map(|entry| entry.unwrap().path());
            let kept = names.into_iter().find(|name| {
                let name = name.file_name().unwrap().to_str().unwrap();
                name.starts_with("a.db.before-") && !name.ends_with("-wal") && !name.ends_with(".anchor")
            });
            let store = Store::open(&kept.unwrap()).await.unwrap();
            assert_eq!(subjects(&store).await, ["after", "before"], "{step:?}");
            store.close().await;
        }
    }
}
