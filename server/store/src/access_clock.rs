//! The latest instant of a decision about access, so that expired sessions stay expired when the clock is set back.

use super::{Connection, Instant, StoreResult, read_only};
use sqlx::Row;
use std::path::Path;

/// The latest instant in the record.
///
/// # Errors
/// Errors of the database.
pub async fn latest(db: &mut Connection) -> StoreResult<Option<Instant>> {
    Ok(sqlx::query_scalar("select latest from clock").fetch_optional(db).await?)
}

/// Tables with instants, and their latest one.
const LATEST: [(&str, &str); 2] =
    [("clock", "select max(latest) from clock"), ("audit", "select max(created_at) from audit")];

/// The latest instant in a record that another process may own: that of the clock or of the audit trail, whichever is later.
/// `None` if there is neither.
///
/// # Errors
/// As [`read_only::open`].
pub async fn latest_of_file(record: &Path) -> StoreResult<Option<Instant>> {
    let pool = read_only::open(record).await?;
    let found = async {
        let mut db = pool.acquire().await?;
        let mut found = None;
        for (name, sql) in LATEST {
            let table = sqlx::query("select 1 from sqlite_master where type = 'table' and name = ?").bind(name);
            if table.fetch_optional(&mut *db).await?.is_some() {
                let instant: Option<Instant> = sqlx::query(sql).fetch_one(&mut *db).await?.try_get(0)?;
                found = found.max(instant);
            }
        }
        Ok(found)
    };
    let found = found.await;
    pool.close().await;
    found
}

/// Records an instant, unless a later one is recorded.
///
/// # Errors
/// Errors of the database.
pub async fn reach(db: &mut Connection, at: Instant) -> StoreResult<()> {
    let sql = "insert into clock (id, latest) values (1, ?1) on conflict do update set latest = max(latest, ?1)";
    sqlx::query(sql).bind(at).execute(db).await?;
    Ok(())
}
