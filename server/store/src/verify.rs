//! Verifies a record: its file, schema, hash chains, every row, and its anchors.

use super::anchor::{self, ChainEnds};
use super::{Connection, SCHEMA_VERSION, StoreError, StoreResult, audit, read_only, schema_versions, seals};
use sqlx::sqlite::SqliteConnectOptions;
use sqlx::{AssertSqlSafe, Connection as _, Row, SqliteConnection, SqlitePool};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use tokio::sync::OnceCell;

/// The result for an intact record.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct IntactRecord {
    /// Number of rows of the audit trail, and the hash of the last one.
    pub audit: (u64, String),
    /// Number of seals, and the hash of the last one.
    pub seals: (u64, String),
    /// The existing anchors and the rows that they list.
    pub anchors: Vec<(PathBuf, ChainEnds)>,
}

/// Verifies a record that another process may own.
///
/// # Errors
/// [`StoreError::Damaged`], [`StoreError::CutOff`] or [`StoreError::Rewritten`] with the first discrepancy; errors of
/// the database.
pub async fn file(record: &Path, anchors: &[PathBuf]) -> StoreResult<IntactRecord> {
    let pool = read_only::open(record).await?;
    let found = verify_pool(&pool, record, anchors).await;
    pool.close().await;
    found
}

async fn verify_pool(pool: &SqlitePool, record: &Path, anchors: &[PathBuf]) -> StoreResult<IntactRecord> {
    read_only::check_open(pool).await?;
    let version = schema_versions::check_version(pool, record).await?;
    // One consistent state for all comparisons.
    let mut db = pool.begin().await?;
    let (audit, seals) = rows(&mut db, version).await?;
    let mut seen = Vec::new();
    for anchor in std::iter::once(anchor::path_of(record)).chain(anchors.iter().cloned()) {
        match anchor::check(&mut db, record, &anchor).await? {
            Some(ends) => seen.push((anchor, ends)),
            None if anchors.contains(&anchor) => {
                return Err(StoreError::Open { path: anchor, source: std::io::ErrorKind::NotFound.into() });
            }
            None => {}
        }
    }
    Ok(IntactRecord { audit, seals, anchors: seen })
}

/// Number of links of a chain, and the hash of the last one.
type ChainSummary = (u64, String);

/// Verifies schema, chains, and every row of a record of this version. Returns the audit trail and the seals.
///
/// # Errors
/// [`StoreError::Damaged`], or [`StoreError::Unsealed`] for a row that was added outside the program.
pub(super) async fn rows(db: &mut Connection, version: i64) -> StoreResult<(ChainSummary, ChainSummary)> {
    let damaged = |what, reason: String| StoreError::Damaged { what, reason };
    schema(db, version).await?;
    let audit = match audit::verify(db).await? {
        audit::ChainCheck::Intact { rows, last } => (rows, last),
        audit::ChainCheck::Broken { seq } => {
            return Err(damaged("audit trail", format!("the audit trail is broken at row {seq}")));
        }
    };
    let seals = match seals::verify(db).await? {
        seals::SealCheck::Intact { seals, last } => (seals, last),
        seals::SealCheck::Broken { seq } => {
            return Err(damaged("seals", format!("the chain of seals is broken at seal {seq}")));
        }
        seals::SealCheck::Unsealed { table, key } => return Err(StoreError::Unsealed { table, key }),
        seals::SealCheck::Touched { table, key } => return Err(seals::touched(&table, &key)),
    };
    sequences(db).await?;
    Ok((audit, seals))
}

/// Checks that tables, indices, triggers and views match the migrations, because a missing trigger protects nothing.
async fn schema(db: &mut Connection, version: i64) -> StoreResult<()> {
    let expected = match version {
        SCHEMA_VERSION => PRESENT.get_or_try_init(|| created(SCHEMA_VERSION)).await?,
        older => &created(older).await?,
    };
    let found = parts(db).await?;
    match expected.symmetric_difference(&found).next() {
        None => Ok(()),
        Some((kind, name, ..)) => {
            let reason = format!("{kind} {name} of the schema differs from the one that this program creates");
            Err(StoreError::Damaged { what: "schema", reason })
        }
    }
}

/// The parts of the schema that this program creates.
async fn created(version: i64) -> StoreResult<BTreeSet<SchemaPart>> {
    let options = SqliteConnectOptions::new().filename(":memory:");
    let mut fresh = SqliteConnection::connect_with(&options).await?;
    schema_versions::up_to(version).run_direct(None, &mut fresh, false).await?;
    let parts = parts(&mut fresh).await?;
    fresh.close().await?;
    Ok(parts)
}

/// Kind, name, table and text of a part of a schema.
type SchemaPart = (String, String, String, Option<String>);

/// The parts of the newest schema, which every start compares.
static PRESENT: OnceCell<BTreeSet<SchemaPart>> = OnceCell::const_new();

/// The parts of a schema. The table of applied migrations is written by a library; the tests of upgrades
/// detect if a version of it changes the text.
async fn parts(db: &mut Connection) -> StoreResult<BTreeSet<SchemaPart>> {
    let sql = "select type, name, tbl_name, sql from sqlite_master";
    Ok(sqlx::query_as(sql).fetch_all(db).await?.into_iter().collect())
}

/// Checks the largest sequence numbers that SQLite keeps: no table has a larger one, and append-only tables have
/// exactly this one.
async fn sequences(db: &mut Connection) -> StoreResult<()> {
    for row in sqlx::query("select name, seq from sqlite_sequence").fetch_all(&mut *db).await? {
        let (table, counted): (String, i64) = (row.try_get(0)?, row.try_get(1)?);
        let is_known = seals::TABLES.iter().any(|sealed| sealed.table == table)
            || seals::CHECKED.iter().any(|checked| checked.table == table)
            || seals::NOT_SEALED.contains(&table.as_str());
        let damaged = || StoreError::Damaged {
            what: "sequence numbers",
            reason: format!("the number of rows of {table} is wrong"),
        };
        if !is_known {
            return Err(damaged());
        }
        let last = AssertSqlSafe(format!("select coalesce(max(seq), 0) from {table}"));
        let last: i64 = sqlx::query_scalar(last).fetch_one(&mut *db).await?;
        let keeps_all = "select 1 from sqlite_master where type = 'trigger' and name = ? || '_no_delete' and sql not glob '*when *'";
        let keeps_all = sqlx::query(keeps_all).bind(&table).fetch_optional(&mut *db).await?.is_some();
        if last > counted || (keeps_all && last < counted) {
            return Err(damaged());
        }
    }
    Ok(())
}
