//! Allocations: which gait comes first in a lab session or in a rater's pair.
//!
//! No module outside this folder reads these tables. Every statement that returns an allocation states in its `where` why
//! it may be known: the session or the rater is unblinded, the pair belongs to the rater, or the device fetches its file,
//! which is recorded. The draw reads unblinded ones.

mod balanced_draws;

pub use balanced_draws::RandomDraw;

use super::audit::Actor;
use super::blind_pairs::{BlindPair, OrderedAnswer, SELECT};
use super::{
    BlindPairId, Connection, ControllerFileDownloadId, Instant, LabSessionId, StoreResult, StudyId, TrialId, now,
};
use sqlx::sqlite::SqliteRow;
use sqlx::{AssertSqlSafe, Row};

/// Draws which gait walk 2 of a session uses, balanced over the sessions with the same number of all subjects.
///
/// # Errors
/// A violated constraint if the session has an allocation; errors of the database.
pub async fn of_session(
    db: &mut Connection,
    session: LabSessionId,
    number: u32,
    random: RandomDraw,
) -> StoreResult<()> {
    let gait_a_first = random.gait_a_first(balanced_draws::lead(db, number).await?);
    sqlx::query("insert into lab_allocations (lab_session_id, gait_a_first, nonce, created_at) values (?, ?, ?, ?)")
        .bind(session)
        .bind(gait_a_first)
        .bind(random.nonce())
        .bind(now())
        .execute(db)
        .await?;
    Ok(())
}

/// What may be known of the allocation of a session.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct SessionAllocation {
    /// Whether the allocation is in this record. It is missing if the study was exported while the session was blinded,
    /// and then imported.
    pub included: bool,
    /// Whether walk 2 uses gait A; `None` while the session is blinded.
    pub gait_a_first: Option<bool>,
    /// Who fetched controller files of its walks, in order.
    pub files: Vec<ControllerFileDownload>,
}

/// Download of the controller file of a walk.
#[derive(Debug, Clone, PartialEq)]
pub struct ControllerFileDownload {
    /// Number of the walk, 2 or 3.
    pub walk: u8,
    /// Whether the device itself fetched the file. If not, the caller may know which gait the walk uses.
    pub to_device: bool,
    /// Who fetched it.
    pub actor: String,
    /// Time of the download.
    pub at: Instant,
}

/// Reads what may be known of the allocation of a session.
///
/// # Errors
/// Errors of the database.
pub async fn session(db: &mut Connection, id: LabSessionId) -> StoreResult<SessionAllocation> {
    let order = sqlx::query(
        "select iif(exists (select 1 from lab_session_steps t where t.lab_session_id = a.lab_session_id and t.step = 'unblinded'), \
         a.gait_a_first, null) from lab_allocations a where a.lab_session_id = ?",
    );
    let order = order.bind(id).fetch_optional(&mut *db).await?;
    let included = order.is_some();
    let gait_a_first = order.map(|row| row.try_get(0)).transpose()?.flatten();
    let files = sqlx::query("select * from controller_file_downloads where lab_session_id = ? order by id").bind(id);
    let files = files.fetch_all(db).await?.iter().map(controller_file).collect::<StoreResult<_>>()?;
    Ok(SessionAllocation { included, gait_a_first, files })
}

fn controller_file(row: &SqliteRow) -> StoreResult<ControllerFileDownload> {
    Ok(ControllerFileDownload {
        walk: row.try_get("walk")?,
        to_device: row.try_get("to_device")?,
        actor: row.try_get("actor")?,
        at: row.try_get("created_at")?,
    })
}

/// Records the release of the controller file of a walk. Returns whether the walk uses gait A, or `None` if the
/// allocation is not in this record.
///
/// # Errors
/// A violated constraint or trigger; errors of the database.
pub async fn for_device(
    db: &mut Connection,
    session: LabSessionId,
    walk: u8,
    (actor, to_device): (&Actor, bool),
) -> StoreResult<Option<bool>> {
    let id = ControllerFileDownloadId::fresh();
    sqlx::query(
        "insert into controller_file_downloads (id, lab_session_id, walk, to_device, actor, created_at) values (?, ?, ?, ?, ?, ?)",
    )
    .bind(id)
    .bind(session)
    .bind(walk)
    .bind(to_device)
    .bind(actor.as_str())
    .bind(now())
    .execute(&mut *db)
    .await?;
    let row = sqlx::query(
        "select a.gait_a_first = (f.walk = 2) from lab_allocations a \
         join controller_file_downloads f on f.lab_session_id = a.lab_session_id where f.id = ?",
    );
    Ok(row.bind(id).fetch_optional(db).await?.map(|row| row.try_get(0)).transpose()?)
}

/// Whether an actor may have a controller file of a lab session of this study. The holder of a token is unknown, so a
/// token may belong to any actor.
///
/// # Errors
/// Errors of the database.
pub async fn has_file(db: &mut Connection, study: StudyId, actor: &Actor) -> StoreResult<bool> {
    let row = sqlx::query(
        "select 1 from controller_file_downloads f join lab_sessions l on l.id = f.lab_session_id \
         where l.study_id = ?1 and (f.actor = ?2 or ?3 or f.actor glob ?4) and f.to_device = 0 limit 1",
    );
    let (is_token, of_tokens) = (Actor::is_token(actor.as_str()), format!("{}*", Actor::OF_TOKENS));
    Ok(row.bind(study).bind(actor.as_str()).bind(is_token).bind(of_tokens).fetch_optional(db).await?.is_some())
}

/// Draws which gait of a pair is shown first, by a fair coin. A biased one would not do: answers in the study reveal
/// earlier allocations to readers who know the answer of the rater. A pair that is shown again after a retraction keeps the
/// sides of the earlier pair (`same_sides_as`).
///
/// # Errors
/// A violated constraint if the pair has an allocation; errors of the database.
pub async fn of_pair(
    db: &mut Connection,
    id: BlindPairId,
    same_sides_as: Option<BlindPairId>,
    random: RandomDraw,
) -> StoreResult<()> {
    sqlx::query(
        "insert into blind_pair_allocations (pair_id, swapped, nonce, created_at) \
         values (?1, coalesce((select swapped from blind_pair_allocations where pair_id = ?2), ?3), ?4, ?5)",
    )
    .bind(id)
    .bind(same_sides_as)
    .bind(random.coin())
    .bind(random.nonce())
    .bind(now())
    .execute(db)
    .await?;
    Ok(())
}

/// A pair with its sides.
#[derive(Debug, Clone, PartialEq)]
pub struct PairWithSides {
    /// The pair.
    pub pair: BlindPair,
    swapped: bool,
}

impl PairWithSides {
    /// The gaits, in the order in which they are shown.
    pub fn shown(&self) -> (TrialId, TrialId) {
        let (a, b) = self.pair.trials();
        if self.swapped { (b, a) } else { (a, b) }
    }

    /// Converts an answer from sides to gaits of the pair, or back.
    pub fn turned(&self, answer: OrderedAnswer) -> OrderedAnswer {
        if self.swapped { answer.swapped() } else { answer }
    }

    /// The answer in terms of sides.
    pub fn answer(&self) -> Option<OrderedAnswer> {
        self.pair.answer.map(|answer| self.turned(answer))
    }
}

/// The pair with this code, if it belongs to the rater.
///
/// # Errors
/// Errors of the database.
pub async fn own_pair(db: &mut Connection, code: &str, rater: &str) -> StoreResult<Option<PairWithSides>> {
    let found = sided("where p.code = ? and p.rater = ?", &[Some(code), Some(rater)], db).await?;
    Ok(found.into_iter().next())
}

/// The pairs of unblinded raters of a study, in the order of the draws.
///
/// # Errors
/// Errors of the database.
pub async fn of_unblinded_raters(db: &mut Connection, study: StudyId) -> StoreResult<Vec<PairWithSides>> {
    let rest = "where p.study_id = ? and exists \
                (select 1 from rater_unblindings u where u.study_id = p.study_id and u.rater = p.rater) order by p.id";
    sided(rest, &[Some(&study.to_string())], db).await
}

/// A page of the pairs of unblinded raters of a study, in the order of the draws: of one rater or, without a name, of all.
///
/// # Errors
/// Errors of the database.
pub async fn page_of_unblinded_raters(
    db: &mut Connection,
    study: StudyId,
    rater: Option<&str>,
    after: Option<BlindPairId>,
    limit: u32,
) -> StoreResult<Vec<PairWithSides>> {
    let rest = "where p.study_id = ? and p.rater = coalesce(?, p.rater) and p.id > ? and exists \
                (select 1 from rater_unblindings u where u.study_id = p.study_id and u.rater = p.rater) \
                order by p.id limit cast(? as integer)";
    let (study, after, limit) =
        (study.to_string(), after.map_or_else(String::new, |id| id.to_string()), limit.to_string());
    sided(rest, &[Some(&study), rater, Some(&after), Some(&limit)], db).await
}

/// Reads pairs with their sides. `rest` states why the sides may be known.
async fn sided(rest: &'static str, values: &[Option<&str>], db: &mut Connection) -> StoreResult<Vec<PairWithSides>> {
    let columns = SELECT.replacen("select p.*", "select p.*, s.swapped", 1);
    let sql = format!("{columns} join blind_pair_allocations s on s.pair_id = p.id {rest}");
    let mut query = sqlx::query(AssertSqlSafe(sql));
    for value in values {
        query = query.bind(value.map(str::to_owned));
    }
    let row = |row: &SqliteRow| -> StoreResult<PairWithSides> {
        Ok(PairWithSides { pair: BlindPair::from_row(row)?, swapped: row.try_get("swapped")? })
    };
    query.fetch_all(db).await?.iter().map(row).collect()
}

/// Whether the sides of a pair are in this record.
///
/// # Errors
/// Errors of the database.
pub async fn is_included(db: &mut Connection, id: BlindPairId) -> StoreResult<bool> {
    let row = sqlx::query("select 1 from blind_pair_allocations where pair_id = ?").bind(id);
    Ok(row.fetch_optional(db).await?.is_some())
}
