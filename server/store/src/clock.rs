//! The latest instant that access was decided at: what has ended by then stays ended when the machine's clock is set back.

use super::{Connection, Instant, StoreResult};

/// The latest instant in the record.
///
/// # Errors
/// What the database reports.
pub async fn latest(db: &mut Connection) -> StoreResult<Option<Instant>> {
    Ok(sqlx::query_scalar("select latest from clock").fetch_optional(db).await?)
}

/// Notes an instant, unless the record has a later one.
///
/// # Errors
/// What the database reports.
pub async fn reach(db: &mut Connection, at: Instant) -> StoreResult<()> {
    let sql = "insert into clock (id, latest) values (1, ?1) on conflict do update set latest = max(latest, ?1)";
    sqlx::query(sql).bind(at).execute(db).await?;
    Ok(())
}
