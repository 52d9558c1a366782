//! The file format of archives: a line with the name of the format, then zstd-compressed lines of JSON. Each line has a
//! row, its table and its hash; the last line has the hash over all rows and the signature.
//!
//! Reading an archive needs memory for one line only.

use super::signature::{PublicKey, SigningKey};
use crate::error::Error;
use gaitwright_store::archived_row::{MAX_BLOB_BYTES, MAX_TEXT_BYTES, Row};
use gaitwright_store::archived_rows::table;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use std::io::{BufRead, BufReader, Read, Write};

/// Name and version of the format.
const FORMAT: &str = "gaitwright study 5";
/// zstd level.
const COMPRESSION: i32 = 3;
/// Largest accepted zstd window, as a power of two. The level above needs 2 MiB.
const WINDOW_LOG: u32 = 23;
/// Largest accepted line. Bytes are written as two hexadecimal digits.
const MAX_LINE_BYTES: usize = 2 * MAX_BLOB_BYTES + MAX_TEXT_BYTES;
/// Largest accepted archive, uncompressed.
const MAX_BYTES: u64 = 16 << 30;
/// Maximum number of trials.
const MAX_TRIALS: u64 = 10_000;
/// Maximum length of the reason of a refusal, characters.
const MAX_REASON: usize = 500;
/// Maximum number of rows of any other table.
const MAX_ROWS: u64 = 200_000;

#[derive(Serialize)]
struct RowLine<'a> {
    table: &'a str,
    sha256: &'a str,
    row: &'a Row,
}

#[derive(Serialize)]
struct EndLine<'a> {
    end: &'a LastLine,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ArchiveLine {
    table: Option<String>,
    sha256: Option<String>,
    row: Option<Row>,
    end: Option<LastLine>,
}

/// The last line.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct LastLine {
    /// Number of rows.
    rows: u64,
    /// SHA-256 over the lines of all rows.
    sha256: String,
    /// Public key of the signature.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    signed_by: Option<String>,
    /// Signature of the format and the hash.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    signature: Option<String>,
}

/// The signed message.
fn message(sha256: &str) -> String {
    format!("{FORMAT}\n{sha256}")
}

/// Writes an archive.
pub(super) struct Packer<W: Write> {
    out: zstd::Encoder<'static, W>,
    hash: Sha256,
    rows: u64,
}

impl<W: Write> Packer<W> {
    pub(super) fn new(mut out: W) -> std::io::Result<Self> {
        writeln!(out, "{FORMAT}")?;
        Ok(Self { out: zstd::Encoder::new(out, COMPRESSION)?, hash: Sha256::new(), rows: 0 })
    }

    /// Adds a row.
    pub(super) fn add(&mut self, table: &str, row: &Row) -> std::io::Result<()> {
        let mut line = serde_json::to_vec(&RowLine { table, sha256: &row.sha256(), row })?;
        line.push(b'\n');
        if line.len() > MAX_LINE_BYTES {
            return Err(std::io::Error::other(format!("a row of {table} is too large for an archive")));
        }
        self.hash.update(&line);
        self.rows += 1;
        self.out.write_all(&line)
    }

    /// Writes the end line.
    pub(super) fn finish(self, key: Option<&SigningKey>) -> std::io::Result<W> {
        let Self { mut out, hash, rows } = self;
        let sha256 = hex::encode(hash.finalize());
        let signature = key.map(|key| key.sign(&message(&sha256)));
        let end = LastLine { rows, sha256, signed_by: key.map(|key| key.public().to_string()), signature };
        serde_json::to_writer(&mut out, &EndLine { end: &end })?;
        out.write_all(b"\n")?;
        let mut out = out.finish()?;
        out.flush()?;
        Ok(out)
    }
}

/// A reader that hashes its bytes.
struct Hashed<R> {
    from: R,
    hash: Sha256,
}

impl<R: Read> Read for Hashed<R> {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        let count = self.from.read(buffer)?;
        self.hash.update(buffer.get(..count).unwrap_or_default());
        Ok(count)
    }
}

type HashedReader<R> = BufReader<Hashed<R>>;

/// Facts about a completely read archive.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ArchiveFacts {
    /// SHA-256 of the file.
    pub file_sha256: String,
    /// Public key of the signer. The signature was checked.
    pub signed_by: Option<PublicKey>,
    /// Number of rows.
    pub rows: u64,
}

/// Reads an archive row by row.
pub(super) struct Unpacker<R: Read> {
    lines: BufReader<zstd::Decoder<'static, HashedReader<R>>>,
    hash: Sha256,
    bytes: u64,
    rows: u64,
    /// Number of rows of the current table so far.
    of_table: u64,
    place: usize,
}

/// The error for an archive that is refused.
pub(super) fn refuse(reason: impl std::fmt::Display) -> Error {
    // The reason may quote a row, which can have any length.
    let reason: String = reason.to_string().trim_end_matches('.').chars().take(MAX_REASON).collect();
    Error::Malformed(format!("The archive was refused and nothing was changed: {reason}."))
}

/// The next part of an archive.
pub(super) enum Next {
    Row(&'static str, Row),
    End(ArchiveFacts),
}

impl<R: Read> Unpacker<R> {
    pub(super) fn new(from: R) -> Result<Self, Error> {
        let mut source = BufReader::new(Hashed { from, hash: Sha256::new() });
        let mut first = Vec::new();
        (&mut source).take(64).read_until(b'\n', &mut first).map_err(refuse)?;
        let first = String::from_utf8_lossy(&first);
        if first.trim_end_matches('\n') != FORMAT || !first.ends_with('\n') {
            let older = first.contains("gaitwright study ");
            let hint = if older { ". Export the study again with this version" } else { "" };
            let shown: String = first.chars().take(40).collect();
            return Err(refuse(format!("it starts with {shown:?} instead of {FORMAT:?}{hint}")));
        }
        let mut decoder = zstd::Decoder::with_buffer(source).map_err(refuse)?;
        decoder.window_log_max(WINDOW_LOG).map_err(refuse)?;
        let lines = BufReader::with_capacity(1 << 16, decoder);
        Ok(Self { lines, hash: Sha256::new(), bytes: 0, rows: 0, of_table: 0, place: 0 })
    }

    pub(super) fn next(&mut self) -> Result<Next, Error> {
        let mut text = Vec::new();
        let most = MAX_LINE_BYTES as u64 + 1;
        (&mut self.lines).take(most).read_until(b'\n', &mut text).map_err(refuse)?;
        self.bytes += text.len() as u64;
        let row = self.rows + 1;
        if text.len() > MAX_LINE_BYTES {
            return Err(refuse(format!("row {row} is larger than {MAX_LINE_BYTES} bytes")));
        }
        if self.bytes > MAX_BYTES {
            return Err(refuse(format!("it expands to more than {MAX_BYTES} bytes")));
        }
        if text.pop() != Some(b'\n') {
            return Err(refuse("it is truncated"));
        }
        let line: ArchiveLine = serde_json::from_slice(&text).map_err(|error| {
            let message = error.to_string();
            // The position is that within the row.
            refuse(format!("row {row}: {}", message.split(" at line ").next().unwrap_or(&message)))
        })?;
        match line {
            ArchiveLine { table: Some(name), sha256: Some(sha256), row: Some(found), end: None } => {
                self.hash.update(&text);
                self.hash.update(b"\n");
                self.rows = row;
                drop(text);
                let Some((place, table)) = table(&name) else {
                    return Err(refuse(format!(
                        "row {row} belongs to the table {name:?}, which is not part of an archive"
                    )));
                };
                if place < self.place {
                    return Err(refuse(format!("row {row} belongs to table {table}, which must come earlier")));
                }
                self.of_table = if place == self.place { self.of_table + 1 } else { 1 };
                self.place = place;
                let most = if table == "trials" { MAX_TRIALS } else { MAX_ROWS };
                if self.of_table > most {
                    return Err(refuse(format!("it has more than {most} rows of table {table}")));
                }
                if found.sha256() != sha256 {
                    return Err(refuse(format!("row {row} (table {table}) does not match its hash")));
                }
                Ok(Next::Row(table, found))
            }
            ArchiveLine { table: None, sha256: None, row: None, end: Some(end) } => self.end(&end).map(Next::End),
            _ => Err(refuse(format!("line {row} is neither a row nor the end line"))),
        }
    }

    fn end(&mut self, end: &LastLine) -> Result<ArchiveFacts, Error> {
        let sha256 = hex::encode(std::mem::take(&mut self.hash).finalize());
        if end.rows != self.rows || end.sha256 != sha256 {
            return Err(refuse("its rows were changed: they do not match the hash at its end"));
        }
        if self.lines.read(&mut [0]).map_err(refuse)? != 0 {
            return Err(refuse("it has data after its end"));
        }
        let signed_by = match (&end.signed_by, &end.signature) {
            (None, None) => None,
            (Some(key), Some(signature)) => {
                let malformed = |_| refuse(format!("its public key {key:?} does not have 64 hexadecimal digits"));
                let key: PublicKey = key.parse().map_err(malformed)?;
                if !key.signed(&message(&sha256), signature) {
                    return Err(refuse(format!("its signature was not made with the key {key} that it names")));
                }
                Some(key)
            }
            _ => return Err(refuse("its signature is incomplete")),
        };
        let hashed = std::mem::take(&mut self.lines.get_mut().get_mut().get_mut().hash);
        Ok(ArchiveFacts { file_sha256: hex::encode(hashed.finalize()), signed_by, rows: self.rows })
    }
}

/// Reads an archive to its end, and checks its format, hashes and signature.
///
/// # Errors
/// [`Error::Malformed`] with the reason.
pub fn read_through(from: impl Read) -> Result<ArchiveFacts, Error> {
    let mut unpacker = Unpacker::new(from)?;
    loop {
        if let Next::End(whole) = unpacker.next()? {
            return Ok(whole);
        }
    }
}
