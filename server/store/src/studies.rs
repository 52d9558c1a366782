//! Stored studies and their plans.

use super::members::{binds, reached};
use super::{
    Connection, DeviceId, Instant, ReferenceGaitId, StoreError, StoreResult, StudyId, SubjectId, json_columns, now,
    openapi_schemas,
};
use crate::accessible_studies::Reach;
use gait_learner::{LearnerSettings, SearchSpace};
use gait_optimizer::{GaitSettings, SolveOptions, Subject as Body, TunedBounds};
use serde::{Deserialize, Serialize};
use serde_json::Value;
use sqlx::Row;
use sqlx::sqlite::SqliteRow;
use std::str::FromStr;
use utoipa::ToSchema;

/// State of a study.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum StudyState {
    /// Not started yet.
    Draft,
    /// Proposing and evaluating trials.
    Running,
    /// Waiting for a preference of a person.
    Waiting,
    /// Paused by a person.
    Paused,
    /// The budget is used up, or a stopping rule applied.
    Finished,
    /// Stopped by a person.
    Stopped,
}

impl StudyState {
    /// The name in the record and in REST.
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Draft => "draft",
            Self::Running => "running",
            Self::Waiting => "waiting",
            Self::Paused => "paused",
            Self::Finished => "finished",
            Self::Stopped => "stopped",
        }
    }

    /// Whether the study is finished or stopped.
    pub fn has_ended(self) -> bool {
        matches!(self, Self::Finished | Self::Stopped)
    }
}

impl FromStr for StudyState {
    type Err = StoreError;
    fn from_str(text: &str) -> StoreResult<Self> {
        [Self::Draft, Self::Running, Self::Waiting, Self::Paused, Self::Finished, Self::Stopped]
            .into_iter()
            .find(|state| state.as_str() == text)
            .ok_or_else(|| StoreError::Damaged { what: "study state", reason: text.to_owned() })
    }
}

/// Who answers comparisons.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum FeedbackMode {
    /// Gait RMSE answers every comparison.
    Automatic,
    /// People answer, and the study waits for them.
    Human,
    /// Gait RMSE answers, and people can add answers.
    Mixed,
}

impl FeedbackMode {
    /// The name in the record and in REST.
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Automatic => "automatic",
            Self::Human => "human",
            Self::Mixed => "mixed",
        }
    }
}

impl FromStr for FeedbackMode {
    type Err = StoreError;
    fn from_str(text: &str) -> StoreResult<Self> {
        [Self::Automatic, Self::Human, Self::Mixed]
            .into_iter()
            .find(|mode| mode.as_str() == text)
            .ok_or_else(|| StoreError::Damaged { what: "feedback mode", reason: text.to_owned() })
    }
}

/// Who evaluates trials.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum Evaluation {
    /// The service, by optimisation.
    Optimizer,
    /// Lab scripts, which ask for trials and report their outcomes.
    Script,
}

impl Evaluation {
    /// The name in the record and in REST.
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Optimizer => "optimizer",
            Self::Script => "script",
        }
    }
}

impl FromStr for Evaluation {
    type Err = StoreError;
    fn from_str(text: &str) -> StoreResult<Self> {
        [Self::Optimizer, Self::Script]
            .into_iter()
            .find(|evaluation| evaluation.as_str() == text)
            .ok_or_else(|| StoreError::Damaged { what: "evaluation", reason: text.to_owned() })
    }
}

/// Set-up of a study.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct StudyPlan {
    /// Name shown to users.
    pub name: String,
    /// Subject of the study.
    pub subject_id: SubjectId,
    /// Height and mass used by solves, independent of later corrections. Absent in older studies, which use the values
    /// entered first.
    #[schema(value_type = Option<openapi_schemas::Body>)]
    pub body: Option<Body>,
    /// Device.
    pub device_id: DeviceId,
    /// Reference gait for Gait RMSE.
    pub reference_gait_id: ReferenceGaitId,
    /// Whether to solve with muscles (C1-C12) or without (C1-C4).
    pub muscles: bool,
    /// Settings of the gait problem.
    #[schema(value_type = openapi_schemas::GaitSettings)]
    pub gait_settings: Box<GaitSettings>,
    /// Limits of one solve.
    #[schema(value_type = openapi_schemas::SolveOptions)]
    pub solve_options: SolveOptions,
    /// Values of bounds that are not tuned.
    #[schema(value_type = openapi_schemas::Bounds)]
    pub base_bounds: TunedBounds,
    /// Tuned bounds and their values, with each dimension named after its bound.
    #[schema(value_type = openapi_schemas::SearchSpace)]
    pub search_space: SearchSpace,
    /// Settings of the learner.
    #[schema(value_type = openapi_schemas::LearnerSettings)]
    pub learner: LearnerSettings,
    /// Who answers comparisons.
    pub feedback_mode: FeedbackMode,
    /// Who evaluates trials.
    pub evaluation: Evaluation,
    /// Number of trials.
    pub trial_budget: u32,
    /// Total solve time, s, after which no new trial starts.
    pub solve_seconds_budget: Option<f64>,
    /// The study finishes when the best action has not changed over this many results.
    pub unchanged_limit: Option<u32>,
    /// Whether a trial may have an action whose gait is known from another trial, as in the paper. Always true for
    /// studies created by versions without this setting.
    pub repeat_results: bool,
    /// Number of trials that run in parallel. Only 1 gives the published, reproducible order.
    pub parallel_trials: u32,
    /// Priority, -10 to 10. Higher values run first.
    pub priority: i32,
    /// Seed for all random draws except allocations.
    pub seed: u64,
}

impl StudyPlan {
    /// Whether no trial may have an action whose gait is known. Scripts measure, so equal actions can give other results.
    pub fn tries_new_gaits_only(&self) -> bool {
        self.evaluation == Evaluation::Optimizer && !self.repeat_results
    }

    /// Whether a study with the other plan would try the same trials: same subject, problem, learner and seed. Name,
    /// priority and parallel trials do not matter.
    pub fn tries_the_same_as(&self, other: &Self) -> bool {
        // Older studies without a body use the values entered first.
        let bodies_differ = self.body.is_some() && other.body.is_some() && self.body != other.body;
        if bodies_differ {
            return false;
        }
        let own =
            |plan: &Self| Self { name: String::new(), body: None, priority: 0, parallel_trials: 1, ..plan.clone() };
        own(self) == own(other)
    }
}

/// Study.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct Study {
    /// Identifier.
    pub id: StudyId,
    /// Set-up.
    #[serde(flatten)]
    pub plan: StudyPlan,
    /// Parent, if the study is a fork.
    pub forked_from: Option<StudyId>,
    /// State.
    pub state: StudyState,
    /// Reason for the state; may be empty.
    pub state_reason: String,
    /// Revision, which increases with each change.
    pub revision: i64,
    /// Time of creation.
    pub created_at: Instant,
    /// Time of the last change.
    pub updated_at: Instant,
}

/// Reads stored settings. Older settings without a weight on the curvature of activations mean 0, while new studies
/// without it get the default.
fn recorded_settings(text: &str) -> StoreResult<GaitSettings> {
    let mut document: Value = json_columns::from_text("gait_settings", text)?;
    if let Some(weights) = document.get_mut("regularisation").and_then(Value::as_object_mut) {
        weights.entry("activation_bend").or_insert_with(|| 0.0.into());
    }
    serde_json::from_value(document).map_err(|e| StoreError::Damaged { what: "gait_settings", reason: e.to_string() })
}

/// Adds a study.
///
/// # Errors
/// A violated constraint; errors of the database.
pub async fn insert(
    db: &mut Connection,
    plan: &StudyPlan,
    state: StudyState,
    forked_from: Option<StudyId>,
) -> StoreResult<Study> {
    let at = now();
    let id = StudyId::fresh();
    sqlx::query(
        "insert into studies (id, name, subject_id, device_id, reference_gait_id, muscles, gait_settings, \
         solve_options, base_bounds, search_space, learner, feedback_mode, trial_budget, parallel_trials, priority, \
         seed, state, evaluation, solve_seconds_budget, unchanged_limit, forked_from, created_at, updated_at, \
         height_m, body_mass_kg, repeat_results) values (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)",
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
    .bind(plan.feedback_mode.as_str())
    .bind(plan.trial_budget)
    .bind(plan.parallel_trials)
    .bind(plan.priority)
    .bind(i64::try_from(plan.seed).unwrap_or(i64::MAX))
    .bind(state.as_str())
    .bind(plan.evaluation.as_str())
    .bind(plan.solve_seconds_budget)
    .bind(plan.unchanged_limit)
    .bind(forked_from)
    .bind(at)
    .bind(at)
    .bind(plan.body.map(|body| body.height_m))
    .bind(plan.body.map(|body| body.body_mass_kg))
    .bind(plan.repeat_results)
    .execute(db)
    .await?;
    Ok(Study {
        id,
        plan: plan.clone(),
        forked_from,
        state,
        state_reason: String::new(),
        revision: 1,
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

/// Which studies of those that a caller reaches.
#[derive(Debug, Clone, Copy, Default)]
pub struct Chosen {
    /// Of this subject.
    pub subject: Option<SubjectId>,
    /// In this state.
    pub state: Option<StudyState>,
    /// Older than this one.
    pub before: Option<StudyId>,
    /// At most so many.
    pub limit: u32,
}

impl Chosen {
    /// The newest ones.
    pub fn newest(limit: u32) -> Self {
        Self { limit, ..Self::default() }
    }
}

/// Studies that a caller reaches, newest first.
///
/// # Errors
/// Errors of the database.
pub async fn page(db: &mut Connection, reach: Reach, chosen: Chosen) -> StoreResult<Vec<Study>> {
    let (every, open, principal) = binds(reach);
    let sql = concat!(
        "select * from studies where ",
        reached!("id"),
        " and (?4 is null or id < ?4) and (?5 is null or subject_id = ?5) and (?6 is null or state = ?6) \
         order by id desc limit ?7"
    );
    let query = sqlx::query(sql).bind(every).bind(open).bind(principal).bind(chosen.before).bind(chosen.subject);
    let query = query.bind(chosen.state.map(StudyState::as_str)).bind(chosen.limit);
    query.fetch_all(db).await?.iter().map(from_row).collect()
}

/// The accessible studies with comparisons for raters, oldest first.
///
/// # Errors
/// Errors of the database.
pub async fn asking_raters(db: &mut Connection, reach: Reach) -> StoreResult<Vec<Study>> {
    let (every, open, principal) = binds(reach);
    let sql = concat!(
        "select * from studies where state in ('running', 'waiting') and feedback_mode <> 'automatic' and ",
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
    let (every, open, principal) = binds(reach);
    let sql = concat!(
        "select * from studies where state in ('waiting', 'paused', 'draft') and ",
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
         union select p.study_id from presentations p join presentation_answers a on a.presentation_id = p.id \
         where a.answer glob 'unsafe*' \
         union select l.study_id from lab_sessions l join lab_answers a on a.session_id = l.id \
         where a.answer glob 'unsafe*'"
    };
}

/// The newest accessible studies with a safety report that was not retracted, without those of subjects who withdrew
/// consent.
///
/// # Errors
/// Errors of the database.
pub async fn with_safety_reports(db: &mut Connection, reach: Reach, limit: u32) -> StoreResult<Vec<Study>> {
    let (every, open, principal) = binds(reach);
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
        ") or s.id = ?1 and (exists (select 1 from assessments where study_id = ?1) or exists (select 1 from presentations p \
         join presentation_answers a on a.presentation_id = p.id where p.study_id = ?1 and a.answer = 'cannot_tell'))) \
         order by s.id <> ?1, s.id"
    );
    Ok(sqlx::query_as(sql).bind(study).fetch_all(db).await?)
}

/// The newest accessible studies of a subject.
///
/// # Errors
/// Errors of the database.
pub async fn of_subject(db: &mut Connection, reach: Reach, subject: SubjectId, limit: u32) -> StoreResult<Vec<Study>> {
    let (every, open, principal) = binds(reach);
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
    pub trial_budget: u32,
}

/// Updates the changeable fields.
///
/// # Errors
/// A violated constraint; errors of the database.
pub async fn set_limits(db: &mut Connection, id: StudyId, limits: &StudyLimits) -> StoreResult<()> {
    sqlx::query(
        "update studies set name = ?, priority = ?, parallel_trials = ?, trial_budget = ?, revision = revision + 1, \
         updated_at = ? where id = ?",
    )
    .bind(&limits.name)
    .bind(limits.priority)
    .bind(limits.parallel_trials)
    .bind(limits.trial_budget)
    .bind(now())
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

fn body_of(row: &SqliteRow) -> StoreResult<Option<Body>> {
    let (height, mass): (Option<f64>, Option<f64>) = (row.try_get("height_m")?, row.try_get("body_mass_kg")?);
    Ok(height.zip(mass).map(|(height_m, body_mass_kg)| Body { height_m, body_mass_kg }))
}

fn from_row(row: &SqliteRow) -> StoreResult<Study> {
    Ok(Study {
        id: row.try_get("id")?,
        plan: StudyPlan {
            name: row.try_get("name")?,
            subject_id: row.try_get("subject_id")?,
            body: body_of(row)?,
            device_id: row.try_get("device_id")?,
            reference_gait_id: row.try_get("reference_gait_id")?,
            muscles: row.try_get("muscles")?,
            gait_settings: Box::new(recorded_settings(row.try_get("gait_settings")?)?),
            solve_options: json_columns::column(row, "solve_options")?,
            base_bounds: json_columns::column(row, "base_bounds")?,
            search_space: json_columns::column(row, "search_space")?,
            learner: json_columns::column(row, "learner")?,
            feedback_mode: row.try_get::<&str, _>("feedback_mode")?.parse()?,
            evaluation: row.try_get::<&str, _>("evaluation")?.parse()?,
            trial_budget: row.try_get("trial_budget")?,
            solve_seconds_budget: row.try_get("solve_seconds_budget")?,
            unchanged_limit: row.try_get("unchanged_limit")?,
            repeat_results: row.try_get::<Option<bool>, _>("repeat_results")?.unwrap_or(true),
            parallel_trials: row.try_get("parallel_trials")?,
            priority: row.try_get("priority")?,
            seed: u64::try_from(row.try_get::<i64, _>("seed")?).unwrap_or(0),
        },
        forked_from: row.try_get("forked_from")?,
        state: row.try_get::<&str, _>("state")?.parse()?,
        state_reason: row.try_get("state_reason")?,
        revision: row.try_get("revision")?,
        created_at: row.try_get("created_at")?,
        updated_at: row.try_get("updated_at")?,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn older_settings_without_curvature_weight_mean_zero() {
        let old = r#"{"mesh": {"ds2": 4, "ds3": 4, "ss2": 6, "ss1": 6}, "regularisation": {"power_smoothing_w": 1,
            "torque": 0.003, "acceleration": 0.0001, "contact_force": 0.0001, "activation": 0.003, "fibre_velocity": 0.01}}"#;
        assert_eq!(recorded_settings(old).unwrap(), GaitSettings::reference_problem());
        let new = serde_json::to_string(&GaitSettings::default()).unwrap();
        assert_eq!(recorded_settings(&new).unwrap(), GaitSettings::default());
    }
}
