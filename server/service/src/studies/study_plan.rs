//! Checks and creates a study, for pages, REST and the command line.

use super::bound_grid::{self, RequestedSearchSpace};
use super::seed::MAX_SEED;
use super::simulated_walks_setting::SimulatedWalksSetting;
use super::subject::{self, NewSubject};
use super::{atlas_role, built_in_entries, membership, simulated_walks, study_name, study_plan_schemas};
use crate::access::{Caller, Reach};
use crate::error::{Error, FieldError};
use crate::printable;
use gait_learner::{LearnerError, LearnerSettings};
use gait_optimizer::{GaitSettings, ModelError, SolveOptions, Subject as Body, TunedBounds};
use gaitwright_store::audit::{self, Actor};
use gaitwright_store::studies::{AnswerSource, AtlasRole, Evaluation, Study, StudyPlan, StudyState, WarmStartFrom};
use gaitwright_store::{
    Connection, DeviceId, ReferenceGaitId, StudyId, SubjectId, Writer, devices, events, members, reference_gaits,
    studies, subjects,
};
use serde::Deserialize;
use serde_json::json;
use utoipa::ToSchema;

/// A study to create. Every field except the subject has a default.
#[derive(Debug, Clone, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct NewStudy {
    /// Identifier of the subject.
    pub subject_id: SubjectId,
    /// Name shown to users, which must differ from the names of all studies that you can see. By default, it is made from
    /// subject, variant and seed.
    #[serde(default)]
    pub name: Option<String>,
    /// Identifier of the device. The built-in one by default.
    #[serde(default)]
    pub device_id: Option<DeviceId>,
    /// Reference gait for Gait RMSE. By default `falisse-2019`, even if others have been imported.
    #[serde(default)]
    pub reference_gait_id: Option<ReferenceGaitId>,
    /// Whether the muscles are part of the gait problem (constraints C1 to C12 of the published method) or not (C1 to
    /// C4).
    #[serde(default = "yes")]
    pub muscles: bool,
    /// Settings of the gait problem. If they contain no `muscles`, the measured muscle values of the subject apply.
    #[serde(default)]
    #[schema(value_type = study_plan_schemas::GaitSettingsSchema)]
    pub gait_settings: Box<GaitSettings>,
    /// Options of the solver: limits, tolerance, initial guesses and retries.
    #[serde(default)]
    #[schema(value_type = study_plan_schemas::SolveOptionsSchema)]
    pub solve_options: SolveOptions,
    /// Values of the bounds that are not tuned.
    #[serde(default)]
    #[schema(value_type = study_plan_schemas::BoundsSchema)]
    pub base_bounds: TunedBounds,
    /// Tuned bounds and their values. Table I of the paper by default.
    #[serde(default)]
    #[schema(value_type = Option<study_plan_schemas::SearchSpaceSchema>)]
    pub search_space: Option<RequestedSearchSpace>,
    /// Settings of the learner. Settings that are absent take the values recommended for the chosen `method`.
    #[serde(default)]
    #[schema(value_type = study_plan_schemas::LearnerSettingsSchema)]
    pub learner: LearnerSettings,
    /// Source of the answers.
    #[serde(default = "gait_rmse")]
    pub answer_source: AnswerSource,
    /// Evaluation of the trials, by the service or by lab scripts.
    #[serde(default = "optimizer")]
    pub evaluation: Evaluation,
    /// Number of trials.
    #[serde(default = "fifteen")]
    #[schema(minimum = 1, maximum = 10000)]
    pub number_of_trials: u32,
    /// Total solve time, s, after which no new trial starts.
    #[serde(default)]
    pub solve_seconds_budget: Option<f64>,
    /// The study finishes when the best action has not changed over this many results.
    #[serde(default)]
    #[schema(minimum = 1, maximum = 10000)]
    pub unchanged_limit: Option<u32>,
    /// Whether a trial may repeat an action whose gait another trial has already found, as in the published method.
    /// Defaults to the `repeats` setting of the learner. Has no effect if scripts evaluate the trials.
    #[serde(default)]
    pub repeat_results: Option<bool>,
    /// The gait from which trials are warm-started.
    #[serde(default = "incumbent")]
    pub warm_start_from: WarmStartFrom,
    /// Role of the study with an atlas. Anything but `none` needs `root` as `warm_start_from`.
    #[serde(default)]
    pub atlas: AtlasRole,
    /// Simulated walks with each gait. By default, the service simulates none.
    #[serde(default)]
    pub simulated_walks: SimulatedWalksSetting,
    /// Number of trials that run in parallel.
    #[serde(default = "one")]
    pub parallel_trials: u32,
    /// Priority, -10 to 10. Studies with a higher priority run first.
    #[serde(default)]
    pub priority: i32,
    /// Seed for all random draws except allocations.
    #[serde(default = "one_seed")]
    pub seed: u64,
    /// Whether to start the study immediately.
    #[serde(default = "yes")]
    pub start: bool,
    /// Whether only members and administrators can access the study. The creator becomes a member.
    #[serde(default)]
    pub restricted: bool,
}

fn yes() -> bool {
    true
}
fn gait_rmse() -> AnswerSource {
    AnswerSource::GaitRmse
}
fn optimizer() -> Evaluation {
    Evaluation::Optimizer
}
fn incumbent() -> WarmStartFrom {
    WarmStartFrom::Incumbent
}
fn fifteen() -> u32 {
    15
}
fn one() -> u32 {
    1
}
fn one_seed() -> u64 {
    1
}

impl NewStudy {
    /// A study of this subject with all defaults.
    pub fn of(subject_id: SubjectId) -> Self {
        Self {
            subject_id,
            name: None,
            device_id: None,
            reference_gait_id: None,
            muscles: true,
            gait_settings: Box::default(),
            solve_options: SolveOptions::default(),
            base_bounds: TunedBounds::default(),
            search_space: None,
            learner: LearnerSettings::default(),
            answer_source: AnswerSource::GaitRmse,
            evaluation: Evaluation::Optimizer,
            number_of_trials: fifteen(),
            solve_seconds_budget: None,
            unchanged_limit: None,
            repeat_results: None,
            warm_start_from: incumbent(),
            atlas: AtlasRole::None,
            simulated_walks: SimulatedWalksSetting::default(),
            parallel_trials: one(),
            priority: 0,
            seed: one_seed(),
            start: true,
            restricted: false,
        }
    }
}

impl NewStudy {
    /// A draft with the set-up of another study.
    pub fn like(plan: &StudyPlan) -> Self {
        Self {
            subject_id: plan.subject_id,
            name: Some(plan.name.clone()),
            device_id: Some(plan.device_id),
            reference_gait_id: Some(plan.reference_gait_id),
            muscles: plan.muscles,
            gait_settings: plan.gait_settings.clone(),
            solve_options: plan.solve_options,
            base_bounds: plan.base_bounds,
            search_space: Some(plan.search_space.clone().into()),
            learner: plan.learner.clone(),
            answer_source: plan.answer_source,
            evaluation: plan.evaluation,
            number_of_trials: plan.number_of_trials,
            solve_seconds_budget: plan.solve_seconds_budget,
            unchanged_limit: plan.unchanged_limit,
            repeat_results: Some(plan.repeat_results),
            warm_start_from: plan.warm_start_from,
            atlas: plan.atlas,
            simulated_walks: plan.simulated_walks.into(),
            parallel_trials: plan.parallel_trials,
            priority: plan.priority,
            seed: plan.seed,
            start: false,
            restricted: false,
        }
    }
}

/// Creates a study. `reach` has the studies whose names are taken.
///
/// # Errors
/// [`Error::Invalid`] naming the field, [`Error::NotFound`] for an unknown subject, device or reference gait.
pub async fn create(writer: &mut Writer, actor: &Actor, reach: Reach, new: NewStudy) -> Result<Study, Error> {
    create_from(writer, actor, reach, new, None).await
}

/// [`create`], and makes the caller a member if the study is restricted.
///
/// # Errors
/// As [`create`].
pub async fn create_by(writer: &mut Writer, caller: &Caller, new: NewStudy) -> Result<Study, Error> {
    let study = create(writer, &caller.actor, caller.reach(), new).await?;
    membership::ensure_caller_is_member(writer, caller, study.id).await?;
    Ok(study)
}

/// The same, for a clone of a study.
pub(super) async fn create_from(
    writer: &mut Writer,
    actor: &Actor,
    reach: Reach,
    new: NewStudy,
    cloned_from: Option<StudyId>,
) -> Result<Study, Error> {
    writer.check_free_space()?;
    let state = if new.start { StudyState::Running } else { StudyState::NotStarted };
    // A clone copies the set-up of its parent, muscle values included.
    let new = if cloned_from.is_some() { new } else { with_own_muscles(writer, new).await? };
    let restricted = new.restricted;
    let mut plan = check(writer, reach, new).await?;
    if let Some(parent) = cloned_from {
        // Both studies will be compared, so a correction of the subject since then does not apply.
        plan.body = studies::get(writer, parent).await?.plan.body;
    }
    let study = studies::insert(writer, &plan, state, cloned_from).await?;
    if restricted {
        members::set_restricted(writer, study.id, true, actor.as_str()).await?;
    }
    let payload = json!({ "state": study.state, "reason": "created" });
    events::append(writer, study.id, "study_changed", &payload).await?;
    let detail = json!({
        "name": study.plan.name, "state": study.state, "seed": study.plan.seed, "cloned_from": cloned_from,
        "restricted": restricted,
    });
    audit::append(writer, actor, "study.create", &format!("study {}", study.id), &detail).await?;
    Ok(study)
}

/// The plan of a study with all defaults filled in.
///
/// # Errors
/// As [`create`]; nothing is written.
pub async fn checked(db: &mut Connection, reach: Reach, new: NewStudy) -> Result<StudyPlan, Error> {
    let new = with_own_muscles(db, new).await?;
    check(db, reach, new).await
}

/// As [`checked`], for a subject who is not on record yet. Ignores [`NewStudy::subject_id`].
///
/// # Errors
/// As [`create`]; nothing is written.
pub async fn checked_for_new(
    db: &mut Connection,
    reach: Reach,
    subject: &NewSubject,
    new: NewStudy,
) -> Result<StudyPlan, Error> {
    let body = subject::checked(db, subject).await?;
    check_for(db, reach, subject.pseudonym.trim(), body, new).await
}

/// Fills in the measured muscle values of the subject, unless the study sets muscles itself.
async fn with_own_muscles(db: &mut Connection, mut new: NewStudy) -> Result<NewStudy, Error> {
    if new.gait_settings.muscles.is_published() {
        new.gait_settings.muscles = subjects::muscles(db, new.subject_id).await?;
    }
    Ok(new)
}

async fn check(db: &mut Connection, reach: Reach, new: NewStudy) -> Result<StudyPlan, Error> {
    let subject = subjects::get(db, new.subject_id).await?;
    check_for(db, reach, &subject.pseudonym, subject.body(), new).await
}

async fn check_for(
    db: &mut Connection,
    reach: Reach,
    pseudonym: &str,
    body: Body,
    new: NewStudy,
) -> Result<StudyPlan, Error> {
    let device_id = match new.device_id {
        Some(id) => devices::get(db, id).await?.id,
        None => built_in_entries::device(db).await?.id,
    };
    let reference_gait_id = match new.reference_gait_id {
        Some(id) => reference_gaits::get(db, id).await?.id,
        None => built_in_entries::reference_gait(db).await?.id,
    };
    let name = match new.name.as_deref().map(str::trim) {
        None => {
            study_name::free(db, reach, &study_name::by_default(pseudonym, new.muscles, new.seed, new.atlas)).await?
        }
        Some(name) => study_name::checked(db, reach, name, None).await?,
    };
    let search_space = match new.search_space {
        Some(given) => given.checked()?,
        None => bound_grid::table_i().map_err(Error::Learner)?,
    };
    let plan = StudyPlan {
        name,
        subject_id: new.subject_id,
        body,
        device_id,
        reference_gait_id,
        muscles: new.muscles,
        gait_settings: new.gait_settings,
        solve_options: new.solve_options,
        base_bounds: new.base_bounds,
        search_space,
        answer_source: new.answer_source,
        evaluation: new.evaluation,
        number_of_trials: new.number_of_trials,
        solve_seconds_budget: new.solve_seconds_budget,
        unchanged_limit: new.unchanged_limit,
        repeat_results: new.repeat_results.unwrap_or(new.atlas == AtlasRole::None && new.learner.repeats),
        warm_start_from: new.warm_start_from,
        atlas: new.atlas,
        simulated_walks: new.simulated_walks.into(),
        parallel_trials: new.parallel_trials,
        priority: new.priority,
        seed: new.seed,
        learner: new.learner,
    };
    check_plan(&plan)?;
    Ok(plan)
}

/// Checks every number of a new or imported study.
///
/// # Errors
/// [`Error::Invalid`] naming the field.
pub(super) fn check_plan(plan: &StudyPlan) -> Result<(), Error> {
    printable::name("name", &plan.name, study_name::MAX_LENGTH)?;
    check_range("number_of_trials", i64::from(plan.number_of_trials), 1, 10_000)?;
    check_range("parallel_trials", i64::from(plan.parallel_trials), 1, 64)?;
    check_range("priority", i64::from(plan.priority), -10, 10)?;
    if plan.solve_seconds_budget.is_some_and(|seconds| !(1.0..=1e8).contains(&seconds)) {
        return Err(Error::invalid("solve_seconds_budget", json!(plan.solve_seconds_budget), "1 to 1e8, or absent"));
    }
    if let Some(limit) = plan.unchanged_limit {
        check_range("unchanged_limit", i64::from(limit), 1, 10_000)?;
    }
    if plan.seed > MAX_SEED {
        return Err(Error::invalid("seed", plan.seed, &format!("0 to {MAX_SEED}")));
    }
    simulated_walks::check(plan)?;
    atlas_role::check(plan)?;
    let within = |part: &'static str| move |error: ModelError| FieldError::from(error).within(part);
    plan.gait_settings.validate().map_err(within("gait_settings"))?;
    plan.solve_options.validate().map_err(within("solve_options"))?;
    plan.base_bounds.validate().map_err(within("base_bounds"))?;
    bound_grid::validate(&plan.search_space, plan.base_bounds)?;
    check_learner(&plan.learner)?;
    if plan.learner.categories() != 2 {
        let allowed = "a list with one threshold, because a trial is either converged or not converged";
        return Err(Error::invalid("learner.ordinal_thresholds", json!(plan.learner.ordinal_thresholds), allowed));
    }
    Ok(())
}

/// Checks the settings of the learner.
///
/// # Errors
/// [`Error::Invalid`] with the path of the field.
fn check_learner(settings: &LearnerSettings) -> Result<(), Error> {
    let (setting, reason) = match settings.validate() {
        Ok(()) => return Ok(()),
        Err(LearnerError::InvalidSetting { setting, reason }) => (setting, reason),
        Err(other) => return Err(Error::Learner(other)),
    };
    let field = format!("learner.{setting}");
    let message = format!("{field} {reason}.");
    let value = json!(settings).get(setting).cloned();
    let allowed = reason.rsplit_once("must be ").map_or(reason.as_str(), |(_, allowed)| allowed).to_owned();
    Err(FieldError { field, value, allowed: Some(allowed), message }.into())
}

pub(super) fn check_range(field: &str, value: i64, minimum: i64, maximum: i64) -> Result<(), Error> {
    if (minimum..=maximum).contains(&value) {
        Ok(())
    } else {
        Err(Error::invalid(field, value, &format!("{minimum} to {maximum}")))
    }
}
