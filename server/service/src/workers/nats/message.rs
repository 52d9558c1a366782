//! What service and workers send each other: MessagePack, which keeps every bit of a number, compressed.

use crate::workers::dispatch::{Attempt, DispatchError, Finding};
use crate::workers::evaluate::Assignment;
use gait_optimizer::IterationRecord;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use std::io::Read;

/// No message unpacks to more than this: who sends more means harm.
const LARGEST_BYTES: u64 = 256 << 20;
/// zstd level: the broker is near, time matters more than the last percent.
const COMPRESSION: i32 = 3;

/// The version of the program: another one may solve the same problem to other bits.
pub(super) const PROGRAM: &str = env!("CARGO_PKG_VERSION");

/// A job.
#[derive(Debug, PartialEq, Serialize, Deserialize)]
pub struct Order {
    /// The version of the program that wrote it.
    pub program: String,
    /// What to solve.
    pub assignment: Assignment,
}

/// A sign of life.
#[derive(Debug, PartialEq, Serialize, Deserialize)]
pub struct Sign {
    /// Of which try.
    pub attempt: Attempt,
    /// Who runs it.
    pub worker: String,
    /// The iterations since the last sign; none: it was just begun.
    pub records: Vec<IterationRecord>,
}

/// A result.
#[derive(Debug, Serialize, Deserialize)]
pub struct Brought {
    /// Of which try.
    pub attempt: Attempt,
    /// Who ran it.
    pub worker: String,
    /// What came of it.
    pub finding: Finding,
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
/// [`DispatchError::Message`] when these bytes are none.
pub fn unpack<T: DeserializeOwned>(bytes: &[u8]) -> Result<T, DispatchError> {
    let unreadable = |reason: String| DispatchError::Message(reason);
    let reader = zstd::Decoder::new(bytes).map_err(|e| unreadable(e.to_string()))?;
    let mut plain = Vec::new();
    reader.take(LARGEST_BYTES + 1).read_to_end(&mut plain).map_err(|e| unreadable(e.to_string()))?;
    if plain.len() as u64 > LARGEST_BYTES {
        return Err(unreadable(format!("it unpacks to more than {LARGEST_BYTES} bytes")));
    }
    rmp_serde::from_slice(&plain).map_err(|e| unreadable(e.to_string()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use gaitwright_store::TrialId;
    use proptest::prelude::*;

    #[test]
    fn a_message_comes_back_to_the_bit_also_with_numbers_that_are_not_finite() {
        let numbers = [0.1 + 0.2, f64::NAN, f64::INFINITY, f64::MIN_POSITIVE, -0.0];
        let back: Vec<f64> = unpack(&pack(&numbers.to_vec()).unwrap()).unwrap();
        let bits = |numbers: &[f64]| numbers.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
        assert_eq!(bits(&back), bits(&numbers));
    }

    #[test]
    fn what_unpacks_to_too_much_is_refused() {
        let zeros = zstd::encode_all(std::io::repeat(0).take(LARGEST_BYTES + 1), 1).unwrap();
        assert!(unpack::<Sign>(&zeros).unwrap_err().to_string().contains("more than"));
    }

    proptest! {
        #[test]
        fn any_bytes_are_read_or_refused(bytes in proptest::collection::vec(any::<u8>(), 0..400)) {
            let _ = unpack::<Order>(&bytes);
            let _ = unpack::<Brought>(&bytes);
            let packed = zstd::encode_all(&bytes[..], 1).unwrap();
            prop_assert!(unpack::<Order>(&packed).is_err());
            prop_assert!(unpack::<Brought>(&packed).is_err());
        }

        #[test]
        fn a_message_with_changed_bytes_is_read_or_refused(at in any::<prop::sample::Index>(), flip in 1_u8..) {
            let attempt = Attempt { trial: TrialId::fresh(), number: 3 };
            let brought = Brought { attempt, worker: "w".to_owned(), finding: Finding::Broke("reason".to_owned()) };
            let mut bytes = rmp_serde::to_vec_named(&brought).unwrap();
            let place = at.index(bytes.len());
            bytes[place] ^= flip;
            let _ = unpack::<Brought>(&zstd::encode_all(&bytes[..], 1).unwrap());
        }
    }
}
