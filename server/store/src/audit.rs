//! The audit trail: who did what, when and why, chained by hashes so that a change of the past is found.

use super::{Connection, Instant, StoreResult, UserId, json, now};
use serde::Serialize;
use serde_json::{Value, json};
use sqlx::Row;
use sqlx::sqlite::SqliteRow;
use utoipa::ToSchema;

/// Hash before the first row.
pub(super) const ORIGIN: &str = "0000000000000000000000000000000000000000000000000000000000000000";
/// Rows read at a time when the chain is walked.
const BATCH: i64 = 1000;

/// Who acts.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Actor {
    text: String,
    user: Option<UserId>,
}

impl Actor {
    /// How the text of a token begins; that of a user begins with the role.
    pub const OF_TOKENS: &str = "token ";

    /// Whether the text of an actor is that of a token.
    pub fn is_token(text: &str) -> bool {
        text.starts_with(Self::OF_TOKENS)
    }

    /// The program itself.
    pub fn program() -> Self {
        Self::named(concat!("gaitwright ", env!("CARGO_PKG_VERSION")))
    }

    /// Whoever runs the command line.
    pub fn terminal() -> Self {
        Self::named("command line")
    }

    /// Whoever reaches the service without signing in.
    pub fn anonymous() -> Self {
        Self::named("not signed in")
    }

    /// Somebody with a name.
    pub fn named(name: &str) -> Self {
        Self { text: name.chars().take(120).collect(), user: None }
    }

    /// A user.
    pub fn user(id: UserId, name: &str) -> Self {
        Self { user: Some(id), ..Self::named(name) }
    }

    /// Which user it is.
    pub fn user_id(&self) -> Option<UserId> {
        self.user
    }

    /// As stored.
    pub fn as_str(&self) -> &str {
        &self.text
    }
}

/// A row of the trail.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct AuditRow {
    /// Order.
    pub seq: i64,
    /// When.
    pub at: Instant,
    /// Who.
    pub actor: String,
    /// What was done: `subject.add`, `study.pause`, ...
    pub action: String,
    /// To what: `study 0190...`.
    pub object: String,
    /// What exactly, with the reason where there is one.
    pub detail: Value,
    /// Hash of the row before.
    pub previous: String,
    /// Hash of this row with it.
    pub hash: String,
}

/// Appends a row to the transaction of the change.
///
/// # Errors
/// What the database reports.
pub async fn append(db: &mut Connection, actor: &Actor, action: &str, object: &str, detail: &Value) -> StoreResult<()> {
    let last = sqlx::query("select hash from audit order by seq desc limit 1").fetch_optional(&mut *db).await?;
    let previous: String = match last {
        Some(row) => row.try_get(0)?,
        None => ORIGIN.to_owned(),
    };
    let at = now();
    let hash = hash(&previous, &at.to_string(), actor.as_str(), action, object, detail);
    sqlx::query("insert into audit (at, actor, action, object, detail, previous, hash) values (?, ?, ?, ?, ?, ?, ?)")
        .bind(at)
        .bind(actor.as_str())
        .bind(action)
        .bind(object)
        .bind(json::to_text("audit detail", detail)?)
        .bind(previous)
        .bind(hash)
        .execute(db)
        .await?;
    Ok(())
}

/// At most `limit` rows before `before`, newest first; those that `contains` stands in, where it is not empty: in who, what,
/// to what, or exactly.
///
/// # Errors
/// What the database reports.
pub async fn page(db: &mut Connection, contains: &str, before: Option<i64>, limit: u32) -> StoreResult<Vec<AuditRow>> {
    let rows = sqlx::query(
        "select * from audit where (?1 is null or seq < ?1)
             and (?2 = '' or instr(lower(actor || ' ' || action || ' ' || object || ' ' || detail), lower(?2)) > 0)
         order by seq desc limit ?3",
    )
    .bind(before)
    .bind(contains)
    .bind(limit)
    .fetch_all(db)
    .await?;
    rows.iter().map(from_row).collect()
}

/// What walking the chain found.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum ChainCheck {
    /// Every row follows from the one before.
    Whole {
        /// How many rows.
        rows: u64,
        /// Hash of the last one.
        last: String,
    },
    /// This row does not.
    Broken {
        /// Its sequence number.
        seq: i64,
    },
}

/// Walks the whole chain.
///
/// # Errors
/// What the database reports.
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
            // A row that cannot even be read was not written by this program.
            let Ok(row) = from_row(raw) else { return Ok(ChainCheck::Broken { seq }) };
            let at: String = raw.try_get("at")?;
            let expected = hash(&last, &at, &row.actor, &row.action, &row.object, &row.detail);
            // No row is ever deleted: the numbers have no gap.
            if seq != after + 1 || row.previous != last || row.hash != expected {
                return Ok(ChainCheck::Broken { seq });
            }
            (rows, last, after) = (rows + 1, row.hash, seq);
        }
    }
    // The database counts for itself how many there were.
    if last_ever(db, "audit").await? != after {
        return Ok(ChainCheck::Broken { seq: after + 1 });
    }
    Ok(ChainCheck::Whole { rows, last })
}

/// The largest number that a table ever gave to a row, also when the row is there no more.
pub(super) async fn last_ever(db: &mut Connection, table: &str) -> StoreResult<i64> {
    let last = sqlx::query_scalar("select seq from sqlite_sequence where name = ?");
    Ok(last.bind(table).fetch_optional(db).await?.unwrap_or(0))
}

/// Hash of a row and the one before: of an object with sorted keys, so that there is one way to write it.
fn hash(previous: &str, at: &str, actor: &str, action: &str, object: &str, detail: &Value) -> String {
    let whole =
        json!({"action": action, "actor": actor, "at": at, "detail": detail, "object": object, "previous": previous});
    json::sha256(whole.to_string().as_bytes())
}

fn from_row(row: &SqliteRow) -> StoreResult<AuditRow> {
    Ok(AuditRow {
        seq: row.try_get("seq")?,
        at: row.try_get("at")?,
        actor: row.try_get("actor")?,
        action: row.try_get("action")?,
        object: row.try_get("object")?,
        detail: json::column(row, "detail")?,
        previous: row.try_get("previous")?,
        hash: row.try_get("hash")?,
    })
}
