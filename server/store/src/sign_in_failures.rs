//! Failed sign-ins: by name and source, which makes the next one wait; by network, which is shown.

use super::{Connection, Instant, StoreResult};
use sqlx::Row;
use sqlx::sqlite::SqliteRow;

/// Failed sign-ins of one name from one source.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Failures {
    /// How many.
    pub count: u32,
    /// Until when the next one waits.
    pub waits_until: Instant,
}

/// All failed sign-ins from a network.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Source {
    /// The network.
    pub network: String,
    /// How many, with those that were refused without a look at the password.
    pub attempts: u32,
    /// With how many different names; those beyond a limit are not counted apart.
    pub names: u32,
    /// The first one.
    pub first_at: Instant,
    /// The last one.
    pub last_at: Instant,
}

/// Failed sign-ins of this name from this source.
///
/// # Errors
/// What the database reports.
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

/// Sets what is known of this name and source.
///
/// # Errors
/// What the database reports.
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

/// Forgets this name and source.
///
/// # Errors
/// What the database reports.
pub async fn forget(db: &mut Connection, name: &str, source: &str) -> StoreResult<()> {
    let sql = "delete from sign_in_failures where name = ? and source = ?";
    sqlx::query(sql).bind(name).bind(source).execute(db).await?;
    Ok(())
}

/// All failed sign-ins from this network.
///
/// # Errors
/// What the database reports.
pub async fn of_network(db: &mut Connection, network: &str) -> StoreResult<Option<Source>> {
    let row = sqlx::query("select * from sign_in_sources where network = ?").bind(network).fetch_optional(db).await?;
    row.as_ref().map(source).transpose()
}

/// The networks with most failed sign-ins.
///
/// # Errors
/// What the database reports.
pub async fn most(db: &mut Connection, limit: u32) -> StoreResult<Vec<Source>> {
    let sql = "select * from sign_in_sources where attempts > 0 order by attempts desc, network limit ?";
    sqlx::query(sql).bind(limit).fetch_all(db).await?.iter().map(source).collect()
}

/// Counts one attempt from this network, with a name that it did not try before or with a known one: how many there are.
///
/// # Errors
/// What the database reports.
pub async fn count(db: &mut Connection, network: &str, at: Instant, new_name: bool) -> StoreResult<u32> {
    let row = sqlx::query(
        "insert into sign_in_sources (network, attempts, names, first_at, last_at) values (?1, 1, ?2, ?3, ?3) \
         on conflict do update set attempts = attempts + 1, names = names + ?2, last_at = ?3 returning attempts",
    )
    .bind(network)
    .bind(new_name)
    .bind(at)
    .fetch_one(db)
    .await?;
    Ok(row.try_get(0)?)
}

/// Takes one attempt back: it succeeded, and its name has no failures any more.
///
/// # Errors
/// What the database reports.
pub async fn uncount(db: &mut Connection, network: &str) -> StoreResult<()> {
    let sql = "update sign_in_sources set attempts = max(attempts - 1, 0), names = max(names - 1, 0) where network = ?";
    sqlx::query(sql).bind(network).execute(db).await?;
    Ok(())
}

/// Removes what is older than an instant, some of it at a time: the networks that were removed.
///
/// # Errors
/// What the database reports.
pub async fn prune(db: &mut Connection, before: Instant) -> StoreResult<Vec<Source>> {
    let old = "delete from sign_in_failures where (name, source) in \
               (select name, source from sign_in_failures where last_at < ? limit 1000)";
    sqlx::query(old).bind(before).execute(&mut *db).await?;
    let old = "delete from sign_in_sources where network in \
               (select network from sign_in_sources where last_at < ? limit 20) returning *";
    sqlx::query(old).bind(before).fetch_all(db).await?.iter().map(source).collect()
}

fn source(row: &SqliteRow) -> StoreResult<Source> {
    Ok(Source {
        network: row.try_get("network")?,
        attempts: row.try_get("attempts")?,
        names: row.try_get("names")?,
        first_at: row.try_get("first_at")?,
        last_at: row.try_get("last_at")?,
    })
}
