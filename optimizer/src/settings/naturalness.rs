//! Naturalness terms beyond the paper, all off by default: what makes a gait look natural beyond its constraints.
//!
//! The speed band and the shortest double supports are limits ([`super::GaitLimits`]); `examples/naturalness.rs`
//! measures what each of them does.

use crate::subject::ModelError;
use serde::{Deserialize, Serialize};

/// Naturalness terms beyond the paper.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Naturalness {
    /// Weight of the squared distance from the reference's joint angles beside the cost of transport (seven angles, rad²,
    /// mean of each domain, sum over the domains; phases as the reference has them). 0: cost alone.
    pub reference_weight: f64,
    /// Share of the walker's weight that the trailing foot carries at least when the other heel strikes; falls linearly
    /// to nothing at its toe-off, half of it in DS2. 0: the weight may change feet at once.
    pub trailing_load_share: f64,
}

impl Naturalness {
    /// Whether all terms are off.
    pub fn is_off(&self) -> bool {
        *self == Self::default()
    }

    /// Checks every number against its allowed range.
    ///
    /// # Errors
    /// [`ModelError::OutOfRange`] naming the field.
    pub fn validate(&self) -> Result<(), ModelError> {
        ModelError::check_range("naturalness.reference_weight", self.reference_weight, 0.0, 100.0)?;
        ModelError::check_range("naturalness.trailing_load_share", self.trailing_load_share, 0.0, 0.9)?;
        Ok(())
    }
}
