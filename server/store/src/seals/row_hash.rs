//! The hash of a row, which seals and checksums contain.

use super::super::{Connection, StoreResult, json_columns};
use super::JOINT;
use super::tables::Sealed;
use futures_util::TryStreamExt;
use sha2::{Digest, Sha256};
use sqlx::sqlite::SqliteRow;
use sqlx::{AssertSqlSafe, Column, Row, TypeInfo, ValueRef};
use std::collections::HashMap;

impl Sealed {
    /// The hashes of the current rows with these keys. Deleted rows have none.
    pub(super) async fn hashes_of(&self, db: &mut Connection, keys: &[&str]) -> StoreResult<HashMap<String, String>> {
        let mut found = HashMap::new();
        let &[column] = self.key else {
            for key in keys {
                found.extend(self.hash_of(db, key).await?.map(|sha256| ((*key).to_owned(), sha256)));
            }
            return Ok(found);
        };
        // A single statement, so that a change of many rows does not hold the writer for long.
        let key = self.key_of("t.");
        let sql = format!(
            "select cast({key} as text) as \"{JOINT}key\", t.* from {} t where {column} in (select value from json_each(?))",
            self.table
        );
        let keys: Vec<String> = keys.iter().map(|key| self.part(key)).collect();
        // One at a time, because a row may hold a whole gait.
        let mut rows = sqlx::query(AssertSqlSafe(sql)).bind(json_columns::to_text("keys", &keys)?).fetch(db);
        while let Some(row) = rows.try_next().await? {
            found.insert(row.try_get(0)?, hash_of_row(&row)?);
        }
        drop(rows);
        Ok(found)
    }

    /// The hash of the current row; `None` if it was deleted.
    async fn hash_of(&self, db: &mut Connection, key: &str) -> StoreResult<Option<String>> {
        let columns: Vec<String> = self.key.iter().map(|column| format!("{column} = ?")).collect();
        let sql = format!("select * from {} where {}", self.table, columns.join(" and "));
        let parts = key.splitn(self.key.len(), JOINT).map(|part| self.part(part));
        let query = parts.fold(sqlx::query(AssertSqlSafe(sql)), sqlx::query::Query::bind);
        query.fetch_optional(db).await?.as_ref().map(hash_of_row).transpose()
    }
}

/// The hash of a row: over name, type, length and bytes of each column that is not null, sorted by name.
pub(super) fn hash_of_row(row: &SqliteRow) -> StoreResult<String> {
    let mut columns: Vec<(&str, usize)> =
        row.columns().iter().map(|c| (c.name(), c.ordinal())).filter(|(name, _)| !name.starts_with(JOINT)).collect();
    columns.sort_unstable();
    let mut hash = Sha256::new();
    for (name, place) in columns {
        let raw = row.try_get_raw(place)?;
        if raw.is_null() {
            continue;
        }
        let kind = raw.type_info().name().to_owned();
        let bytes: &[u8] = match kind.as_str() {
            "INTEGER" | "BOOLEAN" => &row.try_get::<i64, _>(place)?.to_be_bytes(),
            "REAL" => &row.try_get::<f64, _>(place)?.to_bits().to_be_bytes(),
            // Read as bytes, because damaged text may not be valid UTF-8.
            _ => row.try_get_unchecked::<&[u8], _>(place)?,
        };
        hash.update(format!("{name}\n{kind}\n{}\n", bytes.len()));
        hash.update(bytes);
    }
    Ok(hex::encode(hash.finalize()))
}
