//! Which studies a caller can access. What it may do with them depends on its rights.

use crate::{TokenId, UserId};

/// A user or token that can be a member of a study.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Principal {
    /// A user.
    User(UserId),
    /// A token.
    Token(TokenId),
}

/// Which studies a caller can access.
///
/// Every function of the store that lists studies, or finds one for a caller, takes this.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Reach {
    /// Every study: administrators, and callers of a service without sign-in.
    Every,
    /// Every unrestricted study, and restricted ones as a member: staff and their programs.
    Open(Principal),
    /// Studies with membership only: raters.
    Assigned(Principal),
}

impl Reach {
    /// Whether membership does not matter.
    pub fn is_every(self) -> bool {
        self == Self::Every
    }

    /// Whether unrestricted studies are accessible without membership.
    pub fn is_open(self) -> bool {
        matches!(self, Self::Open(_))
    }

    /// Whose memberships count; `None` if membership does not matter.
    pub fn principal(self) -> Option<Principal> {
        match self {
            Self::Every => None,
            Self::Open(principal) | Self::Assigned(principal) => Some(principal),
        }
    }
}
