//! Stored tokens of programs. Only hashes of their secrets are stored.

use super::audit::Actor;
use super::{Connection, Instant, StoreError, StoreResult, TokenId, UserId, json_columns, now};
use crate::rights::Right;
use sqlx::Row;
use sqlx::sqlite::SqliteRow;

/// Token of a program, without its secret.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Token {
    /// Identifier.
    pub id: TokenId,
    /// Unique name that states its purpose.
    pub name: String,
    /// Rights of the token.
    pub scopes: Vec<Right>,
    /// Actor who created it. The token is revoked when this user is disabled or is no longer an administrator.
    pub created_by: String,
    /// Time of creation.
    pub created_at: Instant,
    /// Time of expiry. Absent if it does not expire.
    pub expires_at: Option<Instant>,
    /// Time of revocation, if it was revoked.
    pub revoked_at: Option<Instant>,
}

impl Token {
    /// Whether it is valid: neither revoked nor expired.
    pub fn is_good(&self) -> bool {
        self.revoked_at.is_none() && self.expires_at.is_none_or(|at| at > now())
    }
}

/// The unique name, as SQLite names it in a violation.
pub const NAME_UNIQUE: &str = "tokens.name";

/// Adds a token.
///
/// # Errors
/// A violated constraint ([`NAME_UNIQUE`]); errors of the database.
pub async fn insert(
    db: &mut Connection,
    name: &str,
    hash: &str,
    scopes: &[Right],
    created_by: &Actor,
    expires_at: Option<Instant>,
) -> StoreResult<Token> {
    let token = Token {
        id: TokenId::fresh(),
        name: name.to_owned(),
        scopes: scopes.to_vec(),
        created_by: created_by.as_str().to_owned(),
        created_at: now(),
        expires_at,
        revoked_at: None,
    };
    sqlx::query(
        "insert into tokens (id, name, hash, scopes, created_by, creator_id, created_at, expires_at) \
         values (?, ?, ?, ?, ?, ?, ?, ?)",
    )
    .bind(token.id)
    .bind(name)
    .bind(hash)
    .bind(json_columns::to_text("scopes", &scopes)?)
    .bind(created_by.as_str())
    .bind(created_by.user_id())
    .bind(token.created_at)
    .bind(expires_at)
    .execute(db)
    .await?;
    Ok(token)
}

/// The token with this hash, unless it was revoked.
///
/// # Errors
/// Errors of the database.
pub async fn by_hash(db: &mut Connection, hash: &str) -> StoreResult<Option<Token>> {
    let row =
        sqlx::query("select * from tokens where hash = ? and revoked_at is null").bind(hash).fetch_optional(db).await?;
    row.as_ref().map(from_row).transpose()
}

/// The tokens that a user created and that were not revoked.
///
/// # Errors
/// Errors of the database.
pub async fn created_by_user(db: &mut Connection, user: UserId) -> StoreResult<Vec<Token>> {
    let rows = sqlx::query("select * from tokens where revoked_at is null and creator_id = ? order by id").bind(user);
    rows.fetch_all(db).await?.iter().map(from_row).collect()
}

/// The token with this identifier.
///
/// # Errors
/// [`StoreError::Missing`]; errors of the database.
pub async fn get(db: &mut Connection, id: TokenId) -> StoreResult<Token> {
    let row = sqlx::query("select * from tokens where id = ?").bind(id).fetch_optional(db).await?;
    row.as_ref().map(from_row).transpose()?.ok_or_else(|| StoreError::Missing { what: "token", id: id.to_string() })
}

/// Every token, oldest first.
///
/// # Errors
/// Errors of the database.
pub async fn all(db: &mut Connection) -> StoreResult<Vec<Token>> {
    let rows = sqlx::query("select * from tokens order by id").fetch_all(db).await?;
    rows.iter().map(from_row).collect()
}

/// Revokes a token. Returns `false` if it was already revoked.
///
/// # Errors
/// Errors of the database.
pub async fn revoke(db: &mut Connection, id: TokenId) -> StoreResult<bool> {
    let done = sqlx::query("update tokens set revoked_at = ? where id = ? and revoked_at is null")
        .bind(now())
        .bind(id)
        .execute(db)
        .await?;
    Ok(done.rows_affected() == 1)
}

fn from_row(row: &SqliteRow) -> StoreResult<Token> {
    Ok(Token {
        id: row.try_get("id")?,
        name: row.try_get("name")?,
        scopes: json_columns::column(row, "scopes")?,
        created_by: row.try_get("created_by")?,
        created_at: row.try_get("created_at")?,
        expires_at: row.try_get("expires_at")?,
        revoked_at: row.try_get("revoked_at")?,
    })
}
