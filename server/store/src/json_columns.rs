//! Reads and writes JSON columns, plain and compressed.

use super::{StoreError, StoreResult};
use gaitwright_compute::OnPool;
use serde::Serialize;
use serde::de::DeserializeOwned;
use sha2::{Digest, Sha256};
use sqlx::Row;
use sqlx::sqlite::SqliteRow;
use std::io::Read;

/// zstd level. Higher levels are slow and gain little for trajectories.
const COMPRESSION: i32 = 9;
/// Largest uncompressed value, twice the largest upload.
const MAX_BYTES: u64 = 32 << 20;
/// Largest accepted zstd window, as a power of two.
const WINDOW_LOG: u32 = 23;

pub(super) fn to_text<T: Serialize + ?Sized>(what: &'static str, value: &T) -> StoreResult<String> {
    serde_json::to_string(value).map_err(|e| StoreError::Damaged { what, reason: e.to_string() })
}

/// [`to_text`], or `None` if the text cannot be read back because numbers are not finite.
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
    if bytes.len() as u64 > MAX_BYTES {
        let reason = format!("it has {} bytes, but at most {MAX_BYTES} are allowed", bytes.len());
        return Err(StoreError::Damaged { what, reason });
    }
    zstd::encode_all(bytes, COMPRESSION).map_err(|e| StoreError::Damaged { what, reason: e.to_string() })
}

/// Decompresses a value, up to [`MAX_BYTES`].
pub(super) fn decompress(_: &OnPool, what: &'static str, bytes: &[u8]) -> StoreResult<Vec<u8>> {
    let damaged = |reason: String| StoreError::Damaged { what, reason };
    let read = || {
        let mut decoder = zstd::Decoder::with_buffer(bytes)?;
        decoder.window_log_max(WINDOW_LOG)?;
        let mut content = Vec::new();
        decoder.take(MAX_BYTES + 1).read_to_end(&mut content)?;
        Ok(content)
    };
    let content = read().map_err(|e: std::io::Error| damaged(e.to_string()))?;
    if content.len() as u64 > MAX_BYTES {
        return Err(damaged(format!("it expands to more than {MAX_BYTES} bytes")));
    }
    Ok(content)
}

pub(super) fn sha256(bytes: &[u8]) -> String {
    hex::encode(Sha256::digest(bytes))
}
