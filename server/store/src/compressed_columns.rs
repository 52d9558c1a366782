//! Compressed columns, which are decompressed on the thread pool and therefore never while a connection is held.

use super::{StoreError, StoreResult, json_columns};
use gaitwright_compute::OnPool;
use serde::de::DeserializeOwned;
use std::marker::PhantomData;

/// A compressed text.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PackedText {
    what: &'static str,
    bytes: Vec<u8>,
    /// SHA-256 of the text, if the record has it.
    sha256: Option<String>,
}

impl PackedText {
    pub(super) fn new(what: &'static str, bytes: Vec<u8>, sha256: Option<String>) -> Self {
        Self { what, bytes, sha256 }
    }

    /// Decompresses the text.
    ///
    /// # Errors
    /// [`StoreError::Damaged`] if it cannot be decompressed or does not match its hash.
    pub fn text(&self, pool: &OnPool) -> StoreResult<String> {
        let what = self.what;
        let bytes = json_columns::decompress(pool, what, &self.bytes)?;
        if self.sha256.as_ref().is_some_and(|sha256| json_columns::sha256(&bytes) != *sha256) {
            return Err(StoreError::Damaged { what, reason: "it does not match its hash".to_owned() });
        }
        String::from_utf8(bytes).map_err(|e| StoreError::Damaged { what, reason: e.to_string() })
    }
}

/// A value in compressed JSON.
#[derive(Debug, Clone)]
pub struct Packed<T> {
    json: PackedText,
    value: PhantomData<fn() -> T>,
}

impl<T: DeserializeOwned> Packed<T> {
    pub(super) fn new(json: PackedText) -> Self {
        Self { json, value: PhantomData }
    }

    /// Decompresses the JSON text.
    ///
    /// # Errors
    /// As [`PackedText::text`].
    pub fn text(&self, pool: &OnPool) -> StoreResult<String> {
        self.json.text(pool)
    }

    /// Decompresses and parses the value.
    ///
    /// # Errors
    /// As [`PackedText::text`], and if the text is not the JSON of such a value.
    pub fn unpack(&self, pool: &OnPool) -> StoreResult<T> {
        json_columns::from_text(self.json.what, &self.json.text(pool)?)
    }
}
