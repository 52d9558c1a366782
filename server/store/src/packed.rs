//! Compressed columns as they are read: bytes. What they hold is unpacked on a pool, and so never inside a connection.

use super::{StoreError, StoreResult, json};
use gaitwright_compute::OnPool;
use serde::de::DeserializeOwned;
use std::marker::PhantomData;

/// A compressed text.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PackedText {
    what: &'static str,
    bytes: Vec<u8>,
    /// SHA-256 of the text, where the record keeps it.
    sha256: Option<String>,
}

impl PackedText {
    pub(super) fn new(what: &'static str, bytes: Vec<u8>, sha256: Option<String>) -> Self {
        Self { what, bytes, sha256 }
    }

    /// The text.
    ///
    /// # Errors
    /// [`StoreError::Damaged`] when it cannot be unpacked or its hash is wrong.
    pub fn text(&self, pool: &OnPool) -> StoreResult<String> {
        let what = self.what;
        let bytes = json::decompress(pool, what, &self.bytes)?;
        if self.sha256.as_ref().is_some_and(|sha256| json::sha256(&bytes) != *sha256) {
            return Err(StoreError::Damaged { what, reason: "it has changed".to_owned() });
        }
        String::from_utf8(bytes).map_err(|e| StoreError::Damaged { what, reason: e.to_string() })
    }
}

/// A value as compressed JSON.
#[derive(Debug, Clone)]
pub struct Packed<T> {
    json: PackedText,
    holds: PhantomData<fn() -> T>,
}

impl<T: DeserializeOwned> Packed<T> {
    pub(super) fn new(json: PackedText) -> Self {
        Self { json, holds: PhantomData }
    }

    /// The JSON text.
    ///
    /// # Errors
    /// As [`PackedText::text`].
    pub fn text(&self, pool: &OnPool) -> StoreResult<String> {
        self.json.text(pool)
    }

    /// The value.
    ///
    /// # Errors
    /// As [`PackedText::text`], and when the text is not the JSON of such a value.
    pub fn unpack(&self, pool: &OnPool) -> StoreResult<T> {
        json::from_text(self.json.what, &self.json.text(pool)?)
    }
}
