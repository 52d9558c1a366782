//! Tokens of programs.

use gaitwright_store::rights::Right;
use gaitwright_store::{Instant, TokenId, tokens};
use serde::Serialize;
use utoipa::ToSchema;

/// Token of a program, without its secret.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct Token {
    /// Identifier.
    id: TokenId,
    /// Unique name that states its purpose.
    name: String,
    /// Rights of the token.
    scopes: Vec<Right>,
    /// Actor who created it. The token is revoked when this user is disabled or is no longer an administrator.
    created_by: String,
    /// Time of creation.
    created_at: Instant,
    /// Time of expiry. Null if it does not expire.
    expires_at: Option<Instant>,
    /// Time of revocation. Null if it is not revoked.
    revoked_at: Option<Instant>,
}

impl From<tokens::Token> for Token {
    fn from(row: tokens::Token) -> Self {
        let tokens::Token { id, name, scopes, created_by, created_at, expires_at, revoked_at } = row;
        Self { id, name, scopes, created_by, created_at, expires_at, revoked_at }
    }
}
