//! Rights, and which of them a role or a token has.

use crate::StoreError;
use serde::{Deserialize, Serialize};
use std::str::FromStr;
use utoipa::ToSchema;

/// Something that may be allowed. A token has some of these as its scopes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum Right {
    /// See everything but blind sessions.
    Read,
    /// Make, start, hold and end studies; ask for trials and tell what they gave.
    Run,
    /// Say which gait is better, knowing which is which; decide about gaits that were called unsafe.
    Answer,
    /// Compare gaits blindly.
    Rate,
    /// Fetch the controller files of lab walks: for the device in the lab. Somebody who may read and fetches one is
    /// recorded as knowing which gait the walk is with.
    Device,
    /// Users, tokens, unblinding, the audit trail, backups.
    Administer,
}

impl Right {
    /// Every right.
    pub const ALL: [Self; 6] = [Self::Read, Self::Run, Self::Answer, Self::Rate, Self::Device, Self::Administer];

    /// As stored and shown.
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

    /// These rights.
    pub fn of(rights: &[Right]) -> Self {
        Self(rights.to_vec())
    }

    /// Whether it is the only one of them.
    pub fn is_only(&self, right: Right) -> bool {
        self.0 == [right]
    }

    /// Whether it is one of them.
    pub fn has(&self, right: Right) -> bool {
        self.0.contains(&right)
    }
}

/// What a person is here.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum Role {
    /// May do everything.
    Admin,
    /// Runs studies and answers.
    Clinician,
    /// Compares gaits blindly, and sees nothing else.
    Rater,
}

impl Role {
    /// Every role.
    pub const ALL: [Self; 3] = [Self::Admin, Self::Clinician, Self::Rater];

    /// As stored and shown.
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Admin => "admin",
            Self::Clinician => "clinician",
            Self::Rater => "rater",
        }
    }

    /// What it may do.
    pub fn rights(self) -> Rights {
        match self {
            Self::Admin => Rights::all(),
            Self::Clinician => Rights::of(&[Right::Read, Right::Run, Right::Answer, Right::Rate, Right::Device]),
            Self::Rater => Rights::of(&[Right::Rate]),
        }
    }
}

impl FromStr for Role {
    type Err = StoreError;
    fn from_str(text: &str) -> Result<Self, StoreError> {
        Self::ALL
            .into_iter()
            .find(|role| role.as_str() == text)
            .ok_or_else(|| StoreError::Damaged { what: "role", reason: text.to_owned() })
    }
}
