//! Stored counts of failed sign-ins: by name and source, for the back-off, and by network, for display. A source is a
//! network, a site, a browser in which the user signed in earlier, or all networks together.

use super::{Connection, Instant, StoreResult};
use sqlx::Row;
use sqlx::sqlite::SqliteRow;

/// Failed sign-ins of one name from one source.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Failures {
    /// Number of failures.
    pub count: u32,
    /// Time before which the next attempt is refused.
    pub waits_until: Instant,
}

/// All failed sign-ins from a network.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct NetworkFailures {
    /// The network.
    pub network: String,
    /// Number of attempts, including those refused without checking the password.
    pub attempts: u32,
    /// Number of different names, up to a limit.
    pub names: u32,
    /// Time of the first attempt.
    pub first_at: Instant,
    /// Time of the last attempt.
    pub last_at: Instant,
}

/// Failed sign-ins of this name from this source.
///
/// # Errors
/// Errors of the database.
pub async fn find(db: &mut Connection, name: &str, source: &str) -> StoreResult<Option<Failures>> {
    let row = sqlx::query("select failures, waits_until from sign_in_failures where name = ? and source = ?")
        .bind(name)
        .bind(source)
        .fetch_optional(db)
        .await?;
    let failures =
        |row: SqliteRow| Ok(Failures { count: row.try_get("failures")?, waits_until: row.try_get("waits_until")? });
    row.map(failures).transpose()
}

/// Sets the failures of this name and source.
///
/// # Errors
/// Errors of the database.
pub async fn set(db: &mut Connection, name: &str, source: &str, at: Instant, failures: Failures) -> StoreResult<()> {
    sqlx::query(
        "insert into sign_in_failures (name, source, failures, last_at, waits_until) values (?1, ?2, ?3, ?4, ?5) \
         on conflict do update set failures = ?3, last_at = ?4, waits_until = ?5",
    )
    .bind(name)
    .bind(source)
    .bind(failures.count)
    .bind(at)
    .bind(failures.waits_until)
    .execute(db)
    .await?;
    Ok(())
}

/// Deletes the failures of this name and source.
///
/// # Errors
/// Errors of the database.
pub async fn forget(db: &mut Connection, name: &str, source: &str) -> StoreResult<()> {
    let sql = "delete from sign_in_failures where name = ? and source = ?";
    sqlx::query(sql).bind(name).bind(source).execute(db).await?;
    Ok(())
}

/// All failed sign-ins from this network.
///
/// # Errors
/// Errors of the database.
pub async fn of_network(db: &mut Connection, network: &str) -> StoreResult<Option<NetworkFailures>> {
    let row = sqlx::query("select * from sign_in_sources where network = ?").bind(network).fetch_optional(db).await?;
    row.as_ref().map(source).transpose()
}

/// The networks with the most failed sign-ins.
///
/// # Errors
/// Errors of the database.
pub async fn most(db: &mut Connection, limit: u32) -> StoreResult<Vec<NetworkFailures>> {
    let sql = "select * from sign_in_sources where attempts > 0 order by attempts desc, network limit ?";
    sqlx::query(sql).bind(limit).fetch_all(db).await?.iter().map(source).collect()
}

/// Counts an attempt from this network, with a new or a known name. Returns the number of attempts.
///
/// # Errors
/// Errors of the database.
pub async fn count(db: &mut Connection, network: &str, at: Instant, new_name: bool) -> StoreResult<u32> {
    let row = sqlx::query(
        "insert into sign_in_sources (network, attempts, names, first_at, last_at) values (?1, 1, ?2, ?3, ?3) \
         on conflict do update set first_at = iif(attempts = 0, ?3, first_at), attempts = attempts + 1, names = names + ?2, \
         last_at = ?3 returning attempts",
    )
    .bind(network)
    .bind(new_name)
    .bind(at)
    .fetch_one(db)
    .await?;
    Ok(row.try_get(0)?)
}

/// Subtracts an attempt that succeeded, and its name.
///
/// # Errors
/// Errors of the database.
pub async fn remove(db: &mut Connection, network: &str) -> StoreResult<()> {
    let sql = "update sign_in_sources set attempts = max(attempts - 1, 0), names = max(names - 1, 0) where network = ?";
    sqlx::query(sql).bind(network).execute(db).await?;
    Ok(())
}

/// Deletes some entries older than an instant, and returns the deleted networks.
///
/// # Errors
/// Errors of the database.
pub async fn prune(db: &mut Connection, before: Instant) -> StoreResult<Vec<NetworkFailures>> {
    let old = "delete from sign_in_failures where (name, source) in \
               (select name, source from sign_in_failures where last_at < ? limit 1000)";
    sqlx::query(old).bind(before).execute(&mut *db).await?;
    let old = "delete from sign_in_sources where network in \
               (select network from sign_in_sources where last_at < ? limit 20) returning *";
    sqlx::query(old).bind(before).fetch_all(db).await?.iter().map(source).collect()
}

fn source(row: &SqliteRow) -> StoreResult<NetworkFailures> {
    Ok(NetworkFailures {
        network: row.try_get("network")?,
        attempts: row.try_get("attempts")?,
        names: row.try_get("names")?,
        first_at: row.try_get("first_at")?,
        last_at: row.try_get("last_at")?,
    })
}
