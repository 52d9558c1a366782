//! Anchors: files outside the database with the newest hashes of its chains. They detect a record whose newest rows are
//! missing, although its chains are intact.
//!
//! An anchor is written after a change is on the disk and before it is acknowledged, so it never runs ahead of the
//! record. Two places are written in turn, so that one is intact after a power failure.

use super::atomic_file::{WholeFile, folder_of};
use super::audit::ORIGIN;
use super::connection::Connection;
use super::error::{StoreError, StoreResult};
use super::json_columns;
use super::lost_files::FileId;
use super::record_file_names::path_with_suffix;
use super::time::{Instant, now};
use serde::{Deserialize, Serialize};
use sqlx::{AssertSqlSafe, Row};
use std::fs::{File, OpenOptions};
use std::io::{self, ErrorKind, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

/// Length of one of the two places: a disk sector.
const PLACE_BYTES: usize = 512;

/// The last row of a chain.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct ChainEnd {
    /// Sequence number; 0 for an empty chain.
    pub seq: i64,
    /// Hash of the row.
    pub hash: String,
}

/// The last rows of the chains of a record.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct ChainEnds {
    /// End of the chain of the audit trail.
    pub audit: ChainEnd,
    /// End of the chain of seals.
    pub seals: ChainEnd,
}

/// The content of one of the two places.
#[derive(Debug, Clone, Serialize, Deserialize)]
struct AnchorPlace {
    /// Number of the write. The place with the larger number applies.
    turn: u64,
    at: Instant,
    #[serde(flatten)]
    ends: ChainEnds,
    /// Hash of the rest, to detect a partial write.
    sha256: String,
}

impl AnchorPlace {
    fn new(turn: u64, ends: ChainEnds) -> StoreResult<Self> {
        let whole = Self { turn, at: now(), ends, sha256: String::new() };
        Ok(Self { sha256: whole.digest()?, ..whole })
    }

    fn digest(&self) -> StoreResult<String> {
        let ChainEnds { audit, seals } = &self.ends;
        let parts = (self.turn, self.at.to_string(), audit.seq, &audit.hash, seals.seq, &seals.hash);
        Ok(json_columns::sha256(json_columns::to_text("anchor", &parts)?.as_bytes()))
    }

    /// The bytes in the file: a line, padded with spaces.
    fn bytes(&self) -> StoreResult<Vec<u8>> {
        let mut bytes = json_columns::to_text("anchor", self)?.into_bytes();
        bytes.resize(PLACE_BYTES - 1, b' ');
        bytes.push(b'\n');
        Ok(bytes)
    }

    /// The newer of the intact places in a file.
    fn newest(file: &[u8]) -> Option<Self> {
        let read = |place: &[u8]| serde_json::from_slice::<Self>(place.trim_ascii()).ok();
        let whole = |place: &Self| place.digest().is_ok_and(|digest| digest == place.sha256);
        file.chunks(PLACE_BYTES).filter_map(read).filter(whole).max_by_key(|place| place.turn)
    }
}

/// The path of the anchor next to a record.
pub fn path_of(record: &Path) -> PathBuf {
    path_with_suffix(record, ".anchor")
}

/// Reads the last rows of the chains of an open record.
pub(super) async fn ends(db: &mut Connection) -> StoreResult<ChainEnds> {
    let sql = "select (select seq from audit order by seq desc limit 1), (select hash from audit order by seq desc limit 1), \
               (select seq from seals order by seq desc limit 1), (select hash from seals order by seq desc limit 1)";
    let row = sqlx::query(sql).fetch_one(db).await?;
    let end = |first: usize| {
        let (seq, hash): (Option<i64>, Option<String>) = (row.try_get(first)?, row.try_get(first + 1)?);
        Ok::<_, StoreError>(ChainEnd { seq: seq.unwrap_or(0), hash: hash.unwrap_or_else(|| ORIGIN.to_owned()) })
    };
    Ok(ChainEnds { audit: end(0)?, seals: end(2)? })
}

/// Reads an anchor; `None` if there is no such file.
///
/// # Errors
/// [`StoreError::Open`], and [`StoreError::Damaged`] if neither place is intact.
pub fn read(anchor: &Path) -> StoreResult<Option<ChainEnds>> {
    let bytes = match std::fs::read(anchor) {
        Err(error) if error.kind() == ErrorKind::NotFound => return Ok(None),
        other => other.map_err(|source| StoreError::Open { path: anchor.to_owned(), source })?,
    };
    let reason = || format!("{} cannot be read; remove it only if you know the cause", anchor.display());
    let place = AnchorPlace::newest(&bytes).ok_or_else(|| StoreError::Damaged { what: "anchor", reason: reason() })?;
    Ok(Some(place.ends))
}

/// Checks that the chains of a record contain the rows that an anchor lists. Returns these rows, if there is an anchor.
///
/// # Errors
/// [`StoreError::CutOff`], [`StoreError::Rewritten`], those of [`read`]; errors of the database.
pub async fn check(db: &mut Connection, record: &Path, anchor: &Path) -> StoreResult<Option<ChainEnds>> {
    let Some(ends) = read(anchor)? else { return Ok(None) };
    for (table, end) in [("audit", &ends.audit), ("seals", &ends.seals)] {
        if end.seq == 0 {
            continue;
        }
        let (record, anchor) = (record.to_owned(), anchor.to_owned());
        let row = AssertSqlSafe(format!("select hash from {table} where seq = ?"));
        let hash: Option<String> = sqlx::query_scalar(row).bind(end.seq).fetch_optional(&mut *db).await?;
        let last = AssertSqlSafe(format!("select coalesce(max(seq), 0) from {table}"));
        let found: i64 = sqlx::query_scalar(last).fetch_one(&mut *db).await?;
        if found < end.seq {
            return Err(StoreError::CutOff { record, anchor, table, found, seen: end.seq });
        }
        if hash.as_ref() != Some(&end.hash) {
            return Err(StoreError::Rewritten { record, anchor, table, seq: end.seq });
        }
    }
    Ok(Some(ends))
}

/// Whether an anchor lists any row.
pub(super) fn has_seen_rows(anchor: &Path) -> StoreResult<bool> {
    Ok(read(anchor)?.is_some_and(|ends| ends.audit.seq > 0 || ends.seals.seq > 0))
}

/// Endings of the files of a record.
const OWN_FILES: [&str; 7] = ["", "-wal", "-shm", ".lock", ".anchor", ".access", ".restoring"];

/// Refuses a second anchor whose folder does not exist, or that is another file: one of the record, one of the backup
/// that is being restored, or any file that is not an anchor.
pub(super) fn refuse_wrong(elsewhere: Option<&Path>, record: &Path, backup: Option<&Path>) -> StoreResult<()> {
    let Some(anchor) = elsewhere else { return Ok(()) };
    let folder = folder_of(anchor);
    if !folder.is_dir() {
        return Err(StoreError::NoAnchorFolder { folder: folder.to_owned(), anchor: anchor.to_owned() });
    }
    let wrong = |what| Err(StoreError::WrongAnchor { path: anchor.to_owned(), what });
    let place = resolved(anchor);
    let is_of = |file: &Path| OWN_FILES.iter().any(|ending| resolved(&path_with_suffix(file, ending)) == place);
    if is_of(record) {
        return wrong("a file of the record");
    }
    if backup.is_some_and(is_of) {
        return wrong("a file of the backup");
    }
    match read(anchor) {
        Err(StoreError::Damaged { .. }) => wrong("damaged, or not an anchor file"),
        Err(error) => Err(error),
        Ok(_) => Ok(()),
    }
}

/// The path without links, also of a file that does not exist yet.
fn resolved(path: &Path) -> PathBuf {
    let of_folder = || Some(folder_of(path).canonicalize().ok()?.join(path.file_name()?));
    path.canonicalize().ok().or_else(of_folder).unwrap_or_else(|| path.to_owned())
}

/// Replaces an anchor durably.
pub(super) fn put(anchor: &Path, ends: &ChainEnds) -> StoreResult<()> {
    let place = AnchorPlace::new(1, ends.clone())?.bytes()?;
    make(anchor, &place).map_err(|source| StoreError::Open { path: anchor.to_owned(), source })
}

fn make(anchor: &Path, place: &[u8]) -> io::Result<()> {
    let family = anchor.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let mut file = WholeFile::begin(anchor, &family)?;
    file.file().write_all(place)?;
    file.file().write_all(&[b' '; PLACE_BYTES])?;
    file.replace(anchor)
}

/// The anchors of an open record.
#[derive(Debug, Default)]
pub(super) struct Anchors(Mutex<Vec<Anchor>>);

#[derive(Debug)]
struct Anchor {
    path: PathBuf,
    /// The open file and its identity; `None` until the next write creates it.
    file: Option<(File, FileId)>,
    turn: u64,
    written: Option<ChainEnds>,
    /// Whether the last write failed, which was logged.
    failing: bool,
}

impl Anchors {
    /// Anchors at these paths. The first write creates them.
    pub(super) fn at(places: Vec<PathBuf>) -> Self {
        let anchor = |path| Anchor { path, file: None, turn: 0, written: None, failing: false };
        Self(Mutex::new(places.into_iter().map(anchor).collect()))
    }

    /// Writes the last rows of the chains. An anchor that cannot be written lags behind the record, which is logged and
    /// does not prevent changes.
    pub(super) fn write(&self, ends: &ChainEnds) {
        for anchor in self.0.lock().unwrap_or_else(PoisonError::into_inner).iter_mut() {
            if anchor.written.as_ref() == Some(ends) {
                continue;
            }
            match anchor.write(ends) {
                Ok(()) => (anchor.written, anchor.failing) = (Some(ends.clone()), false),
                Err(error) => {
                    if !anchor.failing {
                        tracing::error!(anchor = %anchor.path.display(), %error, "cannot write the anchor");
                    }
                    (anchor.file, anchor.failing) = (None, true);
                }
            }
        }
    }

    /// Syncs the anchors to the disk.
    pub(super) fn sync(&self) {
        for anchor in self.0.lock().unwrap_or_else(PoisonError::into_inner).iter() {
            if let Some((file, _)) = &anchor.file
                && let Err(error) = file.sync_data()
            {
                tracing::warn!(anchor = %anchor.path.display(), %error, "cannot sync the anchor");
            }
        }
    }
}

impl Anchor {
    fn write(&mut self, ends: &ChainEnds) -> StoreResult<()> {
        let cannot = |source| StoreError::Open { path: self.path.clone(), source };
        self.turn += 1;
        let place = AnchorPlace::new(self.turn, ends.clone())?.bytes()?;
        let there = std::fs::metadata(&self.path).ok().map(|file| FileId::of(&file));
        if let Some((file, id)) = &mut self.file
            && there == Some(*id)
        {
            let offset = (self.turn % 2) * PLACE_BYTES as u64;
            return file.seek(SeekFrom::Start(offset)).and_then(|_| file.write_all(&place)).map_err(cannot);
        }
        // A file that was put in its place is not overwritten, unless it is an anchor.
        read(&self.path)?;
        let made = make(&self.path, &place).and_then(|()| OpenOptions::new().write(true).open(&self.path));
        let opened = made.and_then(|file| Ok((FileId::of(&file.metadata()?), file)));
        let (id, file) = opened.map_err(cannot)?;
        self.file = Some((file, id));
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ends(seq: i64) -> ChainEnds {
        let end = || ChainEnd { seq, hash: ORIGIN.to_owned() };
        ChainEnds { audit: end(), seals: end() }
    }

    #[test]
    fn partial_write_leaves_the_previous_place_intact() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.db.anchor");
        assert_eq!(read(&path).unwrap(), None);
        let anchors = Anchors::at(vec![path.clone()]);
        for seq in 1..=5 {
            anchors.write(&ends(seq));
            assert_eq!(read(&path).unwrap(), Some(ends(seq)));
        }
        let whole = std::fs::read(&path).unwrap();
        let mut seen = Vec::new();
        for place in 0..2 {
            let mut torn = whole.clone();
            torn[place * PLACE_BYTES + 40] ^= 1;
            std::fs::write(&path, torn).unwrap();
            seen.push(read(&path).unwrap().unwrap().audit.seq);
        }
        seen.sort_unstable();
        assert_eq!(seen, [4, 5]);
        std::fs::write(&path, "").unwrap();
        assert!(read(&path).is_err());
    }

    #[test]
    fn deleted_anchor_is_recreated_with_the_next_change() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.db.anchor");
        let anchors = Anchors::at(vec![path.clone(), folder.path().join("no folder/b.anchor")]);
        anchors.write(&ends(1));
        std::fs::remove_file(&path).unwrap();
        anchors.write(&ends(2));
        assert_eq!(read(&path).unwrap(), Some(ends(2)));
    }
}
