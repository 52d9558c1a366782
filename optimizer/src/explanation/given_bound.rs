//! A tuned bound with its given value.

use serde::{Deserialize, Serialize};

/// A tuned bound with its given value.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct BoundValue {
    /// Name of the bound.
    pub bound: String,
    /// Limited quantity and its unit.
    pub meaning: String,
    /// Its value.
    pub value: f64,
}
