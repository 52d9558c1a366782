//! Stored responses to requests with an Idempotency-Key, written in the transaction of their effect.

use super::audit::Actor;
use super::{Connection, Instant, StoreResult, json_columns, now};
use sqlx::Row;

/// A stored response.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct StoredResponse {
    /// SHA-256 of the request.
    pub request: String,
    /// HTTP status.
    pub status: u16,
    /// Location header.
    pub location: Option<String>,
    /// JSON body.
    pub body: String,
}

/// The hash of a request.
pub fn fingerprint(method: &str, path: &str, body: &[u8]) -> String {
    let mut whole = format!("{method} {path}\n").into_bytes();
    whole.extend_from_slice(body);
    json_columns::sha256(&whole)
}

/// The stored response for a key of a caller.
///
/// # Errors
/// Errors of the database.
pub async fn find(db: &mut Connection, actor: &Actor, key: &str) -> StoreResult<Option<StoredResponse>> {
    let row = sqlx::query("select * from idempotency_keys where actor = ? and key = ?")
        .bind(actor.as_str())
        .bind(key)
        .fetch_optional(db)
        .await?;
    let Some(row) = row else { return Ok(None) };
    Ok(Some(StoredResponse {
        request: row.try_get("request")?,
        status: row.try_get("status")?,
        location: row.try_get("location")?,
        body: row.try_get("body")?,
    }))
}

/// The unique key, as SQLite names it in a violation.
pub const KEY_UNIQUE: &str = "idempotency_keys.key";

/// Stores a response.
///
/// # Errors
/// Errors of the database.
pub async fn insert(db: &mut Connection, actor: &Actor, key: &str, kept: &StoredResponse) -> StoreResult<()> {
    sqlx::query(
        "insert into idempotency_keys (actor, key, request, status, location, body, created_at) \
         values (?, ?, ?, ?, ?, ?, ?)",
    )
    .bind(actor.as_str())
    .bind(key)
    .bind(&kept.request)
    .bind(kept.status)
    .bind(&kept.location)
    .bind(&kept.body)
    .bind(now())
    .execute(db)
    .await?;
    Ok(())
}

/// Deletes responses older than an instant, and returns their number.
///
/// # Errors
/// Errors of the database.
pub async fn drop_before(db: &mut Connection, at: Instant) -> StoreResult<u64> {
    let done = sqlx::query("delete from idempotency_keys where created_at < ?").bind(at).execute(db).await?;
    Ok(done.rows_affected())
}
