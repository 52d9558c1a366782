//! Settings of the gait problem that are not tuned by the learner.

use serde::{Deserialize, Serialize};

/// Number of mesh intervals per domain type; a domain with N intervals has 2N+1 equidistant points.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Mesh {
    /// Double support on stance heel and trailing toe.
    pub ds2: usize,
    /// Double support on the flat stance foot and trailing toe.
    pub ds3: usize,
    /// Single support on the flat stance foot.
    pub ss2: usize,
    /// Single support on the stance toe.
    pub ss1: usize,
}

impl Default for Mesh {
    fn default() -> Self {
        Self { ds2: 4, ds3: 4, ss2: 6, ss1: 6 }
    }
}

/// Everything about the gait problem that is neither subject, device nor tuned bound.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, Default)]
#[serde(deny_unknown_fields, default)]
pub struct GaitSettings {
    /// Mesh intervals per domain type.
    pub mesh: Mesh,
}
