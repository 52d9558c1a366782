//! The latest instant of a decision about access, so that expired sessions stay expired when the clock is set back.

use super::{Connection, Instant, StoreResult};

/// The latest instant in the record.
///
/// # Errors
/// Errors of the database.
pub async fn latest(db: &mut Connection) -> StoreResult<Option<Instant>> {
    Ok(sqlx::query_scalar("select latest from clock").fetch_optional(db).await?)
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
