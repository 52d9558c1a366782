//! Stored sessions of users and one-time sign-in links. Only hashes of their secrets are stored.

use super::{Connection, Instant, SessionId, StoreResult, UserId};
use sqlx::Row;
use sqlx::sqlite::SqliteRow;

/// Session of a user.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Session {
    /// Identifier. It is not the value of the session cookie.
    pub id: SessionId,
    /// Identifier of the user.
    pub user_id: UserId,
    /// Name of the user.
    pub user_name: String,
    /// Time of sign-in.
    pub created_at: Instant,
    /// Time of the last activity.
    pub seen_at: Instant,
    /// Whether the user signed in with a one-time link rather than a password.
    pub by_link: bool,
    /// Client address at sign-in.
    pub address: Option<String>,
    /// User agent of the browser.
    pub browser: Option<String>,
}

/// The origin of a sign-in.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct SignInOrigin {
    /// Address of the client.
    pub address: Option<String>,
    /// User agent of the browser.
    pub browser: Option<String>,
    /// Hash of the cookie that identifies the browser.
    pub browser_hash: Option<String>,
}

const SELECT: &str = "select s.*, u.name from sessions s join users u on u.id = s.user_id where s.ended_at is null";

/// Begins a session.
///
/// # Errors
/// Errors of the database.
pub async fn begin(
    db: &mut Connection,
    hash: &str,
    user: UserId,
    by_link: bool,
    from: &SignInOrigin,
    at: Instant,
) -> StoreResult<()> {
    sqlx::query(
        "insert into sessions (hash, id, user_id, by_link, address, browser, browser_hash, created_at, seen_at) \
         values (?, ?, ?, ?, ?, ?, ?, ?, ?)",
    )
    .bind(hash)
    .bind(SessionId::fresh())
    .bind(user)
    .bind(by_link)
    .bind(&from.address)
    .bind(&from.browser)
    .bind(&from.browser_hash)
    .bind(at)
    .bind(at)
    .execute(db)
    .await?;
    Ok(())
}

/// The session with this hash, unless it has ended.
///
/// # Errors
/// Errors of the database.
pub async fn find(db: &mut Connection, hash: &str) -> StoreResult<Option<Session>> {
    let sql = sqlx::AssertSqlSafe(format!("{SELECT} and s.hash = ?"));
    let row = sqlx::query(sql).bind(hash).fetch_optional(db).await?;
    row.as_ref().map(from_row).transpose()
}

/// The session with this identifier, unless it has ended.
///
/// # Errors
/// Errors of the database.
pub async fn get(db: &mut Connection, id: SessionId) -> StoreResult<Option<Session>> {
    let sql = sqlx::AssertSqlSafe(format!("{SELECT} and s.id = ?"));
    let row = sqlx::query(sql).bind(id).fetch_optional(db).await?;
    row.as_ref().map(from_row).transpose()
}

/// Whether a user has signed in earlier in the browser with this cookie hash.
///
/// # Errors
/// Errors of the database.
pub async fn is_known_browser(db: &mut Connection, user: UserId, browser_hash: &str) -> StoreResult<bool> {
    let sql = "select 1 from sessions where browser_hash = ? and user_id = ? limit 1";
    Ok(sqlx::query(sql).bind(browser_hash).bind(user).fetch_optional(db).await?.is_some())
}

/// The sessions of a user or of all users that have not ended, newest first.
///
/// # Errors
/// Errors of the database.
pub async fn live(db: &mut Connection, user: Option<UserId>) -> StoreResult<Vec<Session>> {
    let sql = format!("{SELECT} and (?1 is null or s.user_id = ?1) order by s.created_at desc, s.id");
    let rows = sqlx::query(sqlx::AssertSqlSafe(sql)).bind(user).fetch_all(db).await?;
    rows.iter().map(from_row).collect()
}

/// Records the last activity.
///
/// # Errors
/// Errors of the database.
pub async fn record_activity(db: &mut Connection, id: SessionId, at: Instant) -> StoreResult<()> {
    sqlx::query("update sessions set seen_at = ? where id = ? and ended_at is null")
        .bind(at)
        .bind(id)
        .execute(db)
        .await?;
    Ok(())
}

/// Ends a session. Returns `false` if it has already ended.
///
/// # Errors
/// Errors of the database.
pub async fn end(db: &mut Connection, id: SessionId, at: Instant) -> StoreResult<bool> {
    let done = sqlx::query("update sessions set ended_at = ? where id = ? and ended_at is null")
        .bind(at)
        .bind(id)
        .execute(db)
        .await?;
    Ok(done.rows_affected() == 1)
}

/// Ends every session of a user, and invalidates the user's links.
///
/// # Errors
/// Errors of the database.
pub async fn end_all(db: &mut Connection, user: UserId, at: Instant) -> StoreResult<()> {
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
/// Errors of the database.
pub async fn add_link(
    db: &mut Connection,
    hash: &str,
    user: UserId,
    at: Instant,
    expires_at: Instant,
) -> StoreResult<()> {
    sqlx::query("insert into sign_in_links (hash, user_id, created_at, expires_at) values (?, ?, ?, ?)")
        .bind(hash)
        .bind(user)
        .bind(at)
        .bind(expires_at)
        .execute(db)
        .await?;
    Ok(())
}

/// The user and the expiry of a link, unless it was used.
///
/// # Errors
/// Errors of the database.
pub async fn link(db: &mut Connection, hash: &str) -> StoreResult<Option<(UserId, Instant)>> {
    let row = sqlx::query("select user_id, expires_at from sign_in_links where hash = ? and used_at is null")
        .bind(hash)
        .fetch_optional(db)
        .await?;
    Ok(row.map(|row| Ok::<_, sqlx::Error>((row.try_get(0)?, row.try_get(1)?))).transpose()?)
}

/// Marks a link as used.
///
/// # Errors
/// Errors of the database.
pub async fn use_link(db: &mut Connection, hash: &str, at: Instant) -> StoreResult<()> {
    sqlx::query("update sign_in_links set used_at = ? where hash = ?").bind(at).bind(hash).execute(db).await?;
    Ok(())
}

/// Deletes sessions that ended or were last active before an instant, and returns their number.
///
/// # Errors
/// Errors of the database.
pub async fn drop_before(db: &mut Connection, at: Instant) -> StoreResult<u64> {
    let done = sqlx::query("delete from sessions where coalesce(ended_at, seen_at) < ?").bind(at).execute(db).await?;
    Ok(done.rows_affected())
}

/// Deletes links that were used or expired before an instant, and returns their number.
///
/// # Errors
/// Errors of the database.
pub async fn drop_links_before(db: &mut Connection, at: Instant) -> StoreResult<u64> {
    let sql = "delete from sign_in_links where min(coalesce(used_at, expires_at), expires_at) < ?";
    Ok(sqlx::query(sql).bind(at).execute(db).await?.rows_affected())
}

fn from_row(row: &SqliteRow) -> StoreResult<Session> {
    Ok(Session {
        id: row.try_get("id")?,
        user_id: row.try_get("user_id")?,
        user_name: row.try_get("name")?,
        created_at: row.try_get("created_at")?,
        seen_at: row.try_get("seen_at")?,
        by_link: row.try_get("by_link")?,
        address: row.try_get("address")?,
        browser: row.try_get("browser")?,
    })
}
