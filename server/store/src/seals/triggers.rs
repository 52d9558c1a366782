//! Temporary triggers of the writing connection, which note the rows that a change writes.

use super::super::{Connection, StoreResult};
use super::JOINT;
use super::tables::{Sealed, present};
use sqlx::AssertSqlSafe;

/// The change of a row that a trigger noted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum RowEvent {
    Insert,
    Update,
    Delete,
}

impl RowEvent {
    pub(super) const ALL: [Self; 3] = [Self::Insert, Self::Update, Self::Delete];
    /// A row that a migration wrote. The record was verified in the same transaction, before the migrations.
    pub(super) const MIGRATED: &str = "migrated";

    pub(super) const fn name(self) -> &'static str {
        match self {
            Self::Insert => "insert",
            Self::Update => "update",
            Self::Delete => "delete",
        }
    }
}

impl Sealed {
    /// The temporary table of the old rows of one change.
    pub(super) fn old_rows(&self) -> String {
        format!("old_{}", self.table)
    }

    /// SQL of the trigger that notes rows touched by `event`, and keeps the old ones in these columns. Deleting a row
    /// deletes its checksum immediately, because many rows are pruned together.
    fn trigger(&self, event: RowEvent, keep: Option<&[String]>) -> String {
        let (table, name) = (self.table, event.name());
        let key = self.key_of(if event == RowEvent::Delete { "old." } else { "new." });
        let (written, known) = match keep {
            Some(_) => (name, self.known_hash(&key)),
            None => (RowEvent::MIGRATED, "null".to_owned()),
        };
        let note = "insert into unsealed (table_name, key, event, known)";
        let mut statements = vec![format!("{note} values ('{table}', {key}, '{written}', {known});")];
        if let Some(columns) = keep.filter(|_| event != RowEvent::Insert) {
            let old: Vec<String> = columns.iter().map(|column| format!("old.\"{column}\"")).collect();
            let place = "(select max(place) from unsealed)";
            statements.push(format!("insert into {} values ({place}, {});", self.old_rows(), old.join(", ")));
        }
        if event != RowEvent::Insert && self.is_checked() {
            let old = self.key_of("old.");
            statements.push(format!("delete from checksums where table_name = '{table}' and key = {old};"));
        }
        let statements = statements.join(" ");
        format!(
            "create temp trigger if not exists {table}_after_{name} after {name} on main.{table} begin {statements} end"
        )
    }
}

/// Installs the triggers on a connection.
pub(in super::super) async fn watch(db: &mut Connection) -> StoreResult<()> {
    for sealed in present(db).await? {
        // As `select *`, which has hidden columns neither.
        let columns = "select name from pragma_table_xinfo(?) where hidden <> 1 order by cid";
        let columns: Vec<String> = sqlx::query_scalar(columns).bind(sealed.table).fetch_all(&mut *db).await?;
        let names: Vec<String> = columns.iter().map(|column| format!("\"{column}\"")).collect();
        // Columns without a type keep every value as it is.
        let old_rows =
            format!("create temp table if not exists {} (\"{JOINT}place\", {})", sealed.old_rows(), names.join(", "));
        sqlx::query(AssertSqlSafe(old_rows)).execute(&mut *db).await?;
        install(db, sealed, Some(&columns)).await?;
    }
    Ok(())
}

/// Installs triggers that keep no old rows, because migrations change their columns.
pub(in super::super) async fn watch_migrations(db: &mut Connection) -> StoreResult<()> {
    for sealed in present(db).await? {
        install(db, sealed, None).await?;
    }
    Ok(())
}

/// Removes the triggers of [`watch_migrations`].
pub(in super::super) async fn end_watch(db: &mut Connection) -> StoreResult<()> {
    let names = "select name from sqlite_temp_master where type = 'trigger'";
    let names: Vec<String> = sqlx::query_scalar(names).fetch_all(&mut *db).await?;
    for name in names {
        sqlx::query(AssertSqlSafe(format!("drop trigger temp.{name}"))).execute(&mut *db).await?;
    }
    Ok(())
}

async fn install(db: &mut Connection, sealed: Sealed, keep: Option<&[String]>) -> StoreResult<()> {
    // Seals follow the order of writing. `known` is the hash that the record has of the row at that time.
    let notes = "create temp table if not exists unsealed (place integer primary key, table_name text not null, \
                 key text not null, event text not null default 'migrated', known text)";
    sqlx::query(notes).execute(&mut *db).await?;
    for event in RowEvent::ALL {
        sqlx::query(AssertSqlSafe(sealed.trigger(event, keep))).execute(&mut *db).await?;
    }
    Ok(())
}
