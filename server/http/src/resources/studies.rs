//! Studies.

use gait_learner::{LearnerSettings, SearchSpace};
use gait_optimizer::{GaitSettings, SolveOptions, TunedBounds};
use gaitwright_service::studies::simulated_walks_setting::SimulatedWalksSetting;
use gaitwright_service::studies::study_plan_schemas;
use gaitwright_store::studies::{self, AnswerSource, AtlasRole, Evaluation, StudyState, WarmStartFrom};
use gaitwright_store::{DeviceId, Instant, ReferenceGaitId, StudyId, SubjectId};
use serde::Serialize;
use utoipa::ToSchema;

/// A tuning run for one subject: its set-up and state.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct Study {
    /// Identifier.
    id: StudyId,
    /// Set-up of the study.
    #[serde(flatten)]
    plan: StudyPlan,
    /// Parent, if the study is a clone; otherwise null.
    cloned_from: Option<StudyId>,
    /// State of the study.
    state: StudyState,
    /// Reason for the state; may be empty.
    state_reason: String,
    /// Revision, which increases with each change.
    revision: i64,
    /// Tags for finding the study.
    tags: Vec<String>,
    /// Free-text notes.
    notes: String,
    /// Time at which the study was archived. Null if it is not archived. Lists leave out archived studies unless they
    /// are asked for; `GET /api/v1/studies?archived=true` lists them.
    archived_at: Option<Instant>,
    /// Time of creation.
    created_at: Instant,
    /// Time of the last change.
    updated_at: Instant,
}

impl From<studies::Study> for Study {
    fn from(row: studies::Study) -> Self {
        let studies::Study {
            id,
            plan,
            cloned_from,
            state,
            state_reason,
            revision,
            tags,
            notes,
            archived_at,
            created_at,
            updated_at,
        } = row;
        Self {
            id,
            plan: plan.into(),
            cloned_from,
            state,
            state_reason,
            revision,
            tags,
            notes,
            archived_at,
            created_at,
            updated_at,
        }
    }
}

/// Set-up of a study.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct StudyPlan {
    /// Name shown to users.
    name: String,
    /// Identifier of the subject.
    subject_id: SubjectId,
    /// Height and mass used by solves, independent of later corrections.
    body: BodyMeasures,
    /// Identifier of the device.
    device_id: DeviceId,
    /// Identifier of the reference gait for Gait RMSE.
    reference_gait_id: ReferenceGaitId,
    /// Whether the muscles are part of the gait problem (constraints C1 to C12 of the published method) or not (C1 to
    /// C4).
    muscles: bool,
    /// Settings of the gait problem.
    #[schema(value_type = study_plan_schemas::GaitSettingsSchema)]
    gait_settings: Box<GaitSettings>,
    /// Options of the solver: limits, tolerance, initial guesses and retries.
    #[schema(value_type = study_plan_schemas::SolveOptionsSchema)]
    solve_options: SolveOptions,
    /// Values of bounds that are not tuned.
    #[schema(value_type = study_plan_schemas::BoundsSchema)]
    base_bounds: TunedBounds,
    /// Tuned bounds and their values, with each dimension named after its bound.
    #[schema(value_type = study_plan_schemas::SearchSpaceSchema)]
    search_space: SearchSpace,
    /// Settings of the learner.
    #[schema(value_type = study_plan_schemas::LearnerSettingsSchema)]
    learner: LearnerSettings,
    /// Source of the answers.
    answer_source: AnswerSource,
    /// Evaluation of the trials, by the service or by lab scripts.
    evaluation: Evaluation,
    /// Number of trials.
    number_of_trials: u32,
    /// Total solve time, s, after which no new trial starts.
    solve_seconds_budget: Option<f64>,
    /// The study finishes when the best action has not changed over this many results.
    unchanged_limit: Option<u32>,
    /// Whether a trial may repeat an action whose gait another trial has already found, as in the published method.
    repeat_results: bool,
    /// The gait from which trials are warm-started.
    warm_start_from: WarmStartFrom,
    /// Role of the study with an atlas.
    atlas: AtlasRole,
    /// Simulated walks with each gait.
    simulated_walks: SimulatedWalksSetting,
    /// Number of trials that run in parallel. Only 1 gives the published, reproducible order.
    parallel_trials: u32,
    /// Priority, -10 to 10. Studies with a higher priority run first.
    priority: i32,
    /// Seed for all random draws except allocations.
    seed: u64,
}

impl From<studies::StudyPlan> for StudyPlan {
    fn from(row: studies::StudyPlan) -> Self {
        let studies::StudyPlan {
            name,
            subject_id,
            body,
            device_id,
            reference_gait_id,
            muscles,
            gait_settings,
            solve_options,
            base_bounds,
            search_space,
            learner,
            answer_source,
            evaluation,
            number_of_trials,
            solve_seconds_budget,
            unchanged_limit,
            repeat_results,
            warm_start_from,
            atlas,
            simulated_walks,
            parallel_trials,
            priority,
            seed,
        } = row;
        Self {
            name,
            subject_id,
            body: body.into(),
            device_id,
            reference_gait_id,
            muscles,
            gait_settings,
            solve_options,
            base_bounds,
            search_space,
            learner,
            answer_source,
            evaluation,
            number_of_trials,
            solve_seconds_budget,
            unchanged_limit,
            repeat_results,
            warm_start_from,
            atlas,
            simulated_walks: simulated_walks.into(),
            parallel_trials,
            priority,
            seed,
        }
    }
}

/// Height and mass of a subject.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct BodyMeasures {
    /// Body height, m.
    height_m: f64,
    /// Body mass, kg.
    body_mass_kg: f64,
}

impl From<gait_optimizer::Subject> for BodyMeasures {
    fn from(subject: gait_optimizer::Subject) -> Self {
        let gait_optimizer::Subject { height_m, body_mass_kg } = subject;
        Self { height_m, body_mass_kg }
    }
}
