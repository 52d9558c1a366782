//! Lists of studies: those that a caller reaches, and those that the service works on.

use super::{Study, StudyState, from_row};
use crate::accessible_studies::Reach;
use crate::accessible_studies::{reach_values, reached};
use crate::{Connection, Instant, StoreResult, StudyId, SubjectId};
use sqlx::Row;

/// A column by which studies can be sorted.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum StudyColumn {
    /// When the study was created.
    #[default]
    CreatedAt,
    /// Its name, whatever its case.
    Name,
    /// Its state, in alphabetical order.
    State,
}

impl StudyColumn {
    /// Every column.
    pub const ALL: [Self; 3] = [Self::CreatedAt, Self::Name, Self::State];

    /// The name of the column.
    pub fn as_str(self) -> &'static str {
        match self {
            Self::CreatedAt => "created_at",
            Self::Name => "name",
            Self::State => "state",
        }
    }
}

/// Which studies of those that a caller reaches, and in which order.
#[derive(Debug, Clone, Default)]
pub struct StudyFilter {
    /// Only studies of this subject.
    pub subject: Option<SubjectId>,
    /// Whose name, tags, notes or pseudonym contain this text, whatever its case. Empty for all.
    pub text: String,
    /// With this tag. Empty for all.
    pub tag: String,
    /// In this state.
    pub state: Option<StudyState>,
    /// Archived studies or the others. `None` for both.
    pub archived: Option<bool>,
    /// By which column they are sorted. Studies with the same value are sorted by creation, in the same direction.
    pub sort: StudyColumn,
    /// Whether in ascending order.
    pub ascending: bool,
    /// After this one in that order.
    pub after: Option<StudyId>,
    /// At most so many.
    pub limit: u32,
}

impl StudyFilter {
    /// The newest studies, archived or not.
    pub fn newest(limit: u32) -> Self {
        Self { limit, ..Self::default() }
    }
}

/// The state of every study.
///
/// # Errors
/// Errors of the database.
pub async fn states(db: &mut Connection) -> StoreResult<Vec<(StudyId, StudyState)>> {
    let rows = sqlx::query("select id, state from studies").fetch_all(db).await?;
    rows.iter().map(|row| Ok((row.try_get("id")?, row.try_get::<&str, _>("state")?.parse()?))).collect()
}

/// Studies that a caller reaches.
///
/// # Errors
/// Errors of the database.
pub async fn page(db: &mut Connection, reach: Reach, filter: &StudyFilter) -> StoreResult<Vec<Study>> {
    let (every, open, principal) = reach_values(reach);
    let sql = concat!(
        "select s.* from studies s join subjects p on p.id = s.subject_id where ",
        reached!("s.id"),
        " and (?4 is null or exists (select 1 from studies f where f.id = ?4 and case when ?12 \
             then (case ?11 when 'name' then lower(s.name) when 'state' then s.state else '' end, s.id) \
                 > (case ?11 when 'name' then lower(f.name) when 'state' then f.state else '' end, f.id) \
             else (case ?11 when 'name' then lower(s.name) when 'state' then s.state else '' end, s.id) \
                 < (case ?11 when 'name' then lower(f.name) when 'state' then f.state else '' end, f.id) end)) \
         and (?5 is null or s.subject_id = ?5) and (?6 is null or s.state = ?6) \
         and (?7 is null or (s.archived_at is not null) = ?7) \
         and (?8 = '' or instr(lower(s.name || char(10) || p.pseudonym || char(10) || coalesce(s.tags, '') \
                                     || char(10) || coalesce(s.notes, '')), lower(?8))) \
         and (?9 = '' or exists (select 1 from json_each(s.tags) where value = ?9)) \
         order by case when ?12 then case ?11 when 'name' then lower(s.name) when 'state' then s.state else '' end end, \
             case when ?12 then null else case ?11 when 'name' then lower(s.name) when 'state' then s.state else '' end end desc, \
             case when ?12 then s.id end, s.id desc limit ?10"
    );
    let query = sqlx::query(sql).bind(every).bind(open).bind(principal).bind(filter.after).bind(filter.subject);
    let query = query.bind(filter.state.map(StudyState::as_str)).bind(filter.archived);
    let query = query.bind(&filter.text).bind(&filter.tag).bind(filter.limit);
    let query = query.bind(filter.sort.as_str()).bind(filter.ascending);
    query.fetch_all(db).await?.iter().map(from_row).collect()
}

/// The tags of the studies that a caller reaches, in alphabetical order.
///
/// # Errors
/// Errors of the database.
pub async fn tags(db: &mut Connection, reach: Reach) -> StoreResult<Vec<String>> {
    let (every, open, principal) = reach_values(reach);
    let sql = concat!(
        "select distinct t.value from studies s, json_each(s.tags) t where ",
        reached!("s.id"),
        " order by t.value"
    );
    Ok(sqlx::query_scalar(sql).bind(every).bind(open).bind(principal).fetch_all(db).await?)
}

/// The names of the studies that a caller reaches, except that of one study.
///
/// # Errors
/// Errors of the database.
pub async fn names(db: &mut Connection, reach: Reach, except: Option<StudyId>) -> StoreResult<Vec<String>> {
    let (every, open, principal) = reach_values(reach);
    let sql = concat!("select name from studies where ", reached!("id"), " and (?4 is null or id <> ?4)");
    Ok(sqlx::query_scalar(sql).bind(every).bind(open).bind(principal).bind(except).fetch_all(db).await?)
}

/// The accessible studies with comparisons for raters, oldest first.
///
/// # Errors
/// Errors of the database.
pub async fn awaiting_raters(db: &mut Connection, reach: Reach) -> StoreResult<Vec<Study>> {
    let (every, open, principal) = reach_values(reach);
    let sql = concat!(
        "select * from studies where state in ('running', 'waiting') and answer_source <> 'gait_rmse' and ",
        reached!("id"),
        " order by priority desc, id"
    );
    sqlx::query(sql).bind(every).bind(open).bind(principal).fetch_all(db).await?.iter().map(from_row).collect()
}

/// Every study that the scheduler runs, oldest first.
///
/// # Errors
/// Errors of the database.
pub async fn active(db: &mut Connection) -> StoreResult<Vec<Study>> {
    let rows = sqlx::query("select * from studies where state in ('running', 'waiting') order by priority desc, id")
        .fetch_all(db)
        .await?;
    rows.iter().map(from_row).collect()
}

/// The newest accessible studies that wait for an action of a person.
///
/// # Errors
/// Errors of the database.
pub async fn waiting_for_people(db: &mut Connection, reach: Reach, limit: u32) -> StoreResult<Vec<Study>> {
    let (every, open, principal) = reach_values(reach);
    let sql = concat!(
        "select * from studies where state in ('waiting', 'paused', 'not_started') and archived_at is null and ",
        reached!("id"),
        " order by id desc limit ?4"
    );
    let query = sqlx::query(sql).bind(every).bind(open).bind(principal).bind(limit);
    query.fetch_all(db).await?.iter().map(from_row).collect()
}

/// SQL for the studies with a safety report.
macro_rules! reported {
    () => {
        "select t.study_id from safety_reports r join trials t on t.id = r.trial_id \
         union select m.study_id from assessments m where m.answer glob 'unsafe*' \
         and m.id not in (select assessment_id from assessment_retractions) \
         union select p.study_id from blind_pairs p join blind_pair_answers a on a.pair_id = p.id \
         where a.answer glob 'unsafe*' \
         union select l.study_id from lab_sessions l join lab_answers a on a.lab_session_id = l.id \
         where a.answer glob 'unsafe*'"
    };
}

/// The newest accessible studies with a safety report that was not retracted, without those of subjects who withdrew
/// consent.
///
/// # Errors
/// Errors of the database.
pub async fn with_safety_reports(db: &mut Connection, reach: Reach, limit: u32) -> StoreResult<Vec<Study>> {
    let (every, open, principal) = reach_values(reach);
    let rows = sqlx::query(concat!(
        "select * from studies s where s.subject_id not in (select subject_id from withdrawn_subjects) and ",
        reached!("s.id"),
        " and s.id in (",
        reported!(),
        ") order by s.id desc limit ?4",
    ))
    .bind(every)
    .bind(open)
    .bind(principal)
    .bind(limit)
    .fetch_all(db)
    .await?;
    rows.iter().map(from_row).collect()
}

/// The studies of a study's subject that have a safety report, each with whether it has the same device. The study
/// itself comes first, and is listed also if somebody could not tell which gait of a pair is better.
///
/// # Errors
/// Errors of the database.
pub async fn of_subject_with_safety_reports(db: &mut Connection, study: StudyId) -> StoreResult<Vec<(StudyId, bool)>> {
    let sql = concat!(
        "select s.id, s.device_id = own.device_id from studies own join studies s on s.subject_id = own.subject_id \
         where own.id = ?1 and (s.id in (",
        reported!(),
        ") or s.id = ?1 and (exists (select 1 from assessments where study_id = ?1) or exists (select 1 from blind_pairs p \
         join blind_pair_answers a on a.pair_id = p.id where p.study_id = ?1 and a.answer = 'cannot_tell'))) \
         order by s.id <> ?1, s.id"
    );
    Ok(sqlx::query_as(sql).bind(study).fetch_all(db).await?)
}

/// The newest accessible studies of a subject.
///
/// # Errors
/// Errors of the database.
pub async fn of_subject(db: &mut Connection, reach: Reach, subject: SubjectId, limit: u32) -> StoreResult<Vec<Study>> {
    let (every, open, principal) = reach_values(reach);
    let sql = concat!("select * from studies where subject_id = ?4 and ", reached!("id"), " order by id desc limit ?5");
    let query = sqlx::query(sql).bind(every).bind(open).bind(principal);
    query.bind(subject).bind(limit).fetch_all(db).await?.iter().map(from_row).collect()
}

/// The studies of a subject that have not ended.
///
/// # Errors
/// Errors of the database.
pub async fn open_of(db: &mut Connection, subject: SubjectId) -> StoreResult<Vec<Study>> {
    let rows =
        sqlx::query("select * from studies where subject_id = ? and state not in ('finished', 'stopped') order by id")
            .bind(subject)
            .fetch_all(db)
            .await?;
    rows.iter().map(from_row).collect()
}

/// Studies that ended before an instant.
///
/// # Errors
/// Errors of the database.
pub async fn ended_before(db: &mut Connection, at: Instant) -> StoreResult<Vec<Study>> {
    let rows =
        sqlx::query("select * from studies where state in ('finished', 'stopped') and updated_at < ? order by id")
            .bind(at)
            .fetch_all(db)
            .await?;
    rows.iter().map(from_row).collect()
}
