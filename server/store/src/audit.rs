//! The audit trail: who did what, when and why, as a chain of hashes that detects later changes.

use super::{Connection, Instant, StoreResult, UserId, json_columns, now};
use serde_json::{Value, json};
use sqlx::Row;
use sqlx::sqlite::SqliteRow;

/// Hash before the first row.
pub(super) const ORIGIN: &str = "0000000000000000000000000000000000000000000000000000000000000000";
/// Number of rows read at a time during verification.
const BATCH: i64 = 1000;

/// Actor of a change: a user, a token, or the service itself.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Actor {
    text: String,
    user: Option<UserId>,
}

impl Actor {
    /// Prefix of the text of a token. The text of a user starts with the role.
    pub const OF_TOKENS: &str = "token ";

    /// Whether the text of an actor denotes a token.
    pub fn is_token(text: &str) -> bool {
        text.starts_with(Self::OF_TOKENS)
    }

    /// The program itself.
    pub fn program() -> Self {
        Self::named(concat!("gaitwright ", env!("CARGO_PKG_VERSION")))
    }

    /// The command line.
    pub fn terminal() -> Self {
        Self::named("command line")
    }

    /// A caller who is not signed in.
    pub fn anonymous() -> Self {
        Self::named("an anonymous visitor")
    }

    /// An actor with this text.
    pub fn named(name: &str) -> Self {
        Self { text: name.chars().take(120).collect(), user: None }
    }

    /// A user.
    pub fn user(id: UserId, name: &str) -> Self {
        Self { user: Some(id), ..Self::named(name) }
    }

    /// The user, if it is one.
    pub fn user_id(&self) -> Option<UserId> {
        self.user
    }

    /// The text in the record.
    pub fn as_str(&self) -> &str {
        &self.text
    }
}

/// Row of the audit trail.
#[derive(Debug, Clone, PartialEq)]
pub struct AuditRow {
    /// Sequence number.
    pub seq: i64,
    /// Time of the change.
    pub created_at: Instant,
    /// Actor of the change.
    pub actor: String,
    /// Kind of change, such as `subject.add` or `study.pause`.
    pub change: String,
    /// Changed object, such as `study 0190...`.
    pub object: String,
    /// Details of the change, with the reason if there is one.
    pub detail: Value,
    /// Hash of the previous row.
    pub previous: String,
    /// Hash over this row and the hash of the previous row.
    pub hash: String,
}

/// Appends a row within the transaction of the change.
///
/// # Errors
/// Errors of the database.
pub async fn append(db: &mut Connection, actor: &Actor, change: &str, object: &str, detail: &Value) -> StoreResult<()> {
    let last = sqlx::query("select hash from audit order by seq desc limit 1").fetch_optional(&mut *db).await?;
    let previous: String = match last {
        Some(row) => row.try_get(0)?,
        None => ORIGIN.to_owned(),
    };
    let created_at = now();
    let hash = hash(&previous, &created_at.to_string(), actor.as_str(), change, object, detail);
    sqlx::query(
        "insert into audit (created_at, actor, change, object, detail, previous, hash) values (?, ?, ?, ?, ?, ?, ?)",
    )
    .bind(created_at)
    .bind(actor.as_str())
    .bind(change)
    .bind(object)
    .bind(json_columns::to_text("audit detail", detail)?)
    .bind(previous)
    .bind(hash)
    .execute(db)
    .await?;
    Ok(())
}

/// At most `limit` rows before `before`, newest first: those that contain a text in actor, change, object or detail. The
/// change is found in its own spelling (`lab_session.plan`) and in that of the page (`lab session: plan`).
///
/// # Errors
/// Errors of the database.
pub async fn page(db: &mut Connection, contains: &str, before: Option<i64>, limit: u32) -> StoreResult<Vec<AuditRow>> {
    let rows = sqlx::query(
        "select * from audit where (?1 is null or seq < ?1)
             and (?2 = '' or instr(lower(actor || ' ' || change || ' ' || replace(replace(change, '_', ' '), '.', ': ')
                 || ' ' || object || ' ' || detail), lower(?2)) > 0)
         order by seq desc limit ?3",
    )
    .bind(before)
    .bind(contains)
    .bind(limit)
    .fetch_all(db)
    .await?;
    rows.iter().map(from_row).collect()
}

/// Time of the newest row.
pub(super) async fn newest(db: &mut Connection) -> StoreResult<Option<Instant>> {
    Ok(sqlx::query_scalar("select created_at from audit order by seq desc limit 1").fetch_optional(db).await?)
}

/// The rows of an object, oldest first.
///
/// # Errors
/// Errors of the database.
pub async fn of_object(db: &mut Connection, object: &str) -> StoreResult<Vec<AuditRow>> {
    let rows = sqlx::query("select * from audit where object = ? order by seq").bind(object).fetch_all(db).await?;
    rows.iter().map(from_row).collect()
}

/// The result of verifying the chain.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum ChainCheck {
    /// Every row matches its hash and the previous row.
    Intact {
        /// Number of rows.
        rows: u64,
        /// Hash of the last row.
        last: String,
    },
    /// A row does not match.
    Broken {
        /// Sequence number of the row.
        seq: i64,
    },
}

/// Verifies the whole chain.
///
/// # Errors
/// Errors of the database.
pub async fn verify(db: &mut Connection) -> StoreResult<ChainCheck> {
    let (mut rows, mut last, mut after) = (0_u64, ORIGIN.to_owned(), 0_i64);
    loop {
        let batch = sqlx::query("select * from audit where seq > ? order by seq limit ?")
            .bind(after)
            .bind(BATCH)
            .fetch_all(&mut *db)
            .await?;
        if batch.is_empty() {
            break;
        }
        for raw in &batch {
            let seq: i64 = raw.try_get("seq")?;
            // An unreadable row was not written by this program.
            let Ok(row) = from_row(raw) else { return Ok(ChainCheck::Broken { seq }) };
            let created_at: String = raw.try_get("created_at")?;
            let expected = hash(&last, &created_at, &row.actor, &row.change, &row.object, &row.detail);
            // Rows are never deleted, so the numbers have no gaps.
            if seq != after + 1 || row.previous != last || row.hash != expected {
                return Ok(ChainCheck::Broken { seq });
            }
            (rows, last, after) = (rows + 1, row.hash, seq);
        }
    }
    // SQLite keeps the largest number ever used.
    if last_ever(db, "audit").await? != after {
        return Ok(ChainCheck::Broken { seq: after + 1 });
    }
    Ok(ChainCheck::Intact { rows, last })
}

/// The largest sequence number that a table has ever used, even if the row was deleted.
pub(super) async fn last_ever(db: &mut Connection, table: &str) -> StoreResult<i64> {
    let last = sqlx::query_scalar("select seq from sqlite_sequence where name = ?");
    Ok(last.bind(table).fetch_optional(db).await?.unwrap_or(0))
}

/// The hash of a row and the previous one, over a JSON object with sorted keys.
fn hash(previous: &str, created_at: &str, actor: &str, change: &str, object: &str, detail: &Value) -> String {
    let whole = json!({
        "actor": actor,
        "change": change,
        "created_at": created_at,
        "detail": detail,
        "object": object,
        "previous": previous,
    });
    json_columns::sha256(whole.to_string().as_bytes())
}

fn from_row(row: &SqliteRow) -> StoreResult<AuditRow> {
    Ok(AuditRow {
        seq: row.try_get("seq")?,
        created_at: row.try_get("created_at")?,
        actor: row.try_get("actor")?,
        change: row.try_get("change")?,
        object: row.try_get("object")?,
        detail: json_columns::column(row, "detail")?,
        previous: row.try_get("previous")?,
        hash: row.try_get("hash")?,
    })
}
