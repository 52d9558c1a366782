//! Users.

use gaitwright_store::rights::Role;
use gaitwright_store::{Instant, UserId, users};
use serde::Serialize;
use utoipa::ToSchema;

/// A person who signs in: administrator, clinician or rater.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct User {
    /// Identifier.
    id: UserId,
    /// Name or code, unique ignoring case.
    name: String,
    /// Role, which determines the rights of the user.
    role: Role,
    /// Whether the user has a password. Otherwise only one-time links work.
    has_password: bool,
    /// Time at which the user was disabled. Null if the user is not disabled.
    disabled_at: Option<Instant>,
    /// Time of creation.
    created_at: Instant,
}

impl From<users::User> for User {
    fn from(row: users::User) -> Self {
        let users::User { id, name, role, has_password, disabled_at, created_at, password: _ } = row;
        Self { id, name, role, has_password, disabled_at, created_at }
    }
}
