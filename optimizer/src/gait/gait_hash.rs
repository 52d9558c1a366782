//! The hash of a gait, which names it in certificates and execution reports.

use super::Gait;
use crate::model_error::ModelError;
use sha2::{Digest, Sha256};

impl Gait {
    /// SHA-256 of the gait as compact JSON, hexadecimal.
    ///
    /// # Errors
    /// [`ModelError`] if the gait has no JSON.
    pub(crate) fn sha256(&self) -> Result<String, ModelError> {
        let text = serde_json::to_vec(self)
            .map_err(|error| ModelError::Malformed { what: "gait".to_owned(), reason: error.to_string() })?;
        Ok(hexadecimal(&Sha256::digest(&text)))
    }
}

fn hexadecimal(bytes: &[u8]) -> String {
    let digit = |value: u8| char::from_digit(u32::from(value), 16).unwrap_or_default();
    bytes.iter().flat_map(|byte| [digit(byte >> 4), digit(byte & 15)]).collect()
}
