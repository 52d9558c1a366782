//! Verifies the chain of seals, and every row against its newest seal or checksum.

use super::super::audit::{ORIGIN, last_ever};
use super::super::{Connection, StoreResult};
use super::row_hash::hash_of_row;
use super::tables::{Sealed, present};
use super::{JOINT, chained};
use futures_util::TryStreamExt;
use sqlx::{AssertSqlSafe, Row};

/// Number of seals read at a time.
const BATCH: i64 = 1000;

/// The result of verifying the seals.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum SealCheck {
    /// Every row matches its seal.
    Intact {
        /// Number of seals.
        seals: u64,
        /// Hash of the last seal.
        last: String,
    },
    /// A seal does not match the previous one.
    Broken {
        /// Sequence number of the seal.
        seq: i64,
    },
    /// A row was added outside the program.
    Unsealed {
        /// The table.
        table: String,
        /// The primary key.
        key: String,
    },
    /// A row was changed or deleted outside the program.
    Touched {
        /// The table.
        table: String,
        /// The primary key.
        key: String,
    },
}

/// Verifies the whole chain, and compares every row with its newest seal.
///
/// # Errors
/// Errors of the database.
pub async fn verify(db: &mut Connection) -> StoreResult<SealCheck> {
    let chain = walk(db).await?;
    if !matches!(chain, SealCheck::Intact { .. }) {
        return Ok(chain);
    }
    let known = present(db).await?;
    for sealed in &known {
        if let Some((key, without_seal)) = unlike(db, *sealed).await? {
            let table = sealed.table.to_owned();
            return Ok(if without_seal {
                SealCheck::Unsealed { table, key }
            } else {
                SealCheck::Touched { table, key }
            });
        }
    }
    let stray = of_no_table(db, &known).await?;
    Ok(stray.map_or(chain, |(table, key)| SealCheck::Touched { table, key }))
}

/// A seal or checksum of an unknown table.
async fn of_no_table(db: &mut Connection, known: &[Sealed]) -> StoreResult<Option<(String, String)>> {
    let names: Vec<String> = known.iter().map(|sealed| format!("'{}'", sealed.table)).collect();
    let sql = format!(
        "select table_name, key from (select table_name, key from seals union all select table_name, key from checksums) \
         where table_name not in ({}) limit 1",
        names.join(", ")
    );
    Ok(sqlx::query_as(AssertSqlSafe(sql)).fetch_optional(db).await?)
}

async fn walk(db: &mut Connection) -> StoreResult<SealCheck> {
    let (mut last, mut after) = (ORIGIN.to_owned(), 0_i64);
    loop {
        let batch = sqlx::query("select * from seals where seq > ? order by seq limit ?")
            .bind(after)
            .bind(BATCH)
            .fetch_all(&mut *db)
            .await?;
        if batch.is_empty() {
            break;
        }
        for row in &batch {
            let seq: i64 = row.try_get("seq")?;
            let text = |name: &str| row.try_get::<String, _>(name);
            let (Ok(table), Ok(key), Ok(sha256)) = (text("table_name"), text("key"), text("sha256")) else {
                return Ok(SealCheck::Broken { seq });
            };
            let hash = chained(&last, &table, &key, &sha256);
            if seq != after + 1 || text("previous")? != last || text("hash")? != hash {
                return Ok(SealCheck::Broken { seq });
            }
            (last, after) = (hash, seq);
        }
    }
    // SQLite keeps the largest number ever used.
    if last_ever(db, "seals").await? != after {
        return Ok(SealCheck::Broken { seq: after + 1 });
    }
    Ok(SealCheck::Intact { seals: after.unsigned_abs(), last })
}

/// The key of a row that differs from the hash that the record has of it, and whether it has none; or the key of a hash
/// whose row is missing.
async fn unlike(db: &mut Connection, sealed: Sealed) -> StoreResult<Option<(String, bool)>> {
    let (table, key) = (sealed.table, sealed.key_of(&format!("{}.", sealed.table)));
    let hashes = if sealed.is_checked() {
        format!("select key from checksums where table_name = '{table}'")
    } else {
        format!(
            "select key from seals s where table_name = '{table}' and sha256 <> '' and not exists \
             (select 1 from seals n where n.table_name = s.table_name and n.key = s.key and n.seq > s.seq)"
        )
    };
    let gone = format!("{hashes} except select cast({key} as text) from {table} limit 1");
    let sql = format!(
        "select {table}.*, cast({key} as text) as \"{JOINT}key\", {} as \"{JOINT}known\" from {table}",
        sealed.known_hash(&key)
    );
    let mut rows = sqlx::query(AssertSqlSafe(sql)).fetch(&mut *db);
    while let Some(row) = rows.try_next().await? {
        let known: Option<&str> = row.try_get(format!("{JOINT}known").as_str())?;
        if known != Some(hash_of_row(&row)?.as_str()) {
            return Ok(Some((row.try_get(format!("{JOINT}key").as_str())?, known.is_none())));
        }
    }
    drop(rows);
    let gone: Option<String> = sqlx::query_scalar(AssertSqlSafe(gone)).fetch_optional(db).await?;
    Ok(gone.map(|key| (key, false)))
}
