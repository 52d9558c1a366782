//! Allocations: which gait comes first in a lab session or in a rater's pair.
//!
//! No module outside this folder reads these tables. Every statement that returns an allocation states in its `where` why
//! it may be known: the session or the rater is unblinded, the pair belongs to the rater, or the device fetches its file,
//! which is recorded. The draw reads unblinded ones.

mod balanced_draws;
mod random_sides;

pub use balanced_draws::RandomDraw;
pub use random_sides::{PairWithSides, is_included, of_pair, of_unblinded_raters, own_pair, page_of_unblinded_raters};

use super::audit::Actor;
use super::{Connection, ControllerFileDownloadId, Instant, LabSessionId, StoreResult, StudyId, now};
use sqlx::Row;
use sqlx::sqlite::SqliteRow;

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

/// The part of the allocation of a session that may be known.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct SessionAllocation {
    /// Whether the allocation is in this record. It is missing if the study was exported while the session was blinded,
    /// and then imported.
    pub included: bool,
    /// Whether walk 2 uses gait A; `None` while the session is blinded.
    pub gait_a_first: Option<bool>,
    /// Downloads of controller files of its walks, in order.
    pub files: Vec<ControllerFileDownload>,
}

/// Download of the controller file of a walk.
#[derive(Debug, Clone, PartialEq)]
pub struct ControllerFileDownload {
    /// Number of the walk, 2 or 3.
    pub walk: u8,
    /// Whether the device itself fetched the file. If not, the caller may know which gait the walk uses.
    pub to_device: bool,
    /// Actor of the download.
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
