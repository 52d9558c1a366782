//! Verifies the write-ahead log after each commit, by the checksums of its frames.
//!
//! SQLite writes at the expected end of its log, so a log that was truncated during a commit has the expected length
//! afterwards, with a hole in it. SQLite itself compares the checksums only during recovery.

use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};
use std::path::Path;

const HEADER_BYTES: usize = 32;
const FRAME_HEADER_BYTES: usize = 24;
/// Magic number of a log with little-endian checksums. With the lowest bit set, they are big-endian.
const MAGIC: u32 = 0x377f_0682;

/// A cumulative checksum, in two halves.
type Sums = (u32, u32);

/// A log and the position up to which it was verified.
#[derive(Debug)]
pub(super) struct Log {
    file: File,
    read: Option<LogPosition>,
}

/// A position in a log.
#[derive(Debug, Clone, Copy)]
struct LogPosition {
    /// Salt of the header, which changes when SQLite restarts the log.
    salt: [u8; 8],
    /// Number of frames before the position.
    frames: u32,
    /// Checksum before the last of these frames, which is read again each time, because a hole ends where the next
    /// frames begin.
    before_last: Sums,
}

/// The header of a log.
#[derive(Debug)]
struct WalHeader {
    salt: [u8; 8],
    page_bytes: usize,
    big_endian: bool,
    sums: Sums,
}

impl Log {
    /// Opens a log.
    pub(super) fn open(path: &Path) -> io::Result<Self> {
        Ok(Self { file: File::open(path)?, read: None })
    }

    /// Verifies new frames, up to the given number of frames. Returns `false` if the log differs from what SQLite
    /// wrote.
    pub(super) fn is_whole(&mut self, frames: u32) -> io::Result<bool> {
        if frames == 0 {
            return Ok(true);
        }
        let Some(header) = self.header()? else { return Ok(false) };
        let from = self.read.filter(|read| read.salt == header.salt && read.frames <= frames);
        let (first, mut sums) = from.map_or((0, header.sums), |read| (read.frames.saturating_sub(1), read.before_last));
        let mut before_last = sums;
        let frame_bytes = FRAME_HEADER_BYTES + header.page_bytes;
        self.file.seek(SeekFrom::Start(HEADER_BYTES as u64 + u64::from(first) * frame_bytes as u64))?;
        let mut frame = vec![0; frame_bytes];
        for _ in first..frames {
            if !read_whole(&mut self.file, &mut frame)? {
                return Ok(false);
            }
            before_last = sums;
            match header.sums_after(sums, &frame) {
                Some(after) => sums = after,
                None => return Ok(false),
            }
        }
        self.read = Some(LogPosition { salt: header.salt, frames, before_last });
        Ok(true)
    }

    fn header(&mut self) -> io::Result<Option<WalHeader>> {
        self.file.seek(SeekFrom::Start(0))?;
        let mut bytes = [0; HEADER_BYTES];
        if !read_whole(&mut self.file, &mut bytes)? {
            return Ok(None);
        }
        let [magic, _, page_bytes, _, salt_1, salt_2, sum_1, sum_2] = words(&bytes, true)[..] else { return Ok(None) };
        if magic & !1 != MAGIC || !page_bytes.is_power_of_two() || page_bytes > 1 << 16 {
            return Ok(None);
        }
        let mut salt = [0; 8];
        salt[..4].copy_from_slice(&salt_1.to_be_bytes());
        salt[4..].copy_from_slice(&salt_2.to_be_bytes());
        let big_endian = magic & 1 == 1;
        let sums = (sum_1, sum_2);
        let is_whole = summed((0, 0), &bytes[..HEADER_BYTES - 8], big_endian) == sums;
        Ok(is_whole.then_some(WalHeader { salt, page_bytes: page_bytes as usize, big_endian, sums }))
    }
}

impl WalHeader {
    /// The checksum including this frame; `None` if the frame does not belong to the log or is damaged.
    fn sums_after(&self, before: Sums, frame: &[u8]) -> Option<Sums> {
        let (head, page) = frame.split_at_checked(FRAME_HEADER_BYTES)?;
        let sums = summed(summed(before, head.get(..8)?, self.big_endian), page, self.big_endian);
        let stored = words(head.get(16..)?, true);
        (head.get(8..16)? == self.salt && stored == [sums.0, sums.1]).then_some(sums)
    }
}

fn words(bytes: &[u8], big_endian: bool) -> Vec<u32> {
    let word = |four: &[u8; 4]| if big_endian { u32::from_be_bytes(*four) } else { u32::from_le_bytes(*four) };
    bytes.as_chunks().0.iter().map(word).collect()
}

/// The checksum of SQLite's file format.
fn summed((mut first, mut second): Sums, bytes: &[u8], big_endian: bool) -> Sums {
    let (pairs, _) = bytes.as_chunks::<8>();
    for &[a, b, c, d, e, f, g, h] in pairs {
        let word = |four| if big_endian { u32::from_be_bytes(four) } else { u32::from_le_bytes(four) };
        first = first.wrapping_add(word([a, b, c, d])).wrapping_add(second);
        second = second.wrapping_add(word([e, f, g, h])).wrapping_add(first);
    }
    (first, second)
}

/// Fills the buffer. Returns `false` if the file ends earlier.
fn read_whole(file: &mut File, buffer: &mut [u8]) -> io::Result<bool> {
    match file.read_exact(buffer) {
        Err(error) if error.kind() == io::ErrorKind::UnexpectedEof => Ok(false),
        done => done.map(|()| true),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sqlx::sqlite::{SqliteConnectOptions, SqliteJournalMode};
    use sqlx::{ConnectOptions, Row, SqliteConnection};

    async fn run(db: &mut SqliteConnection, sql: &'static str) {
        sqlx::query(sql).execute(db).await.unwrap();
    }

    async fn frames(db: &mut SqliteConnection) -> u32 {
        sqlx::query("pragma wal_checkpoint(noop)").fetch_one(db).await.unwrap().get("log")
    }

    #[tokio::test]
    async fn loss_of_any_byte_of_the_last_change_is_detected() {
        let folder = tempfile::tempdir().unwrap();
        let options = SqliteConnectOptions::new().filename(folder.path().join("a.db")).create_if_missing(true);
        let mut db = options.journal_mode(SqliteJournalMode::Wal).connect().await.unwrap();
        run(&mut db, "pragma wal_autocheckpoint = 0").await;
        run(&mut db, "create table t (x blob) strict").await;
        let path = folder.path().join("a.db-wal");
        let mut log = Log::open(&path).unwrap();
        let insert = "insert into t values (randomblob(9000))";
        for _ in 0..5 {
            run(&mut db, insert).await;
            assert!(log.is_whole(frames(&mut db).await).unwrap());
        }
        // The log restarts and is shorter than before.
        run(&mut db, "pragma wal_checkpoint(passive)").await;
        run(&mut db, insert).await;
        let count = frames(&mut db).await;
        assert!(count < 10 && log.is_whole(count).unwrap());
        let before = std::fs::read(&path).unwrap();
        run(&mut db, insert).await;
        let more = frames(&mut db).await;
        let after = std::fs::read(&path).unwrap();
        let whole = |bytes: &[u8]| {
            std::fs::write(&path, bytes).unwrap();
            let mut read = Log { file: File::open(&path).unwrap(), read: log.read };
            read.is_whole(more).unwrap()
        };
        assert!(whole(&after) && more > count);
        assert!(!whole(&before), "the change is not there");
        let end = |frames: u32| HEADER_BYTES + frames as usize * (FRAME_HEADER_BYTES + 4096);
        assert!(!whole(&after[..end(more) - 1]), "its end is lost");
        for hole in [end(count) - 1, end(count) - 4100, end(more) - 9000] {
            let mut holed = after.clone();
            holed[hole] = !after[hole];
            assert!(!whole(&holed), "{hole}");
        }
    }
}
