//! Stored studies.

mod atlases;
mod lists;
mod plan;
mod simulated_walks;
mod study_state;

pub use atlases::finished_atlas;
pub use lists::{
    StudyColumn, StudyFilter, active, awaiting_raters, ended_before, names, of_subject, of_subject_with_safety_reports,
    open_of, page, states, tags, waiting_for_people, with_safety_reports,
};
pub use plan::{AnswerSource, AtlasRole, Evaluation, StudyPlan, WarmStartFrom};
pub use simulated_walks::{SimulatedWalks, SimulatedWalksEffect};
pub use study_state::StudyState;

use super::{Connection, Instant, StoreError, StoreResult, StudyId, json_columns, now};
use gait_optimizer::Subject as Body;
use sqlx::Row;
use sqlx::sqlite::SqliteRow;

/// A tuning run for one subject: its set-up and state.
#[derive(Debug, Clone, PartialEq)]
pub struct Study {
    /// Identifier.
    pub id: StudyId,
    /// Set-up of the study.
    pub plan: StudyPlan,
    /// Parent, if the study is a clone.
    pub cloned_from: Option<StudyId>,
    /// State of the study.
    pub state: StudyState,
    /// Reason for the state; may be empty.
    pub state_reason: String,
    /// Revision, which increases with each change.
    pub revision: i64,
    /// Tags, by which people find the study.
    pub tags: Vec<String>,
    /// Free-text notes.
    pub notes: String,
    /// Time at which the study was archived. Lists leave out archived studies unless they are asked for; `GET
    /// /studies?archived=true` lists them.
    pub archived_at: Option<Instant>,
    /// Time of creation.
    pub created_at: Instant,
    /// Time of the last change.
    pub updated_at: Instant,
}

/// Adds a study.
///
/// # Errors
/// A violated constraint; errors of the database.
pub async fn insert(
    db: &mut Connection,
    plan: &StudyPlan,
    state: StudyState,
    cloned_from: Option<StudyId>,
) -> StoreResult<Study> {
    let at = now();
    let id = StudyId::fresh();
    sqlx::query(
        "insert into studies (id, name, subject_id, device_id, reference_gait_id, muscles, gait_settings, \
         solve_options, base_bounds, search_space, learner, answer_source, number_of_trials, parallel_trials, priority, \
         seed, state, evaluation, solve_seconds_budget, unchanged_limit, cloned_from, created_at, updated_at, \
         height_m, body_mass_kg, repeat_results, warm_start_from, atlas, simulated_walks) values (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)",
    )
    .bind(id)
    .bind(&plan.name)
    .bind(plan.subject_id)
    .bind(plan.device_id)
    .bind(plan.reference_gait_id)
    .bind(plan.muscles)
    .bind(json_columns::to_text("gait settings", &plan.gait_settings)?)
    .bind(json_columns::to_text("solve options", &plan.solve_options)?)
    .bind(json_columns::to_text("base bounds", &plan.base_bounds)?)
    .bind(json_columns::to_text("search space", &plan.search_space)?)
    .bind(json_columns::to_text("learner settings", &plan.learner)?)
    .bind(plan.answer_source.as_str())
    .bind(plan.number_of_trials)
    .bind(plan.parallel_trials)
    .bind(plan.priority)
    .bind(i64::try_from(plan.seed).unwrap_or(i64::MAX))
    .bind(state.as_str())
    .bind(plan.evaluation.as_str())
    .bind(plan.solve_seconds_budget)
    .bind(plan.unchanged_limit)
    .bind(cloned_from)
    .bind(at)
    .bind(at)
    .bind(plan.body.height_m)
    .bind(plan.body.body_mass_kg)
    .bind(plan.repeat_results)
    .bind(plan.warm_start_from.as_str())
    .bind(plan.atlas.as_str())
    .bind(json_columns::to_text("simulated walks", &plan.simulated_walks)?)
    .execute(db)
    .await?;
    Ok(Study {
        id,
        plan: plan.clone(),
        cloned_from,
        state,
        state_reason: String::new(),
        revision: 1,
        tags: Vec::new(),
        notes: String::new(),
        archived_at: None,
        created_at: at,
        updated_at: at,
    })
}

/// The study with this identifier.
///
/// # Errors
/// [`StoreError::Missing`]; errors of the database.
pub async fn get(db: &mut Connection, id: StudyId) -> StoreResult<Study> {
    let row = sqlx::query("select * from studies where id = ?").bind(id).fetch_optional(db).await?;
    row.as_ref().map(from_row).transpose()?.ok_or_else(|| StoreError::Missing { what: "study", id: id.to_string() })
}

/// The changeable fields of a study.
#[derive(Debug, Clone)]
pub struct StudyLimits {
    /// Name shown to users.
    pub name: String,
    /// Priority. Higher values run first.
    pub priority: i32,
    /// Number of trials that run in parallel.
    pub parallel_trials: u32,
    /// Number of trials.
    pub number_of_trials: u32,
}

/// Updates the changeable fields.
///
/// # Errors
/// A violated constraint; errors of the database.
pub async fn set_limits(db: &mut Connection, id: StudyId, limits: &StudyLimits) -> StoreResult<()> {
    sqlx::query(
        "update studies set name = ?, priority = ?, parallel_trials = ?, number_of_trials = ?, revision = revision + 1, \
         updated_at = ? where id = ?",
    )
    .bind(&limits.name)
    .bind(limits.priority)
    .bind(limits.parallel_trials)
    .bind(limits.number_of_trials)
    .bind(now())
    .bind(id)
    .execute(db)
    .await?;
    Ok(())
}

/// Sets tags and notes of a study, and whether it is archived. The caller writes an audit row, and [`set_limits`] counts
/// the revision.
///
/// # Errors
/// A violated constraint; errors of the database.
pub async fn set_filing(
    db: &mut Connection,
    id: StudyId,
    tags: &[String],
    notes: &str,
    archived_at: Option<Instant>,
) -> StoreResult<()> {
    sqlx::query("update studies set tags = ?, notes = ?, archived_at = ? where id = ?")
        .bind(if tags.is_empty() { None } else { Some(json_columns::to_text("tags", tags)?) })
        .bind(Some(notes).filter(|notes| !notes.is_empty()))
        .bind(archived_at)
        .bind(id)
        .execute(db)
        .await?;
    Ok(())
}

/// Changes the state of a study. Returns `false` if the state has changed since it was read.
///
/// # Errors
/// Errors of the database.
pub async fn set_state(db: &mut Connection, study: &Study, state: StudyState, reason: &str) -> StoreResult<bool> {
    let done = sqlx::query(
        "update studies set state = ?, state_reason = ?, revision = revision + 1, updated_at = ? \
         where id = ? and state = ?",
    )
    .bind(state.as_str())
    .bind(reason)
    .bind(now())
    .bind(study.id)
    .bind(study.state.as_str())
    .execute(db)
    .await?;
    Ok(done.rows_affected() == 1)
}

fn from_row(row: &SqliteRow) -> StoreResult<Study> {
    Ok(Study {
        id: row.try_get("id")?,
        plan: StudyPlan {
            name: row.try_get("name")?,
            subject_id: row.try_get("subject_id")?,
            body: Body { height_m: row.try_get("height_m")?, body_mass_kg: row.try_get("body_mass_kg")? },
            device_id: row.try_get("device_id")?,
            reference_gait_id: row.try_get("reference_gait_id")?,
            muscles: row.try_get("muscles")?,
            gait_settings: Box::new(json_columns::column(row, "gait_settings")?),
            solve_options: json_columns::column(row, "solve_options")?,
            base_bounds: json_columns::column(row, "base_bounds")?,
            search_space: json_columns::column(row, "search_space")?,
            learner: json_columns::column(row, "learner")?,
            answer_source: row.try_get::<&str, _>("answer_source")?.parse()?,
            evaluation: row.try_get::<&str, _>("evaluation")?.parse()?,
            number_of_trials: row.try_get("number_of_trials")?,
            solve_seconds_budget: row.try_get("solve_seconds_budget")?,
            unchanged_limit: row.try_get("unchanged_limit")?,
            repeat_results: row.try_get("repeat_results")?,
            warm_start_from: row.try_get::<&str, _>("warm_start_from")?.parse()?,
            atlas: row.try_get::<&str, _>("atlas")?.parse()?,
            simulated_walks: json_columns::column(row, "simulated_walks")?,
            parallel_trials: row.try_get("parallel_trials")?,
            priority: row.try_get("priority")?,
            seed: u64::try_from(row.try_get::<i64, _>("seed")?).unwrap_or(0),
        },
        cloned_from: row.try_get("cloned_from")?,
        state: row.try_get::<&str, _>("state")?.parse()?,
        state_reason: row.try_get("state_reason")?,
        revision: row.try_get("revision")?,
        tags: json_columns::optional_column(row, "tags")?.unwrap_or_default(),
        notes: row.try_get::<Option<String>, _>("notes")?.unwrap_or_default(),
        archived_at: row.try_get("archived_at")?,
        created_at: row.try_get("created_at")?,
        updated_at: row.try_get("updated_at")?,
    })
}
