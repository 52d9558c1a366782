//! Messages between service and workers: compressed MessagePack, which preserves every bit of a number.

use crate::dispatch_error::DispatchError;
use crate::workers::dispatch::Assignment;
use crate::workers::dispatch::{AssignmentResult, Attempt};
use gait_optimizer::IterationRecord;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use std::io::Read;

/// Largest uncompressed message, against decompression bombs.
const MAX_BYTES: u64 = 256 << 20;
/// zstd level. Speed matters more than size on a local network.
const COMPRESSION: i32 = 3;

/// A job.
#[derive(Debug, PartialEq, Serialize, Deserialize)]
pub struct SolveOrder {
    /// Version of the program that sent it.
    pub program: String,
    /// The solve.
    pub assignment: Assignment,
}

/// A heartbeat.
#[derive(Debug, PartialEq, Serialize, Deserialize)]
pub struct Sign {
    /// The attempt.
    pub attempt: Attempt,
    /// Name of the worker.
    pub worker: String,
    /// The iterations since the last heartbeat; empty when the solve has just started.
    pub records: Vec<IterationRecord>,
}

/// A result.
#[derive(Debug, Serialize, Deserialize)]
pub struct ResultMessage {
    /// The attempt.
    pub attempt: Attempt,
    /// Name of the worker.
    pub worker: String,
    /// The result.
    pub result: AssignmentResult,
}

/// Writes a message.
///
/// # Errors
/// [`DispatchError::Message`] when it cannot be written.
pub fn pack<T: Serialize>(message: &T) -> Result<Vec<u8>, DispatchError> {
    let bytes = rmp_serde::to_vec_named(message).map_err(|e| DispatchError::Message(e.to_string()))?;
    zstd::encode_all(&bytes[..], COMPRESSION).map_err(|e| DispatchError::Message(e.to_string()))
}

/// Reads a message.
///
/// # Errors
/// [`DispatchError::Message`] for malformed bytes.
pub fn unpack<T: DeserializeOwned>(bytes: &[u8]) -> Result<T, DispatchError> {
    let unreadable = |reason: String| DispatchError::Message(reason);
    let reader = zstd::Decoder::new(bytes).map_err(|e| unreadable(e.to_string()))?;
    let mut plain = Vec::new();
    reader.take(MAX_BYTES + 1).read_to_end(&mut plain).map_err(|e| unreadable(e.to_string()))?;
    if plain.len() as u64 > MAX_BYTES {
        return Err(unreadable(format!("it expands to more than {MAX_BYTES} bytes")));
    }
    rmp_serde::from_slice(&plain).map_err(|e| unreadable(e.to_string()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use gaitwright_store::TrialId;
    use proptest::prelude::*;

    #[test]
    fn messages_preserve_every_bit_even_of_infinite_numbers() {
        let numbers = [0.1 + 0.2, f64::NAN, f64::INFINITY, f64::MIN_POSITIVE, -0.0];
        let back: Vec<f64> = unpack(&pack(&numbers.to_vec()).unwrap()).unwrap();
        let bits = |numbers: &[f64]| numbers.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
        assert_eq!(bits(&back), bits(&numbers));
    }

    #[test]
    fn decompression_bombs_are_refused() {
        let zeros = zstd::encode_all(std::io::repeat(0).take(MAX_BYTES + 1), 1).unwrap();
        assert!(unpack::<Sign>(&zeros).unwrap_err().to_string().contains("more than"));
    }

    proptest! {
        #[test]
        fn any_bytes_are_read_or_refused(bytes in proptest::collection::vec(any::<u8>(), 0..400)) {
            let _ = unpack::<SolveOrder>(&bytes);
            let _ = unpack::<ResultMessage>(&bytes);
            let packed = zstd::encode_all(&bytes[..], 1).unwrap();
            prop_assert!(unpack::<SolveOrder>(&packed).is_err());
            prop_assert!(unpack::<ResultMessage>(&packed).is_err());
        }

        #[test]
        fn message_with_changed_bytes_is_read_or_refused(at in any::<prop::sample::Index>(), flip in 1_u8..) {
            let attempt = Attempt { trial: TrialId::fresh(), number: 3 };
            let brought = ResultMessage { attempt, worker: "w".to_owned(), result: AssignmentResult::Broke("reason".to_owned()) };
            let mut bytes = rmp_serde::to_vec_named(&brought).unwrap();
            let place = at.index(bytes.len());
            bytes[place] ^= flip;
            let _ = unpack::<ResultMessage>(&zstd::encode_all(&bytes[..], 1).unwrap());
        }
    }
}
