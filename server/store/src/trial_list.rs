//! The table of a study's trials, sorted and filtered by the database.

use super::trials::{TrialState, of_a_gait};
use super::{Connection, StoreResult, StudyId, TrialId, json_columns};
use gait_optimizer::TunedBounds;
use serde::{Deserialize, Serialize};
use sqlx::sqlite::SqliteRow;
use sqlx::{Row, TypeInfo, ValueRef};

/// Columns other than the bounds by which trials can be sorted.
const COLUMNS: [&str; 6] = ["number", "state", "gait_rmse_rad", "cost_of_transport", "iterations", "seconds_total"];
/// Columns by which trials can be sorted.
pub const SORTS: [&str; COLUMNS.len() + TunedBounds::COUNT] = {
    let mut sorts = [""; COLUMNS.len() + TunedBounds::COUNT];
    let mut at = 0;
    while at < sorts.len() {
        sorts[at] = if at < COLUMNS.len() { COLUMNS[at] } else { TunedBounds::NAMES[at - COLUMNS.len()] };
        at += 1;
    }
    sorts
};

/// Columns by whose range trials can be filtered.
pub const RANGES: [&str; 2 + TunedBounds::COUNT] = {
    let mut ranges = [""; 2 + TunedBounds::COUNT];
    (ranges[0], ranges[1]) = ("gait_rmse_rad", "cost_of_transport");
    let mut at = 0;
    while at < TunedBounds::COUNT {
        ranges[at + 2] = TunedBounds::NAMES[at];
        at += 1;
    }
    ranges
};

/// A range of a value. A trial without the value is outside.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ValueRange {
    /// One of [`RANGES`].
    pub column: &'static str,
    /// Minimum.
    pub from: f64,
    /// Maximum.
    pub to: f64,
}

/// Filter, order and page of a listing.
#[derive(Debug, Clone)]
pub struct Listing {
    /// One of [`SORTS`].
    pub sort: &'static str,
    /// Whether to sort in descending order. Trials without a value come last in both orders.
    pub descending: bool,
    /// Only trials in this state.
    pub state: Option<TrialState>,
    /// Only trials whose reason or message contains this text, ignoring case.
    pub contains: String,
    /// Only trials with a value in this range.
    pub range: Option<ValueRange>,
    /// Maximum number of trials.
    pub limit: u32,
    /// Where the page begins.
    pub start: ListStart,
}

/// Where a page of a listing begins.
#[derive(Debug, Clone)]
pub enum ListStart {
    /// With the first trial.
    First,
    /// After this place, even if the trial that had it has moved.
    After(TrialPlace),
    /// So that it ends before this place, even if the trial that had it has moved.
    Before(TrialPlace),
}

/// The place of a trial in the order of a listing: its value in the sorted column, then its number.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TrialPlace(SortedValue, u32);

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
enum SortedValue {
    Absent,
    Integer(i64),
    Real(f64),
    Text(String),
}

/// A row of the table.
#[derive(Debug, Clone)]
pub struct ListedTrial {
    /// Identifier.
    pub id: TrialId,
    /// Number of the trial, from 1.
    pub number: u32,
    /// The action as bounds.
    pub action: TunedBounds,
    /// Reason for the trial.
    pub reason: String,
    /// Identifier and number of the trial that gave the warm start.
    pub from: Option<(TrialId, u32)>,
    /// State of the trial.
    pub state: TrialState,
    /// Gait RMSE, rad, of a gait.
    pub gait_rmse_rad: Option<f64>,
    /// Cost of transport of a gait.
    pub cost_of_transport: Option<f64>,
    /// Interior-point iterations.
    pub iterations: Option<u32>,
    /// Wall time of the solve, s.
    pub seconds_total: Option<f64>,
    /// Human-readable message about how the trial ended; may be empty.
    pub message: String,
    /// Number of trials that match the filter.
    pub matching: u32,
    /// How many of them come before this one.
    pub before: u32,
    /// Its place in the order of the listing.
    pub place: TrialPlace,
}

/// The trials of a study.
///
/// # Errors
/// Errors of the database.
pub async fn of_study(db: &mut Connection, study: StudyId, listing: &Listing) -> StoreResult<Vec<ListedTrial>> {
    let (is_before, place) = match &listing.start {
        ListStart::First => (false, None),
        ListStart::After(place) => (false, Some(place)),
        ListStart::Before(place) => (true, Some(place)),
    };
    let query = sqlx::query(
        "with keyed as (select t.id, t.number, t.action, t.reason, t.warm_started_from, t.state, t.gait_rmse_rad, \
         t.cost_of_transport, t.iterations, t.seconds_total, t.message, (select w.number from trials w where w.id = t.warm_started_from) as from_number, \
         count(*) over () as matching, \
         case ?2 when 'number' then t.number when 'state' then t.state \
             when 'gait_rmse_rad' then iif(t.state in ('converged', 'not_executable'), t.gait_rmse_rad, null) \
             when 'cost_of_transport' then iif(t.state in ('converged', 'not_executable'), t.cost_of_transport, null) \
             when 'iterations' then t.iterations \
             when 'seconds_total' then t.seconds_total else json_extract(t.action, '$.' || ?2) end as key \
         from trials t \
         where t.study_id = ?1 and (?4 is null or t.state = ?4) \
             and (?5 = '' or instr(lower(t.reason || ' ' || t.message), lower(?5)) > 0) \
             and (?10 is null or case ?10 \
                 when 'gait_rmse_rad' then iif(t.state in ('converged', 'not_executable'), t.gait_rmse_rad, null) \
                 when 'cost_of_transport' then iif(t.state in ('converged', 'not_executable'), t.cost_of_transport, null) \
                 else json_extract(t.action, '$.' || ?10) end between ?11 and ?12)), \
         listed as (select *, row_number() over (order by key is null, case when ?3 then key end desc, \
             case when ?3 then null else key end, number desc) - 1 as before from keyed) \
         select * from listed where ?8 is null \
             or case when ?7 then (key is ?9 and number > ?8) \
                 or (key is not null and (?9 is null or case when ?3 then key > ?9 else key < ?9 end)) \
             else (key is ?9 and number < ?8) \
                 or (?9 is not null and (key is null or case when ?3 then key < ?9 else key > ?9 end)) end \
         order by case when ?7 then -before else before end \
         limit ?6",
    )
    .bind(study)
    .bind(listing.sort)
    .bind(listing.descending)
    .bind(listing.state.map(TrialState::as_str))
    .bind(&listing.contains)
    .bind(listing.limit)
    .bind(is_before)
    .bind(place.map(|place| place.1));
    let query = match place.map(|place| &place.0) {
        None | Some(SortedValue::Absent) => query.bind(None::<i64>),
        Some(SortedValue::Integer(value)) => query.bind(*value),
        Some(SortedValue::Real(value)) => query.bind(*value),
        Some(SortedValue::Text(value)) => query.bind(value),
    };
    let query = query.bind(listing.range.map(|range| range.column));
    let query = query.bind(listing.range.map(|range| range.from)).bind(listing.range.map(|range| range.to));
    let mut rows = query.fetch_all(db).await?;
    if is_before {
        rows.reverse();
    }
    rows.iter()
        .map(|row| {
            let from: Option<TrialId> = row.try_get("warm_started_from")?;
            let state = row.try_get::<&str, _>("state")?.parse()?;
            Ok(ListedTrial {
                id: row.try_get("id")?,
                number: row.try_get("number")?,
                action: json_columns::column(row, "action")?,
                reason: row.try_get("reason")?,
                from: from.zip(row.try_get("from_number")?),
                state,
                gait_rmse_rad: of_a_gait(row, state, "gait_rmse_rad")?,
                cost_of_transport: of_a_gait(row, state, "cost_of_transport")?,
                iterations: row.try_get("iterations")?,
                seconds_total: row.try_get("seconds_total")?,
                message: row.try_get("message")?,
                matching: row.try_get("matching")?,
                before: row.try_get("before")?,
                place: TrialPlace(sorted_value(row)?, row.try_get("number")?),
            })
        })
        .collect()
}

/// The value as the database compares it: it decides whether a number is whole.
fn sorted_value(row: &SqliteRow) -> StoreResult<SortedValue> {
    let kind = row.try_get_raw("key")?.type_info().name().to_owned();
    Ok(match kind.as_str() {
        "INTEGER" => SortedValue::Integer(row.try_get("key")?),
        "REAL" => SortedValue::Real(row.try_get("key")?),
        "TEXT" => SortedValue::Text(row.try_get("key")?),
        _ => SortedValue::Absent,
    })
}
