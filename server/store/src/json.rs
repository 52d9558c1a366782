//! JSON and compressed JSON columns.

use super::{StoreError, StoreResult};
use gaitwright_compute::OnPool;
use serde::Serialize;
use serde::de::DeserializeOwned;
use sha2::{Digest, Sha256};
use sqlx::Row;
use sqlx::sqlite::SqliteRow;
use std::io::Read;

/// zstd level: past this, trajectories shrink little and slowly.
const COMPRESSION: i32 = 9;
/// Largest value that is compressed, and largest that a compressed value may expand to: twice the largest upload.
const LARGEST_BYTES: u64 = 32 << 20;
/// Largest window of a compressed value, as a power of two: what the level above needs, and room for others.
const WINDOW_LOG: u32 = 23;

pub(super) fn to_text<T: Serialize>(what: &'static str, value: &T) -> StoreResult<String> {
    serde_json::to_string(value).map_err(|e| StoreError::Damaged { what, reason: e.to_string() })
}

/// [`to_text`], or `None` where it could not be read back: JSON has no word for numbers that are not finite.
pub(super) fn readable<T: Serialize + DeserializeOwned>(what: &'static str, value: &T) -> StoreResult<Option<String>> {
    let text = to_text(what, value)?;
    Ok(serde_json::from_str::<T>(&text).is_ok().then_some(text))
}

pub(super) fn from_text<T: DeserializeOwned>(what: &'static str, text: &str) -> StoreResult<T> {
    serde_json::from_str(text).map_err(|e| StoreError::Damaged { what, reason: e.to_string() })
}

/// Reads a JSON column.
pub(super) fn column<T: DeserializeOwned>(row: &SqliteRow, name: &'static str) -> StoreResult<T> {
    from_text(name, row.try_get::<&str, _>(name)?)
}

/// Reads a JSON column that may be null.
pub(super) fn optional_column<T: DeserializeOwned>(row: &SqliteRow, name: &'static str) -> StoreResult<Option<T>> {
    row.try_get::<Option<&str>, _>(name)?.map(|text| from_text(name, text)).transpose()
}

pub(super) fn compress(_: &OnPool, what: &'static str, bytes: &[u8]) -> StoreResult<Vec<u8>> {
    if bytes.len() as u64 > LARGEST_BYTES {
        let reason = format!("{} bytes; at most {LARGEST_BYTES} are kept", bytes.len());
        return Err(StoreError::Damaged { what, reason });
    }
    zstd::encode_all(bytes, COMPRESSION).map_err(|e| StoreError::Damaged { what, reason: e.to_string() })
}

/// What a compressed value holds, of which there is never more than [`LARGEST_BYTES`], however little it takes compressed.
pub(super) fn decompress(_: &OnPool, what: &'static str, bytes: &[u8]) -> StoreResult<Vec<u8>> {
    let damaged = |reason: String| StoreError::Damaged { what, reason };
    let read = || {
        let mut decoder = zstd::Decoder::with_buffer(bytes)?;
        decoder.window_log_max(WINDOW_LOG)?;
        let mut content = Vec::new();
        decoder.take(LARGEST_BYTES + 1).read_to_end(&mut content)?;
        Ok(content)
    };
    let content = read().map_err(|e: std::io::Error| damaged(e.to_string()))?;
    if content.len() as u64 > LARGEST_BYTES {
        return Err(damaged(format!("it expands to more than {LARGEST_BYTES} bytes")));
    }
    Ok(content)
}

pub(super) fn sha256(bytes: &[u8]) -> String {
    hex::encode(Sha256::digest(bytes))
}
