//! Why an input was rejected.

use crate::number_format::{shortest, with_unit, without_noise};
use thiserror::Error;

/// A range in words, with its unit and its relation to another field.
fn range(minimum: f64, maximum: f64, unit: &str, relation: &str) -> String {
    let mut words = without_noise(minimum);
    if minimum < maximum {
        words = format!("{words} to {}", without_noise(maximum));
    }
    words = with_unit(words, unit);
    if relation.is_empty() { words } else { format!("{words}, {relation}") }
}

/// Why an input was rejected: a subject, device, bound, setting or file.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum ModelError {
    /// A number is outside its allowed range.
    #[error("{field} is {}; it must be {}.", shortest(*value), range(*minimum, *maximum, unit, relation))]
    OutOfRange {
        /// Name of the field, as in the public interface (`height_m`).
        field: String,
        /// The value given.
        value: f64,
        /// Smallest allowed value.
        minimum: f64,
        /// Largest allowed value.
        maximum: f64,
        /// Unit of the value if the field's name does not have it; otherwise empty.
        unit: &'static str,
        /// Relation to another field that sets the range, such as `below a4`; empty if there is none.
        relation: String,
    },
    /// A number is given that must be absent.
    #[error("{field} must be absent, because {reason}.")]
    MustBeAbsent {
        /// Name of the field.
        field: String,
        /// The value given.
        value: f64,
        /// Why it must be absent.
        reason: String,
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
        Self::check_related_range(field, value, (minimum, maximum), ("", ""))
    }

    /// Checks a range as [`Self::check_range`] does, for a field whose name lacks its unit or whose range depends on another
    /// field. Unit and relation can be empty.
    ///
    /// # Errors
    /// [`ModelError::OutOfRange`] with the field, the unit and the relation.
    pub fn check_related_range(
        field: &str,
        value: f64,
        (minimum, maximum): (f64, f64),
        (unit, relation): (&'static str, &str),
    ) -> Result<f64, Self> {
        if value >= minimum && value <= maximum {
            return Ok(value);
        }
        let (field, relation) = (field.to_owned(), relation.to_owned());
        Err(Self::OutOfRange { field, value, minimum, maximum, unit, relation })
    }

    /// The allowed values, which complete the sentence "it must be ..."; `None` for a text that cannot be parsed.
    pub fn allowed(&self) -> Option<String> {
        match self {
            Self::OutOfRange { minimum, maximum, unit, relation, .. } => {
                Some(range(*minimum, *maximum, unit, relation))
            }
            Self::MustBeAbsent { reason, .. } => Some(format!("absent, because {reason}")),
            Self::Unknown { known, .. } => Some(known.clone()),
            Self::Malformed { .. } => None,
        }
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    #[test]
    fn range_has_unit_and_relation_and_no_noise_of_binary_fractions() {
        let related = ModelError::check_related_range("a3", 2.0, (0.05, 1.4 - 1e-3), ("m/s", "below a4"));
        let related = related.unwrap_err();
        assert_eq!(related.to_string(), "a3 is 2; it must be 0.05 to 1.399 m/s, below a4.");
        assert_eq!(related.allowed().unwrap(), "0.05 to 1.399 m/s, below a4");
        let plain = |value: f64, minimum: f64, maximum: f64| {
            ModelError::check_range("tolerance", value, minimum, maximum).unwrap_err().to_string()
        };
        assert_eq!(plain(5.0, 1e-10, 1e-2), "tolerance is 5; it must be 1e-10 to 0.01.");
        assert_eq!(plain(2.5e-12, 1e-10, 1e-2), "tolerance is 2.5e-12; it must be 1e-10 to 0.01.");
        assert_eq!(plain(f64::NAN, 8.0, 8.0), "tolerance is NaN; it must be 8.");
    }
}
