//! Rights, and which of them each role has.

use crate::StoreError;
use serde::{Deserialize, Serialize};
use std::str::FromStr;
use utoipa::ToSchema;

/// A right of a user or a token: `read`, see everything except blinded data; `run`, create, start, pause and stop
/// studies, plan lab sessions, and evaluate trials by scripts; `answer`, give preferences without blinding, and review
/// safety reports; `rate`, compare gaits blind, and record walks and answers in lab sessions; `device`, fetch the
/// controller files of walks; `administer`, manage users and tokens, unblind, read the audit trail and make backups.
/// The scopes of a token are rights other than `administer`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum Right {
    /// See everything except blinded data.
    Read,
    /// Create, start, pause and stop studies; evaluate trials by scripts.
    Run,
    /// Give preferences without blinding; review safety reports.
    Answer,
    /// Compare gaits blind; record walks and answers in lab sessions.
    Rate,
    /// Fetch controller files of lab walks, for the device in the lab. A user who can read and fetches one no longer
    /// counts as blind.
    Device,
    /// Manage users and tokens, unblind, read the audit trail, make backups.
    Administer,
}

impl Right {
    /// Every right.
    pub const ALL: [Self; 6] = [Self::Read, Self::Run, Self::Answer, Self::Rate, Self::Device, Self::Administer];

    /// The name in the record and in REST.
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Read => "read",
            Self::Run => "run",
            Self::Answer => "answer",
            Self::Rate => "rate",
            Self::Device => "device",
            Self::Administer => "administer",
        }
    }
}

/// A set of rights.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Rights(Vec<Right>);

impl Rights {
    /// Every right.
    pub fn all() -> Self {
        Self(Right::ALL.to_vec())
    }

    /// The set of these rights.
    pub fn of(rights: &[Right]) -> Self {
        Self(rights.to_vec())
    }

    /// Whether it is the only right of the set.
    pub fn is_only(&self, right: Right) -> bool {
        self.0 == [right]
    }

    /// Whether the set has it.
    pub fn has(&self, right: Right) -> bool {
        self.0.contains(&right)
    }
}

/// Role of a user: `administrator` has every right; `clinician` runs studies and gives preferences; `rater` compares gaits
/// blind and records walks and answers in lab sessions.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum Role {
    /// Has every right.
    Administrator,
    /// Runs studies and gives preferences.
    Clinician,
    /// Compares gaits blind, and records walks and answers in lab sessions.
    Rater,
}

impl Role {
    /// Every role.
    pub const ALL: [Self; 3] = [Self::Administrator, Self::Clinician, Self::Rater];

    /// The name in the record and in REST.
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Administrator => "administrator",
            Self::Clinician => "clinician",
            Self::Rater => "rater",
        }
    }

    /// The rights of the role.
    pub fn rights(self) -> Rights {
        match self {
            Self::Administrator => Rights::all(),
            Self::Clinician => Rights::of(&[Right::Read, Right::Run, Right::Answer, Right::Rate, Right::Device]),
            Self::Rater => Rights::of(&[Right::Rate]),
        }
    }
}

impl FromStr for Role {
    type Err = StoreError;
    fn from_str(text: &str) -> Result<Self, StoreError> {
        Self::ALL.into_iter().find(|role| role.as_str() == text).ok_or_else(|| StoreError::unknown_value("role", text))
    }
}
