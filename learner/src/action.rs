//! The index that names one action of a search space.

use std::fmt;

use serde::{Deserialize, Serialize};

/// Index of an action in its search space: row-major, the last dimension varies fastest.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(transparent)]
pub struct ActionIndex(pub u64);

impl fmt::Display for ActionIndex {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}
