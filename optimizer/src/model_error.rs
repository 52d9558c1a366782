//! Why an input was rejected.

use thiserror::Error;

/// A range in words.
fn range(minimum: f64, maximum: f64) -> String {
    if minimum < maximum { format!("{minimum} to {maximum}") } else { minimum.to_string() }
}

/// Why an input was rejected: a subject, device, bound, setting or file.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum ModelError {
    /// A number is outside its allowed range.
    #[error("{field} is {value}; it must be {}.", range(*minimum, *maximum))]
    OutOfRange {
        /// Name of the field with its unit, as in the public interface (`height_m`).
        field: String,
        /// The value given.
        value: f64,
        /// Smallest allowed value.
        minimum: f64,
        /// Largest allowed value.
        maximum: f64,
    },
    /// A name is unknown.
    #[error("{field} is {value:?}; it must be {}.", known.trim_end_matches('.'))]
    Unknown {
        /// Field name.
        field: String,
        /// The value that was given.
        value: String,
        /// The known values, which complete the sentence "it must be ...".
        known: String,
    },
    /// A text or file cannot be parsed.
    #[error("{what}: {}.", reason.trim_end_matches('.'))]
    Malformed {
        /// Name of the text or file.
        what: String,
        /// The reason, with the place if it is known.
        reason: String,
    },
}

impl ModelError {
    /// Returns the value if `minimum <= value <= maximum`.
    ///
    /// # Errors
    /// [`ModelError::OutOfRange`] with the field otherwise, and for NaN.
    pub fn check_range(field: &str, value: f64, minimum: f64, maximum: f64) -> Result<f64, Self> {
        if value >= minimum && value <= maximum {
            Ok(value)
        } else {
            Err(Self::OutOfRange { field: field.to_owned(), value, minimum, maximum })
        }
    }
}
