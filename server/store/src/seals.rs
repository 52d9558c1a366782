//! Seals: a chained hash of each row, which detects rows that another program changed, added or deleted. Rows that
//! change often, such as leases, have a replaceable checksum instead, so that the chain does not grow with them.
//!
//! Temporary triggers of the writing connection note which rows a change writes, and the rows are sealed before the
//! commit. So no code can forget a seal, and writes of other programs get none. The triggers also keep the old row of
//! an update or a deletion: it must match its seal, so that the program never seals what another program wrote.

use super::audit::ORIGIN;
use super::{Connection, StoreError, StoreResult, json};
use futures_util::TryStreamExt;
use sha2::{Digest, Sha256};
use sqlx::sqlite::SqliteRow;
use sqlx::{AssertSqlSafe, Column, Row, TypeInfo, ValueRef};
use std::collections::{BTreeMap, HashMap, HashSet};

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
    sealed("assessments", &["id"]),
    sealed("assessment_retractions", &["assessment_id"]),
    sealed("safety_reports", &["id"]),
    sealed("safety_reviews", &["id"]),
    sealed("safety_review_reports", &["review_id", "report_id"]),
    sealed("lab_sessions", &["id"]),
    sealed("lab_allocations", &["session_id"]),
    sealed("lab_device_files", &["id"]),
    sealed("lab_acts", &["session_id", "act"]),
    sealed("lab_answers", &["session_id", "number"]),
    sealed("lab_answer_retractions", &["session_id", "number"]),
    sealed("measurement_files", &["id"]),
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

/// Tables of earlier schema versions, each with the table to which a migration copied its rows under the same keys. Their
/// seals stay in the chain, before those of the copies.
const RETIRED: &[(Sealed, &str)] = &[
    (sealed("remarks", &["id"]), "assessments"),
    (sealed("remark_retractions", &["remark_id"]), "assessment_retractions"),
    (sealed("lab_recordings", &["id"]), "measurement_files"),
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

/// What a trigger saw of a row.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Event {
    Insert,
    Update,
    Delete,
}

impl Event {
    const ALL: [Self; 3] = [Self::Insert, Self::Update, Self::Delete];
    /// A row that a migration wrote. The record was verified in the same transaction, before the migrations.
    const MIGRATED: &str = "migrated";

    const fn name(self) -> &'static str {
        match self {
            Self::Insert => "insert",
            Self::Update => "update",
            Self::Delete => "delete",
        }
    }
}

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

    /// The temporary table of the old rows of one change.
    fn old_rows(&self) -> String {
        format!("old_{}", self.table)
    }

    /// SQL for the hash that the record has of a row: its newest seal or its checksum.
    fn known_hash(&self, key: &str) -> String {
        let table = self.table;
        if self.is_checked() {
            format!("(select c.sha256 from checksums c where c.evidence = '{table}' and c.key = cast({key} as text))")
        } else {
            format!(
                "(select s.sha256 from seals s where s.evidence = '{table}' and s.key = cast({key} as text) \
                 order by s.seq desc limit 1)"
            )
        }
    }

    /// SQL of the trigger that notes rows touched by `event`, and keeps the old ones in these columns. Deleting a row
    /// deletes its checksum immediately, because many rows are pruned together.
    fn trigger(&self, event: Event, keep: Option<&[String]>) -> String {
        let (table, name) = (self.table, event.name());
        let key = self.key_of(if event == Event::Delete { "old." } else { "new." });
        let (noted, known) = match keep {
            Some(_) => (name, self.known_hash(&key)),
            None => (Event::MIGRATED, "null".to_owned()),
        };
        let note = "insert into unsealed (evidence, key, event, known)";
        let mut acts = vec![format!("{note} values ('{table}', {key}, '{noted}', {known});")];
        if let Some(columns) = keep.filter(|_| event != Event::Insert) {
            let old: Vec<String> = columns.iter().map(|column| format!("old.\"{column}\"")).collect();
            let place = "(select max(place) from unsealed)";
            acts.push(format!("insert into {} values ({place}, {});", self.old_rows(), old.join(", ")));
        }
        if event != Event::Insert && self.is_checked() {
            let old = self.key_of("old.");
            acts.push(format!("delete from checksums where evidence = '{table}' and key = {old};"));
        }
        let acts = acts.join(" ");
        format!("create temp trigger if not exists {table}_after_{name} after {name} on main.{table} begin {acts} end")
    }

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

    /// The hashes of the current rows with these keys. Deleted rows have none.
    async fn hashes_of(&self, db: &mut Connection, keys: &[&str]) -> StoreResult<HashMap<String, String>> {
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
        let mut rows = sqlx::query(AssertSqlSafe(sql)).bind(json::to_text("keys", &keys)?).fetch(db);
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

    /// A column of a key.
    fn part(&self, part: &str) -> String {
        let text = hex::decode(part).ok().and_then(|bytes| String::from_utf8(bytes).ok());
        text.filter(|_| self.hex).unwrap_or_else(|| part.to_owned())
    }
}

/// SQL for the hash in the newest seal of a row; `None` if the table has no seals.
pub(super) fn newest_of(table: &str) -> Option<String> {
    let sealed = TABLES.iter().find(|sealed| sealed.table == table)?;
    Some(sealed.known_hash(&sealed.key_of(&format!("{table}."))))
}

/// Installs the triggers on a connection.
pub(super) async fn watch(db: &mut Connection) -> StoreResult<()> {
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
pub(super) async fn watch_migrations(db: &mut Connection) -> StoreResult<()> {
    for sealed in present(db).await? {
        install(db, sealed, None).await?;
    }
    Ok(())
}

/// Removes the triggers of [`watch_migrations`].
pub(super) async fn end_watch(db: &mut Connection) -> StoreResult<()> {
    let names = "select name from sqlite_temp_master where type = 'trigger'";
    let names: Vec<String> = sqlx::query_scalar(names).fetch_all(&mut *db).await?;
    for name in names {
        sqlx::query(AssertSqlSafe(format!("drop trigger temp.{name}"))).execute(&mut *db).await?;
    }
    Ok(())
}

async fn install(db: &mut Connection, sealed: Sealed, keep: Option<&[String]>) -> StoreResult<()> {
    // Seals follow the order of writing. `known` is the hash that the record has of the row at that time.
    let notes = "create temp table if not exists unsealed (place integer primary key, evidence text not null, \
                 key text not null, event text not null default 'migrated', known text)";
    sqlx::query(notes).execute(&mut *db).await?;
    for event in Event::ALL {
        sqlx::query(AssertSqlSafe(sealed.trigger(event, keep))).execute(&mut *db).await?;
    }
    Ok(())
}

/// The existing tables whose rows have seals or checksums.
pub(super) async fn present(db: &mut Connection) -> StoreResult<Vec<Sealed>> {
    let names: Vec<String> =
        sqlx::query_scalar("select name from sqlite_master where type = 'table'").fetch_all(db).await?;
    let is_there = |table: &str| names.iter().any(|name| name == table);
    let sealed = TABLES.iter().chain(RETIRED.iter().map(|(retired, _)| retired)).filter(|_| is_there("seals"));
    let all = sealed.chain(CHECKED.iter().filter(|_| is_there("checksums")));
    Ok(all.filter(|sealed| is_there(sealed.table)).copied().collect())
}

/// Seals the rows of tables that did not exist `before` the migrations of the current transaction. Existing rows are
/// sealed nowhere else.
pub(super) async fn adopt(db: &mut Connection, before: &[Sealed]) -> StoreResult<()> {
    watch_migrations(db).await?;
    let added = present(db).await?.into_iter().filter(|sealed| !before.iter().any(|known| known.table == sealed.table));
    for sealed in added {
        let (table, key) = (sealed.table, sealed.key_of(&format!("{}.", sealed.table)));
        let all = format!("insert into unsealed (evidence, key) select '{table}', {key} from {table}");
        sqlx::query(AssertSqlSafe(all)).execute(&mut *db).await?;
    }
    seal(db).await
}

/// The error for a row that differs from its seal or its checksum, or that has none, or that is missing.
pub(super) fn touched(table: &str, key: &str) -> StoreError {
    let reason = format!("row {key} of {table} was changed, added or deleted outside the program");
    StoreError::Damaged { what: "evidence", reason }
}

/// A row that a change touched, as it was first noted.
struct Noted {
    table: String,
    key: String,
    event: String,
    known: Option<String>,
}

/// Seals the noted rows.
///
/// # Errors
/// [`StoreError::Damaged`] if another program had changed, added or deleted one of these rows before.
pub(super) async fn seal(db: &mut Connection) -> StoreResult<()> {
    // A single query, because every change waits for it.
    let noted = "select place, evidence, key, event, known, (select hash from seals order by seq desc limit 1) \
                 from unsealed order by place";
    let noted = sqlx::query(noted).fetch_all(&mut *db).await?;
    let Some(first) = noted.first() else { return Ok(()) };
    let mut previous: String = first.try_get::<Option<String>, _>(5)?.unwrap_or_else(|| ORIGIN.to_owned());
    let mut rows: Vec<Noted> = Vec::new();
    let mut places = HashMap::<(&str, &str), usize>::new();
    let mut deleted = HashSet::new();
    // The tables with old rows, each with the places of those that another change wrote.
    let mut old_rows = BTreeMap::<String, HashSet<i64>>::new();
    for row in &noted {
        let (table, key, event): (&str, &str, &str) = (row.try_get(1)?, row.try_get(2)?, row.try_get(3)?);
        let has_old_row = event == Event::Update.name() || event == Event::Delete.name();
        let at = *places.entry((table, key)).or_insert(rows.len());
        if has_old_row {
            let places = old_rows.entry(table.to_owned()).or_default();
            if at == rows.len() {
                places.insert(row.try_get(0)?);
            }
        }
        if at == rows.len() {
            let (table, key, event) = (table.to_owned(), key.to_owned(), event.to_owned());
            rows.push(Noted { table, key, event, known: row.try_get(4)? });
        }
        // What became of a row at last.
        if event == Event::Delete.name() {
            deleted.insert(at)
        } else {
            deleted.remove(&at)
        };
    }
    refuse_touched(db, &rows, &old_rows).await?;
    let mut keys = BTreeMap::<&str, Vec<&str>>::new();
    for (at, Noted { table, key, .. }) in rows.iter().enumerate() {
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
    for Noted { table, key, .. } in &rows {
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
        let sql = "insert into seals (evidence, key, sha256, previous, hash) \
                   select value ->> 0, value ->> 1, value ->> 2, value ->> 3, value ->> 4 from json_each(?) order by key";
        sqlx::query(sql).bind(json::to_text("seals", &seals)?).execute(&mut *db).await?;
    }
    if !checksums.is_empty() {
        let sql = "insert or replace into checksums (evidence, key, sha256) \
                   select value ->> 0, value ->> 1, value ->> 2 from json_each(?)";
        sqlx::query(sql).bind(json::to_text("checksums", &checksums)?).execute(&mut *db).await?;
    }
    sqlx::query("delete from unsealed").execute(db).await?;
    Ok(())
}

/// Refuses a change of rows that were not whole before it.
async fn refuse_touched(
    db: &mut Connection,
    noted: &[Noted],
    old_rows: &BTreeMap<String, HashSet<i64>>,
) -> StoreResult<()> {
    // A seal or a checksum of a row that was not there: it was deleted outside the program.
    let was_there = |row: &&Noted| row.known.as_ref().is_some_and(|known| !known.is_empty());
    if let Some(row) = noted.iter().filter(|row| row.event == Event::Insert.name()).find(was_there) {
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
        if let Some((key, without_seal)) = unlike(db, *sealed).await? {
            let table = sealed.table.to_owned();
            return Ok(if without_seal {
                SealCheck::Unsealed { table, key }
            } else {
                SealCheck::Touched { table, key }
            });
        }
    }
    let stray = match of_no_table(db, &known).await? {
        None => of_no_copy(db, &known).await?,
        found => found,
    };
    Ok(stray.map_or(chain, |(table, key)| SealCheck::Touched { table, key }))
}

/// A seal or checksum of an unknown table.
async fn of_no_table(db: &mut Connection, known: &[Sealed]) -> StoreResult<Option<(String, String)>> {
    let checksums =
        if known.iter().any(Sealed::is_checked) { "union all select evidence, key from checksums" } else { "" };
    let names = known.iter().chain(RETIRED.iter().map(|(retired, _)| retired));
    let names: Vec<String> = names.map(|sealed| format!("'{}'", sealed.table)).collect();
    let sql = format!(
        "select evidence, key from (select evidence, key from seals {checksums}) where evidence not in ({}) limit 1",
        names.join(", ")
    );
    Ok(sqlx::query_as(AssertSqlSafe(sql)).fetch_optional(db).await?)
}

/// A seal of a retired table that does not precede the seal of the copied row. The migration left no such seal.
async fn of_no_copy(db: &mut Connection, known: &[Sealed]) -> StoreResult<Option<(String, String)>> {
    for (retired, copy) in RETIRED {
        if known.iter().any(|sealed| sealed.table == retired.table) {
            continue;
        }
        let sql = "select evidence, key from seals s where evidence = ?1 and seq > coalesce(\
                   (select min(seq) from seals c where c.evidence = ?2 and c.key = s.key), 0) limit 1";
        let found = sqlx::query_as(sql).bind(retired.table).bind(copy).fetch_optional(&mut *db).await?;
        if found.is_some() {
            return Ok(found);
        }
    }
    Ok(None)
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

/// The key of a row that differs from the hash that the record has of it, and whether it has none; or the key of a hash
/// whose row is missing.
async fn unlike(db: &mut Connection, sealed: Sealed) -> StoreResult<Option<(String, bool)>> {
    let (table, key) = (sealed.table, sealed.key_of(&format!("{}.", sealed.table)));
    let hashes = if sealed.is_checked() {
        format!("select key from checksums where evidence = '{table}'")
    } else {
        format!(
            "select key from seals s where evidence = '{table}' and sha256 <> '' and not exists \
             (select 1 from seals n where n.evidence = s.evidence and n.key = s.key and n.seq > s.seq)"
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
