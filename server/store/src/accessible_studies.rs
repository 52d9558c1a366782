//! Which studies a caller can access. What it may do with them depends on its rights.

use crate::{Connection, StoreResult, StudyId, TokenId, UserId};

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

/// SQL condition that a caller can access the study of a column. `?1`, `?2` and `?3` are the values of [`reach_values`].
macro_rules! reached {
    ($study:literal) => {
        concat!(
            "(?1 or ",
            $study,
            " in (select study_id from current_study_members where principal = ?3) or (?2 and ",
            $study,
            " not in (select study_id from restricted_studies)))"
        )
    };
}
pub(super) use reached;

/// The first three values of a query with [`reached`]: whether every study is accessible, whether open ones are, and
/// whose memberships count.
pub(super) fn reach_values(reach: Reach) -> (bool, bool, Option<String>) {
    let principal = reach.principal().map(|principal| match principal {
        Principal::User(id) => id.to_string(),
        Principal::Token(id) => id.to_string(),
    });
    (reach.is_every(), reach.is_open(), principal)
}

/// Whether a caller can access a study. `false` for a study that does not exist.
///
/// # Errors
/// Errors of the database.
pub async fn reaches(db: &mut Connection, reach: Reach, study: StudyId) -> StoreResult<bool> {
    let (every, open, principal) = reach_values(reach);
    let found = sqlx::query(concat!("select 1 from studies s where s.id = ?4 and ", reached!("s.id")))
        .bind(every)
        .bind(open)
        .bind(principal)
        .bind(study)
        .fetch_optional(db)
        .await?;
    Ok(found.is_some())
}

/// Whether a caller can access any study.
///
/// # Errors
/// Errors of the database.
pub async fn reaches_any(db: &mut Connection, reach: Reach) -> StoreResult<bool> {
    let (every, open, principal) = reach_values(reach);
    let found = sqlx::query(concat!("select 1 from studies s where ", reached!("s.id"), " limit 1"))
        .bind(every)
        .bind(open)
        .bind(principal)
        .fetch_optional(db)
        .await?;
    Ok(found.is_some())
}
