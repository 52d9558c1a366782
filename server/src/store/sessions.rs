//! Sessions of people who signed in, and the one-time links they come by. Secrets are here as hashes alone.

use super::{Connection, Instant, StoreResult, UserId, now};
use sqlx::Row;
use sqlx::sqlite::SqliteRow;

/// A session that was found by the hash of its secret.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Session {
    /// Whose.
    pub user: UserId,
    /// When it was begun.
    pub begun_at: Instant,
    /// Whether with a one-time link.
    pub by_link: bool,
    /// When the person last did something.
    pub seen_at: Instant,
}

/// Begins a session.
///
/// # Errors
/// What the database reports.
pub async fn begin(db: &mut Connection, hash: &str, user: UserId, by_link: bool) -> StoreResult<()> {
    let at = now();
    sqlx::query("insert into sessions (hash, user_id, by_link, created_at, seen_at) values (?, ?, ?, ?, ?)")
        .bind(hash)
        .bind(user)
        .bind(by_link)
        .bind(at)
        .bind(at)
        .execute(db)
        .await?;
    Ok(())
}

/// The session with this hash, unless it has ended.
///
/// # Errors
/// What the database reports.
pub async fn find(db: &mut Connection, hash: &str) -> StoreResult<Option<Session>> {
    let row =
        sqlx::query("select user_id, created_at, by_link, seen_at from sessions where hash = ? and ended_at is null")
            .bind(hash)
            .fetch_optional(db)
            .await?;
    let session = |row: &SqliteRow| {
        Ok(Session {
            user: row.try_get("user_id")?,
            begun_at: row.try_get("created_at")?,
            by_link: row.try_get("by_link")?,
            seen_at: row.try_get("seen_at")?,
        })
    };
    row.as_ref().map(session).transpose()
}

/// Notes that the person did something.
///
/// # Errors
/// What the database reports.
pub async fn seen(db: &mut Connection, hash: &str) -> StoreResult<()> {
    sqlx::query("update sessions set seen_at = ? where hash = ? and ended_at is null")
        .bind(now())
        .bind(hash)
        .execute(db)
        .await?;
    Ok(())
}

/// Ends a session.
///
/// # Errors
/// What the database reports.
pub async fn end(db: &mut Connection, hash: &str) -> StoreResult<()> {
    sqlx::query("update sessions set ended_at = ? where hash = ? and ended_at is null")
        .bind(now())
        .bind(hash)
        .execute(db)
        .await?;
    Ok(())
}

/// Ends every session of a user and makes the user's links useless.
///
/// # Errors
/// What the database reports.
pub async fn end_all(db: &mut Connection, user: UserId) -> StoreResult<()> {
    let at = now();
    for sql in [
        "update sessions set ended_at = ? where user_id = ? and ended_at is null",
        "update sign_in_links set used_at = ? where user_id = ? and used_at is null",
    ] {
        sqlx::query(sql).bind(at).bind(user).execute(&mut *db).await?;
    }
    Ok(())
}

/// Adds a one-time link.
///
/// # Errors
/// What the database reports.
pub async fn add_link(db: &mut Connection, hash: &str, user: UserId, expires_at: Instant) -> StoreResult<()> {
    sqlx::query("insert into sign_in_links (hash, user_id, created_at, expires_at) values (?, ?, ?, ?)")
        .bind(hash)
        .bind(user)
        .bind(now())
        .bind(expires_at)
        .execute(db)
        .await?;
    Ok(())
}

/// Whose link it is, if it can still be used.
///
/// # Errors
/// What the database reports.
pub async fn link(db: &mut Connection, hash: &str) -> StoreResult<Option<UserId>> {
    let row = sqlx::query("select user_id from sign_in_links where hash = ? and used_at is null and expires_at > ?")
        .bind(hash)
        .bind(now())
        .fetch_optional(db)
        .await?;
    Ok(row.map(|row| row.try_get(0)).transpose()?)
}

/// Uses a link up.
///
/// # Errors
/// What the database reports.
pub async fn use_link(db: &mut Connection, hash: &str) -> StoreResult<()> {
    sqlx::query("update sign_in_links set used_at = ? where hash = ?").bind(now()).bind(hash).execute(db).await?;
    Ok(())
}

/// Drops sessions that ended before an instant, or in which nothing was done since: how many.
///
/// # Errors
/// What the database reports.
pub async fn drop_before(db: &mut Connection, at: Instant) -> StoreResult<u64> {
    let done = sqlx::query("delete from sessions where coalesce(ended_at, seen_at) < ?").bind(at).execute(db).await?;
    Ok(done.rows_affected())
}

/// Drops links that were used or expired before an instant: how many.
///
/// # Errors
/// What the database reports.
pub async fn drop_links_before(db: &mut Connection, at: Instant) -> StoreResult<u64> {
    let sql = "delete from sign_in_links where min(coalesce(used_at, expires_at), expires_at) < ?";
    Ok(sqlx::query(sql).bind(at).execute(db).await?.rows_affected())
}
