//! Which studies a caller reaches. What the caller may do there is said by its rights.

use crate::{TokenId, UserId};

/// Whoever can be a member of a study.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Principal {
    /// A person.
    User(UserId),
    /// A program.
    Token(TokenId),
}

/// Which studies a caller reaches.
///
/// Every function of the store that lists studies, or finds one for a caller, takes it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Reach {
    /// Every study: administrators, and whoever uses a service without sign-in.
    Every,
    /// Every study that is not restricted, and those that it is a member of: staff and their programs.
    Open(Principal),
    /// The studies that it is a member of: raters.
    Assigned(Principal),
}

impl Reach {
    /// Whether membership does not matter.
    pub fn is_every(self) -> bool {
        self == Self::Every
    }

    /// Whether studies that are not restricted are reached without membership.
    pub fn is_open(self) -> bool {
        matches!(self, Self::Open(_))
    }

    /// Whose memberships count; none: membership does not matter.
    pub fn principal(self) -> Option<Principal> {
        match self {
            Self::Every => None,
            Self::Open(principal) | Self::Assigned(principal) => Some(principal),
        }
    }
}
