//! Naturalness terms beyond the paper, off by default.
//!
//! The range of walking speeds and the shortest double support are limits ([`super::GaitLimits`]). `examples/naturalness.rs`
//! measures the effect of each.

use crate::model_error::ModelError;
use serde::{Deserialize, Serialize};

/// Naturalness terms beyond the paper.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Naturalness {
    /// Weight of the squared distance from the joint angles of the reference gait, relative to the cost of transport. The
    /// distance is the mean over the nodes of a domain of the sum over seven angles, rad², summed over the domains. 0 disables
    /// it.
    pub reference_weight: f64,
    /// Smallest share of the weight of the walker on the trailing foot at heel strike of the other foot. It decreases linearly
    /// to 0 at toe-off, half of it in DS2. 0 allows an immediate weight transfer.
    pub trailing_load_share: f64,
}

impl Naturalness {
    /// Whether all terms are disabled.
    pub fn is_off(&self) -> bool {
        *self == Self::default()
    }

    /// Checks the range of each term.
    ///
    /// # Errors
    /// [`ModelError::OutOfRange`] with the field.
    pub fn validate(&self) -> Result<(), ModelError> {
        ModelError::check_range("naturalness.reference_weight", self.reference_weight, 0.0, 100.0)?;
        ModelError::check_range("naturalness.trailing_load_share", self.trailing_load_share, 0.0, 0.9)?;
        Ok(())
    }
}
