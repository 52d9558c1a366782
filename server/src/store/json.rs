//! JSON and compressed JSON columns.

use super::{StoreError, StoreResult};
use serde::Serialize;
use serde::de::DeserializeOwned;
use sha2::{Digest, Sha256};
use sqlx::Row;
use sqlx::sqlite::SqliteRow;

/// zstd level: past this, trajectories shrink little and slowly.
const COMPRESSION: i32 = 9;

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

pub(super) fn compress(what: &'static str, bytes: &[u8]) -> StoreResult<Vec<u8>> {
    zstd::encode_all(bytes, COMPRESSION).map_err(|e| StoreError::Damaged { what, reason: e.to_string() })
}

pub(super) fn decompress(what: &'static str, bytes: &[u8]) -> StoreResult<Vec<u8>> {
    zstd::decode_all(bytes).map_err(|e| StoreError::Damaged { what, reason: e.to_string() })
}

pub(super) fn sha256(bytes: &[u8]) -> String {
    hex::encode(Sha256::digest(bytes))
}
