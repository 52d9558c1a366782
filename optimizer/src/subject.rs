//! The subject.

use crate::model_error::ModelError;
use serde::{Deserialize, Serialize};

/// A subject: the height and mass that scale the human segments (Winter 2009).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Subject {
    /// Body height in metres.
    pub height_m: f64,
    /// Body mass in kilograms.
    pub body_mass_kg: f64,
}

impl Subject {
    /// Allowed heights in metres. The prosthetic shank has a fixed length, which leaves a thigh link of valid length
    /// for these heights only.
    pub const HEIGHT_RANGE_M: (f64, f64) = (1.4, 2.2);
    /// Allowed body masses in kilograms.
    pub const BODY_MASS_RANGE_KG: (f64, f64) = (35.0, 160.0);

    /// A subject with validated height and mass.
    ///
    /// # Errors
    /// [`ModelError::OutOfRange`] with `height_m` or `body_mass_kg`.
    pub fn new(height_m: f64, body_mass_kg: f64) -> Result<Self, ModelError> {
        let subject = Self { height_m, body_mass_kg };
        subject.validate()?;
        Ok(subject)
    }

    /// A subject from the paper: 1 (female, 1.727 m, 65.7 kg) or 2 (male, 1.803 m, 75 kg).
    ///
    /// # Errors
    /// [`ModelError::Unknown`] for any other number.
    pub fn builtin(number: u32) -> Result<Self, ModelError> {
        match number {
            1 => Self::new(1.727, 65.7),
            2 => Self::new(1.803, 75.0),
            other => Err(ModelError::Unknown {
                field: "subject".to_owned(),
                value: other.to_string(),
                known: "1 or 2, the subjects from the paper. For any other subject, give height and mass".to_owned(),
            }),
        }
    }

    /// Checks height and mass against their allowed ranges.
    ///
    /// # Errors
    /// [`ModelError::OutOfRange`] with the field.
    pub fn validate(&self) -> Result<(), ModelError> {
        ModelError::check_range("height_m", self.height_m, Self::HEIGHT_RANGE_M.0, Self::HEIGHT_RANGE_M.1)?;
        ModelError::check_range(
            "body_mass_kg",
            self.body_mass_kg,
            Self::BODY_MASS_RANGE_KG.0,
            Self::BODY_MASS_RANGE_KG.1,
        )?;
        Ok(())
    }
}
