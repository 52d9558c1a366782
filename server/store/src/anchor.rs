//! Anchors: files outside the database that hold the newest hashes of its chains. A record that lost its end, or was put
//! back to an earlier state, still has whole chains; its anchor tells.
//!
//! An anchor is written after the change is on the disk and before it is acknowledged, without waiting for the disk again:
//! it never runs ahead of the record. Two places are written in turn, so that one is whole whenever the power fails.

use super::audit::ORIGIN;
use super::files::FileId;
use super::whole_file::WholeFile;
use super::{Connection, Instant, StoreError, StoreResult, beside, json, now};
use serde::{Deserialize, Serialize};
use sqlx::{AssertSqlSafe, Row};
use std::fs::{File, OpenOptions};
use std::io::{self, ErrorKind, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

/// Length of one of the two places: what a disk writes at once.
const PLACE_BYTES: usize = 512;

/// The end of a chain.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct End {
    /// Number of its last row; 0: it has none.
    pub seq: i64,
    /// Hash of that row.
    pub hash: String,
}

/// The ends of the chains of a record.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Ends {
    /// Of the audit trail.
    pub audit: End,
    /// Of the seals.
    pub seals: End,
}

/// What stands in one of the two places.
#[derive(Debug, Clone, Serialize, Deserialize)]
struct Place {
    /// Counts the writes: the place with the larger number counts.
    turn: u64,
    at: Instant,
    #[serde(flatten)]
    ends: Ends,
    /// Of the rest: a place that was written in part is none.
    sha256: String,
}

impl Place {
    fn new(turn: u64, ends: Ends) -> StoreResult<Self> {
        let whole = Self { turn, at: now(), ends, sha256: String::new() };
        Ok(Self { sha256: whole.digest()?, ..whole })
    }

    fn digest(&self) -> StoreResult<String> {
        let Ends { audit, seals } = &self.ends;
        let parts = (self.turn, self.at.to_string(), audit.seq, &audit.hash, seals.seq, &seals.hash);
        Ok(json::sha256(json::to_text("anchor", &parts)?.as_bytes()))
    }

    /// As it stands in the file: a line, filled up with spaces.
    fn bytes(&self) -> StoreResult<Vec<u8>> {
        let mut bytes = json::to_text("anchor", self)?.into_bytes();
        bytes.resize(PLACE_BYTES - 1, b' ');
        bytes.push(b'\n');
        Ok(bytes)
    }

    /// The newer of those in a file that are whole.
    fn newest(file: &[u8]) -> Option<Self> {
        let read = |place: &[u8]| serde_json::from_slice::<Self>(place.trim_ascii()).ok();
        let whole = |place: &Self| place.digest().is_ok_and(|digest| digest == place.sha256);
        file.chunks(PLACE_BYTES).filter_map(read).filter(whole).max_by_key(|place| place.turn)
    }
}

/// The anchor beside a record.
pub fn beside_record(record: &Path) -> PathBuf {
    beside(record, ".anchor")
}

/// What the chains of an open record end with.
pub(super) async fn ends(db: &mut Connection) -> StoreResult<Ends> {
    let sql = "select (select seq from audit order by seq desc limit 1), (select hash from audit order by seq desc limit 1), \
               (select seq from seals order by seq desc limit 1), (select hash from seals order by seq desc limit 1)";
    let row = sqlx::query(sql).fetch_one(db).await?;
    let end = |first: usize| {
        let (seq, hash): (Option<i64>, Option<String>) = (row.try_get(first)?, row.try_get(first + 1)?);
        Ok::<_, StoreError>(End { seq: seq.unwrap_or(0), hash: hash.unwrap_or_else(|| ORIGIN.to_owned()) })
    };
    Ok(Ends { audit: end(0)?, seals: end(2)? })
}

/// What an anchor holds; `None`: there is no such file.
///
/// # Errors
/// [`StoreError::Open`], and [`StoreError::Damaged`] when neither place is whole.
pub fn read(anchor: &Path) -> StoreResult<Option<Ends>> {
    let bytes = match std::fs::read(anchor) {
        Err(error) if error.kind() == ErrorKind::NotFound => return Ok(None),
        other => other.map_err(|source| StoreError::Open { path: anchor.to_owned(), source })?,
    };
    let reason = || format!("{} cannot be read; remove it if you know why", anchor.display());
    let place = Place::newest(&bytes).ok_or_else(|| StoreError::Damaged { what: "anchor", reason: reason() })?;
    Ok(Some(place.ends))
}

/// Compares a record with an anchor: the chains hold what the anchor saw, and perhaps more. What the anchor saw, when
/// there is one.
///
/// # Errors
/// [`StoreError::CutOff`], [`StoreError::Rewritten`], those of [`read`], or what the database reports.
pub async fn check(db: &mut Connection, record: &Path, anchor: &Path) -> StoreResult<Option<Ends>> {
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

/// Whether an anchor has seen a row of the record.
pub(super) fn has_seen_rows(anchor: &Path) -> StoreResult<bool> {
    Ok(read(anchor)?.is_some_and(|ends| ends.audit.seq > 0 || ends.seals.seq > 0))
}

/// Writes an anchor anew, durably.
pub(super) fn put(anchor: &Path, ends: &Ends) -> StoreResult<()> {
    let place = Place::new(1, ends.clone())?.bytes()?;
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
    /// The file and what it is; `None`: it is made with the next write.
    file: Option<(File, FileId)>,
    turn: u64,
    written: Option<Ends>,
    /// The last write failed, and that was logged.
    failing: bool,
}

impl Anchors {
    /// Those at these places; they are made with the first write.
    pub(super) fn at(places: Vec<PathBuf>) -> Self {
        let anchor = |path| Anchor { path, file: None, turn: 0, written: None, failing: false };
        Self(Mutex::new(places.into_iter().map(anchor).collect()))
    }

    /// Writes what the chains end with. A place that cannot be written holds less than the record then, which is
    /// logged and is no reason to refuse a change.
    pub(super) fn write(&self, ends: &Ends) {
        for anchor in self.0.lock().unwrap_or_else(PoisonError::into_inner).iter_mut() {
            if anchor.written.as_ref() == Some(ends) {
                continue;
            }
            match anchor.write(ends) {
                Ok(()) => (anchor.written, anchor.failing) = (Some(ends.clone()), false),
                Err(error) => {
                    if !anchor.failing {
                        tracing::error!(anchor = %anchor.path.display(), %error, "the anchor cannot be written");
                    }
                    (anchor.file, anchor.failing) = (None, true);
                }
            }
        }
    }

    /// Waits until the disk has them.
    pub(super) fn sync(&self) {
        for anchor in self.0.lock().unwrap_or_else(PoisonError::into_inner).iter() {
            if let Some((file, _)) = &anchor.file
                && let Err(error) = file.sync_data()
            {
                tracing::warn!(anchor = %anchor.path.display(), %error, "the anchor cannot be made durable");
            }
        }
    }
}

impl Anchor {
    fn write(&mut self, ends: &Ends) -> StoreResult<()> {
        let cannot = |source| StoreError::Open { path: self.path.clone(), source };
        self.turn += 1;
        let place = Place::new(self.turn, ends.clone())?.bytes()?;
        let there = std::fs::metadata(&self.path).ok().map(|file| FileId::of(&file));
        if let Some((file, id)) = &mut self.file
            && there == Some(*id)
        {
            let offset = (self.turn % 2) * PLACE_BYTES as u64;
            return file.seek(SeekFrom::Start(offset)).and_then(|_| file.write_all(&place)).map_err(cannot);
        }
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

    fn ends(seq: i64) -> Ends {
        let end = || End { seq, hash: ORIGIN.to_owned() };
        Ends { audit: end(), seals: end() }
    }

    #[test]
    fn a_place_that_was_written_in_part_leaves_the_one_before() {
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
    fn a_deleted_anchor_is_made_anew_with_the_next_change() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.db.anchor");
        let anchors = Anchors::at(vec![path.clone(), folder.path().join("no folder/b.anchor")]);
        anchors.write(&ends(1));
        std::fs::remove_file(&path).unwrap();
        anchors.write(&ends(2));
        assert_eq!(read(&path).unwrap(), Some(ends(2)));
    }
}
