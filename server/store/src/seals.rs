//! Seals: a chained hash of each row, which detects rows that another program changed, added or deleted. Rows that
//! change often, such as leases, have a replaceable checksum instead, so that the chain does not grow with them.
//!
//! Temporary triggers of the writing connection note which rows a change writes, and the rows are sealed before the
//! commit. So no code can forget a seal, and writes of other programs get none.

use super::audit::ORIGIN;
use super::{Connection, StoreError, StoreResult, json};
use futures_util::TryStreamExt;
use sha2::{Digest, Sha256};
use sqlx::sqlite::SqliteRow;
use sqlx::{AssertSqlSafe, Column, Row, TypeInfo, ValueRef};

/// Number of seals read at a time during verification.
const BATCH: i64 = 1000;
/// Separator between the columns of a key.
const JOINT: char = '/';

/// A table whose rows are sealed.
#[derive(Debug, Clone, Copy)]
pub struct Sealed {
    /// Its name.
    pub table: &'static str,
    /// Its primary key.
    pub key: &'static [&'static str],
    /// Whether the columns of the key may contain any text, so that they are joined in hexadecimal.
    hex: bool,
}

const fn sealed(table: &'static str, key: &'static [&'static str]) -> Sealed {
    Sealed { table, key, hex: false }
}

/// Tables with seals: everything that was measured, answered, decided or permitted. A column that is added later must
/// be null in existing rows, or the rows must be written again.
pub const TABLES: &[Sealed] = &[
    sealed("subjects", &["id"]),
    sealed("consents", &["seq"]),
    sealed("subject_muscles", &["seq"]),
    sealed("subject_corrections", &["seq"]),
    sealed("devices", &["id"]),
    sealed("reference_gaits", &["id"]),
    sealed("studies", &["id"]),
    sealed("trials", &["id"]),
    sealed("gaits", &["trial_id"]),
    sealed("results", &["trial_id", "attempt"]),
    sealed("certificates", &["trial_id", "format_version"]),
    sealed("explanation_requests", &["trial_id"]),
    sealed("explanations", &["trial_id"]),
    sealed("feedback", &["seq"]),
    sealed("retractions", &["feedback_seq"]),
    sealed("presentations", &["id"]),
    sealed("presentation_answers", &["presentation_id"]),
    sealed("presentation_retractions", &["presentation_id"]),
    sealed("presentation_allocations", &["presentation_id"]),
    sealed("unblindings", &["seq"]),
    sealed("remarks", &["id"]),
    sealed("remark_retractions", &["remark_id"]),
    sealed("safety_reports", &["id"]),
    sealed("safety_reviews", &["id"]),
    sealed("lab_sessions", &["id"]),
    sealed("lab_allocations", &["session_id"]),
    sealed("lab_device_files", &["id"]),
    sealed("lab_acts", &["session_id", "act"]),
    sealed("lab_answers", &["session_id", "number"]),
    sealed("lab_answer_retractions", &["session_id", "number"]),
    sealed("lab_recordings", &["id"]),
    sealed("emg_results", &["id"]),
    sealed("users", &["id"]),
    sealed("tokens", &["id"]),
    sealed("study_members", &["id"]),
    sealed("study_member_ends", &["member_id"]),
    sealed("study_restrictions", &["seq"]),
    sealed("access_log", &["seq"]),
    sealed("access_prunings", &["seq"]),
    sealed("imports", &["seq"]),
];

/// Tables with checksums: their rows change often, or only repeat other data.
pub const CHECKED: &[Sealed] = &[
    sealed("events", &["seq"]),
    sealed("jobs", &["id"]),
    Sealed { table: "idempotency_keys", key: &["actor", "key"], hex: true },
    sealed("sessions", &["hash"]),
    sealed("sign_in_links", &["hash"]),
    sealed("clock", &["id"]),
    Sealed { table: "sign_in_failures", key: &["name", "source"], hex: true },
    sealed("sign_in_sources", &["network"]),
    sealed(MIGRATIONS, &["version"]),
];

/// Tables without either: the chains themselves, and the table of checksums.
pub const NOT_SEALED: &[&str] = &["audit", "seals", "checksums"];

/// The table of applied migrations.
const MIGRATIONS: &str = "_sqlx_migrations";

impl Sealed {
    /// SQL for the key of a row as text; `row` is `new.`, `old.`, or the table and a dot.
    fn key_of(&self, row: &str) -> String {
        let column = |column| if self.hex { format!("hex({row}{column})") } else { format!("{row}{column}") };
        let columns: Vec<String> = self.key.iter().map(column).collect();
        columns.join(&format!(" || '{JOINT}' || "))
    }

    fn is_checked(&self) -> bool {
        CHECKED.iter().any(|checked| checked.table == self.table)
    }

    /// SQL of the trigger that notes rows touched by `event` (such as `after insert`). Deleting a row deletes its
    /// checksum immediately, because many rows are pruned together.
    fn trigger(&self, event: &str) -> String {
        let (table, old, new) = (self.table, self.key_of("old."), self.key_of("new."));
        let forget = format!("delete from checksums where evidence = '{table}' and key = {old};");
        let note = |key: &str| format!("insert into unsealed (evidence, key) values ('{table}', {key});");
        let act = match event {
            "after delete" if self.is_checked() => forget,
            "after update" if self.is_checked() => forget + &note(&new),
            "after delete" => note(&old),
            _ => note(&new),
        };
        let name = format!("{table}_{}", event.replace(' ', "_"));
        format!("create temp trigger if not exists {name} {event} on main.{table} begin {act} end")
    }

    /// The hash of the current row; empty if it was deleted.
    async fn hash_of(&self, db: &mut Connection, key: &str) -> StoreResult<String> {
        let columns: Vec<String> = self.key.iter().map(|column| format!("{column} = ?")).collect();
        let sql = format!("select * from {} where {}", self.table, columns.join(" and "));
        let part = |part: &str| {
            let text = hex::decode(part).ok().and_then(|bytes| String::from_utf8(bytes).ok());
            text.filter(|_| self.hex).unwrap_or_else(|| part.to_owned())
        };
        let parts = key.splitn(self.key.len(), JOINT).map(part);
        let query = parts.fold(sqlx::query(AssertSqlSafe(sql)), sqlx::query::Query::bind);
        query.fetch_optional(db).await?.map_or(Ok(String::new()), |row| hash_of_row(&row))
    }
}

/// SQL for the hash in the newest seal of a row; `None` if the table has no seals.
pub(super) fn newest_of(table: &str) -> Option<String> {
    let sealed = TABLES.iter().find(|sealed| sealed.table == table)?;
    let key = sealed.key_of(&format!("{table}."));
    Some(format!(
        "(select s.sha256 from seals s where s.evidence = '{table}' and s.key = cast({key} as text) \
         order by s.seq desc limit 1)"
    ))
}

/// Installs the triggers on a connection.
pub(super) async fn watch(db: &mut Connection) -> StoreResult<()> {
    // Seals follow the order of writing.
    let notes = "create temp table if not exists unsealed \
                 (place integer primary key, evidence text not null, key text not null)";
    sqlx::query(notes).execute(&mut *db).await?;
    for sealed in present(db).await? {
        for event in ["after insert", "after update", "after delete"] {
            sqlx::query(AssertSqlSafe(sealed.trigger(event))).execute(&mut *db).await?;
        }
    }
    Ok(())
}

/// The existing tables whose rows have seals or checksums.
pub(super) async fn present(db: &mut Connection) -> StoreResult<Vec<Sealed>> {
    let names: Vec<String> =
        sqlx::query_scalar("select name from sqlite_master where type = 'table'").fetch_all(db).await?;
    let is_there = |table: &str| names.iter().any(|name| name == table);
    let all = TABLES.iter().filter(|_| is_there("seals")).chain(CHECKED.iter().filter(|_| is_there("checksums")));
    Ok(all.filter(|sealed| is_there(sealed.table)).copied().collect())
}

/// Seals the rows of tables that did not exist `before` the migrations of the current transaction. Existing rows are
/// sealed nowhere else.
pub(super) async fn adopt(db: &mut Connection, before: &[Sealed]) -> StoreResult<()> {
    watch(db).await?;
    let added = present(db).await?.into_iter().filter(|sealed| !before.iter().any(|known| known.table == sealed.table));
    for sealed in added {
        let (table, key) = (sealed.table, sealed.key_of(&format!("{}.", sealed.table)));
        let all = format!("insert into unsealed (evidence, key) select '{table}', {key} from {table}");
        sqlx::query(AssertSqlSafe(all)).execute(&mut *db).await?;
    }
    seal(db).await
}

/// Refuses a record with a row that has neither a seal nor a checksum, because this program did not write it.
pub(super) async fn refuse_unsealed(db: &mut Connection) -> StoreResult<()> {
    for sealed in present(db).await? {
        if let Some(key) = without_seal(db, sealed).await? {
            return Err(StoreError::Unsealed { table: sealed.table.to_owned(), key });
        }
    }
    Ok(())
}

/// Seals the noted rows.
pub(super) async fn seal(db: &mut Connection) -> StoreResult<()> {
    // A single query, because every change waits for it.
    let noted = "select evidence, key, (select hash from seals order by seq desc limit 1) from unsealed \
                 group by evidence, key order by min(place)";
    let noted = sqlx::query(noted).fetch_all(&mut *db).await?;
    let Some(first) = noted.first() else { return Ok(()) };
    let mut previous: String = first.try_get::<Option<String>, _>(2)?.unwrap_or_else(|| ORIGIN.to_owned());
    for row in &noted {
        let (table, key): (&str, &str) = (row.try_get(0)?, row.try_get(1)?);
        if let Some(checked) = CHECKED.iter().find(|checked| checked.table == table) {
            let sha256 = checked.hash_of(db, key).await?;
            if !sha256.is_empty() {
                let keep = sqlx::query("insert or replace into checksums (evidence, key, sha256) values (?, ?, ?)");
                keep.bind(table).bind(key).bind(sha256).execute(&mut *db).await?;
            }
            continue;
        }
        let Some(sealed) = TABLES.iter().find(|sealed| sealed.table == table) else { continue };
        let sha256 = sealed.hash_of(db, key).await?;
        let hash = chained(&previous, table, key, &sha256);
        sqlx::query("insert into seals (evidence, key, sha256, previous, hash) values (?, ?, ?, ?, ?)")
            .bind(table)
            .bind(key)
            .bind(sha256)
            .bind(previous)
            .bind(&hash)
            .execute(&mut *db)
            .await?;
        previous = hash;
    }
    sqlx::query("delete from unsealed").execute(db).await?;
    Ok(())
}

/// The result of verifying the seals.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum SealCheck {
    /// Every row matches its seal.
    Whole {
        /// Number of seals.
        seals: u64,
        /// Hash of the last seal.
        last: String,
    },
    /// The record has a schema version without seals.
    None,
    /// A seal does not match the previous one.
    Broken {
        /// Sequence number of the seal.
        seq: i64,
    },
    /// A row was changed, added or deleted outside the program.
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
    let table = "select name from sqlite_master where type = 'table' and name = 'seals'";
    if sqlx::query(table).fetch_optional(&mut *db).await?.is_none() {
        return Ok(SealCheck::None);
    }
    let chain = walk(db).await?;
    if !matches!(chain, SealCheck::Whole { .. }) {
        return Ok(chain);
    }
    let known = present(db).await?;
    for sealed in &known {
        let unlike = match without_seal(db, *sealed).await? {
            None if sealed.is_checked() => unlike_checksum(db, *sealed).await?,
            None => unlike_seal(db, *sealed).await?,
            found => found,
        };
        if let Some(key) = unlike {
            return Ok(SealCheck::Touched { table: sealed.table.to_owned(), key });
        }
    }
    Ok(match of_no_table(db, &known).await? {
        Some((table, key)) => SealCheck::Touched { table, key },
        None => chain,
    })
}

/// A seal or checksum of an unknown table.
async fn of_no_table(db: &mut Connection, known: &[Sealed]) -> StoreResult<Option<(String, String)>> {
    let checksums =
        if known.iter().any(Sealed::is_checked) { "union all select evidence, key from checksums" } else { "" };
    let names: Vec<String> = known.iter().map(|sealed| format!("'{}'", sealed.table)).collect();
    let sql = format!(
        "select evidence, key from (select evidence, key from seals {checksums}) where evidence not in ({}) limit 1",
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
            let (Ok(table), Ok(key), Ok(sha256)) = (text("evidence"), text("key"), text("sha256")) else {
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
    if super::audit::last_ever(db, "seals").await? != after {
        return Ok(SealCheck::Broken { seq: after + 1 });
    }
    Ok(SealCheck::Whole { seals: after.unsigned_abs(), last })
}

/// The key of a row without a seal.
async fn without_seal(db: &mut Connection, sealed: Sealed) -> StoreResult<Option<String>> {
    let (table, key) = (sealed.table, sealed.key_of(&format!("{}.", sealed.table)));
    let seals = if sealed.is_checked() { "checksums" } else { "seals" };
    let sql = format!(
        "select cast({key} as text) as k from {table} \
         where not exists (select 1 from {seals} where evidence = '{table}' and key = cast({key} as text)) limit 1"
    );
    Ok(sqlx::query_scalar(AssertSqlSafe(sql)).fetch_optional(db).await?)
}

/// The key of a row that differs from its checksum, or of a checksum without a row.
async fn unlike_checksum(db: &mut Connection, checked: Sealed) -> StoreResult<Option<String>> {
    let (table, key) = (checked.table, checked.key_of(&format!("{}.", checked.table)));
    let gone = format!(
        "select key from checksums where evidence = '{table}' except select cast({key} as text) from {table} limit 1"
    );
    if let Some(key) = sqlx::query_scalar(AssertSqlSafe(gone)).fetch_optional(&mut *db).await? {
        return Ok(Some(key));
    }
    let sql = format!(
        "select {table}.*, k.key as \"{JOINT}key\", k.sha256 as \"{JOINT}sha256\" from {table} \
         join checksums k on k.evidence = '{table}' and k.key = cast({key} as text)"
    );
    let mut rows = sqlx::query(AssertSqlSafe(sql)).fetch(db);
    while let Some(row) = rows.try_next().await? {
        if hash_of_row(&row)? != row.try_get::<&str, _>(format!("{JOINT}sha256").as_str())? {
            return Ok(Some(row.try_get(format!("{JOINT}key").as_str())?));
        }
    }
    Ok(None)
}

/// The key of a row that differs from its newest seal.
async fn unlike_seal(db: &mut Connection, sealed: Sealed) -> StoreResult<Option<String>> {
    let mut after = 0_i64;
    loop {
        let batch = sqlx::query(
            "select seq, key, sha256 from seals s where evidence = ? and seq > ? and not exists \
             (select 1 from seals n where n.evidence = s.evidence and n.key = s.key and n.seq > s.seq) \
             order by seq limit ?",
        )
        .bind(sealed.table)
        .bind(after)
        .bind(BATCH)
        .fetch_all(&mut *db)
        .await?;
        let Some(last) = batch.last() else { return Ok(None) };
        after = last.try_get("seq")?;
        for row in &batch {
            let key: String = row.try_get("key")?;
            if sealed.hash_of(db, &key).await? != row.try_get::<&str, _>("sha256")? {
                return Ok(Some(key));
            }
        }
    }
}

/// The hash of a seal and the previous one.
fn chained(previous: &str, table: &str, key: &str, sha256: &str) -> String {
    // Only the key can contain a line break, so it comes last.
    json::sha256(format!("{previous}\n{sha256}\n{table}\n{key}").as_bytes())
}

/// The hash of a row: over name, type, length and bytes of each column that is not null, sorted by name.
fn hash_of_row(row: &SqliteRow) -> StoreResult<String> {
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
        let bytes = match kind.as_str() {
            "INTEGER" | "BOOLEAN" => row.try_get::<i64, _>(place)?.to_be_bytes().to_vec(),
            "REAL" => row.try_get::<f64, _>(place)?.to_bits().to_be_bytes().to_vec(),
            // Read as bytes, because damaged text may not be valid UTF-8.
            _ => row.try_get_unchecked::<Vec<u8>, _>(place)?,
        };
        hash.update(format!("{name}\n{kind}\n{}\n", bytes.len()));
        hash.update(bytes);
    }
    Ok(hex::encode(hash.finalize()))
}
