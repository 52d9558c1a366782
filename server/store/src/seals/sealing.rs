//! Seals the rows that a change wrote, before it is committed.

use super::super::audit::ORIGIN;
use super::super::{Connection, StoreError, StoreResult, json_columns};
use super::row_hash::hash_of_row;
use super::tables::{CHECKED, Sealed, TABLES, present};
use super::triggers::{RowEvent, watch_migrations};
use super::{JOINT, chained};
use futures_util::TryStreamExt;
use sqlx::{AssertSqlSafe, Row};
use std::collections::{BTreeMap, HashMap, HashSet};

/// Seals the rows of tables that did not exist `before` the migrations of the current transaction. Existing rows are
/// sealed nowhere else.
pub(in super::super) async fn adopt(db: &mut Connection, before: &[Sealed]) -> StoreResult<()> {
    watch_migrations(db).await?;
    let added = present(db).await?.into_iter().filter(|sealed| !before.iter().any(|known| known.table == sealed.table));
    for sealed in added {
        let (table, key) = (sealed.table, sealed.key_of(&format!("{}.", sealed.table)));
        let all = format!("insert into unsealed (table_name, key) select '{table}', {key} from {table}");
        sqlx::query(AssertSqlSafe(all)).execute(&mut *db).await?;
    }
    seal(db).await
}

/// The error for a row that differs from its seal or its checksum, or that has none, or that is missing.
pub(in super::super) fn touched(table: &str, key: &str) -> StoreError {
    let reason = format!("row {key} of {table} was changed, added or deleted outside the program");
    StoreError::Damaged { what: "seals", reason }
}

/// A row that a change touched, as it was before.
struct ChangedRow {
    table: String,
    key: String,
    event: String,
    known: Option<String>,
}

/// Seals the changed rows.
///
/// # Errors
/// [`StoreError::Damaged`] if another program had changed, added or deleted one of these rows before.
pub(in super::super) async fn seal(db: &mut Connection) -> StoreResult<()> {
    // A single query, because every change waits for it.
    let changed = "select place, table_name, key, event, known, (select hash from seals order by seq desc limit 1) \
                 from unsealed order by place";
    let changed = sqlx::query(changed).fetch_all(&mut *db).await?;
    let Some(first) = changed.first() else { return Ok(()) };
    let mut previous: String = first.try_get::<Option<String>, _>(5)?.unwrap_or_else(|| ORIGIN.to_owned());
    let mut rows: Vec<ChangedRow> = Vec::new();
    let mut places = HashMap::<(&str, &str), usize>::new();
    let mut deleted = HashSet::new();
    // The tables with old rows, each with the places of those that another change wrote.
    let mut old_rows = BTreeMap::<String, HashSet<i64>>::new();
    for row in &changed {
        let (table, key, event): (&str, &str, &str) = (row.try_get(1)?, row.try_get(2)?, row.try_get(3)?);
        let has_old_row = event == RowEvent::Update.name() || event == RowEvent::Delete.name();
        let at = *places.entry((table, key)).or_insert(rows.len());
        if has_old_row {
            let places = old_rows.entry(table.to_owned()).or_default();
            if at == rows.len() {
                places.insert(row.try_get(0)?);
            }
        }
        if at == rows.len() {
            let (table, key, event) = (table.to_owned(), key.to_owned(), event.to_owned());
            rows.push(ChangedRow { table, key, event, known: row.try_get(4)? });
        }
        // The last event of a row decides whether it was deleted.
        if event == RowEvent::Delete.name() {
            deleted.insert(at)
        } else {
            deleted.remove(&at)
        };
    }
    refuse_touched(db, &rows, &old_rows).await?;
    let mut keys = BTreeMap::<&str, Vec<&str>>::new();
    for (at, ChangedRow { table, key, .. }) in rows.iter().enumerate() {
        if !deleted.contains(&at) {
            keys.entry(table).or_default().push(key);
        }
    }
    let mut hashes = HashMap::new();
    for (table, keys) in keys {
        if let Some(sealed) = TABLES.iter().chain(CHECKED).find(|sealed| sealed.table == table) {
            hashes.insert(table, sealed.hashes_of(db, &keys).await?);
        }
    }
    let (mut seals, mut checksums) = (Vec::new(), Vec::new());
    for ChangedRow { table, key, .. } in &rows {
        let sha256 = hashes.get(table.as_str()).and_then(|of_table| of_table.get(key));
        if TABLES.iter().any(|sealed| sealed.table == table) {
            let sha256 = sha256.map_or("", String::as_str);
            let hash = chained(&previous, table, key, sha256);
            seals.push([table.clone(), key.clone(), sha256.to_owned(), previous, hash.clone()]);
            previous = hash;
        } else if let Some(sha256) = sha256 {
            checksums.push([table, key, sha256]);
        }
    }
    if !seals.is_empty() {
        let sql = "insert into seals (table_name, key, sha256, previous, hash) \
                   select value ->> 0, value ->> 1, value ->> 2, value ->> 3, value ->> 4 from json_each(?) order by key";
        sqlx::query(sql).bind(json_columns::to_text("seals", &seals)?).execute(&mut *db).await?;
    }
    if !checksums.is_empty() {
        let sql = "insert or replace into checksums (table_name, key, sha256) \
                   select value ->> 0, value ->> 1, value ->> 2 from json_each(?)";
        sqlx::query(sql).bind(json_columns::to_text("checksums", &checksums)?).execute(&mut *db).await?;
    }
    sqlx::query("delete from unsealed").execute(db).await?;
    Ok(())
}

/// Refuses a change of rows that were not whole before it.
async fn refuse_touched(
    db: &mut Connection,
    changed: &[ChangedRow],
    old_rows: &BTreeMap<String, HashSet<i64>>,
) -> StoreResult<()> {
    // A seal or a checksum of a row that was not there: it was deleted outside the program.
    let was_there = |row: &&ChangedRow| row.known.as_ref().is_some_and(|known| !known.is_empty());
    if let Some(row) = changed.iter().filter(|row| row.event == RowEvent::Insert.name()).find(was_there) {
        return Err(touched(&row.table, &row.key));
    }
    for (table, firsts) in old_rows {
        let Some(sealed) = TABLES.iter().chain(CHECKED).find(|sealed| sealed.table == table) else { continue };
        if let Some(key) = sealed.old_row_unlike(db, firsts).await? {
            return Err(touched(table, &key));
        }
    }
    Ok(())
}

impl Sealed {
    /// The key of an old row that differs from the hash that the record had of it. Only the first note of a row in a
    /// change counts, because later ones have rows that this program wrote.
    async fn old_row_unlike(&self, db: &mut Connection, firsts: &HashSet<i64>) -> StoreResult<Option<String>> {
        let sql = format!(
            "select o.*, n.known as \"{JOINT}known\", n.key as \"{JOINT}key\" from {} o \
             join unsealed n on n.place = o.\"{JOINT}place\"",
            self.old_rows()
        );
        let mut rows = sqlx::query(AssertSqlSafe(sql)).fetch(&mut *db);
        while let Some(row) = rows.try_next().await? {
            let known: Option<&str> = row.try_get(format!("{JOINT}known").as_str())?;
            if firsts.contains(&row.try_get::<i64, _>(0)?) && known != Some(hash_of_row(&row)?.as_str()) {
                return Ok(Some(row.try_get(format!("{JOINT}key").as_str())?));
            }
        }
        drop(rows);
        sqlx::query(AssertSqlSafe(format!("delete from {}", self.old_rows()))).execute(db).await?;
        Ok(None)
    }
}
