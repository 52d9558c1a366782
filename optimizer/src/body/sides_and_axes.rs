//! Sides of the body, contact points of a foot, and components in the sagittal plane.

use serde::{Deserialize, Serialize};

/// A contact point of a foot.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum FootPoint {
    /// Heel.
    Heel,
    /// Toe (ball of the foot).
    Toe,
}

/// A side of the body. The prosthesis is on the right.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Side {
    /// Intact leg.
    Left,
    /// Prosthetic leg.
    Right,
}

impl Side {
    /// The other leg.
    #[must_use]
    pub const fn other(self) -> Self {
        match self {
            Self::Left => Self::Right,
            Self::Right => Self::Left,
        }
    }

    /// Index in q of the hip angle of this leg; knee and ankle follow.
    pub const fn hip(self) -> usize {
        match self {
            Self::Left => 3,
            Self::Right => 6,
        }
    }
}

/// A component in the sagittal plane.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Axis {
    /// Forward.
    X,
    /// Up.
    Z,
}
