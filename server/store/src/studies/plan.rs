//! Set-up of a study.

use super::simulated_walks::SimulatedWalks;
use crate::{DeviceId, ReferenceGaitId, StoreError, StoreResult, SubjectId};
use gait_learner::{LearnerSettings, SearchSpace};
use gait_optimizer::{GaitSettings, SolveOptions, Subject as Body, TunedBounds};
use serde::{Deserialize, Serialize};
use std::str::FromStr;
use utoipa::ToSchema;

/// Source of the answers of a study: `gait_rmse`, Gait RMSE answers every comparison; `people`, people answer, and the study
/// waits for them; `both`, Gait RMSE answers, and people can add answers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum AnswerSource {
    /// Gait RMSE answers every comparison.
    GaitRmse,
    /// People answer, and the study waits for them.
    People,
    /// Gait RMSE answers, and people can add answers.
    Both,
}

impl AnswerSource {
    /// The name in the record and in REST.
    pub fn as_str(self) -> &'static str {
        match self {
            Self::GaitRmse => "gait_rmse",
            Self::People => "people",
            Self::Both => "both",
        }
    }
}

impl FromStr for AnswerSource {
    type Err = StoreError;
    fn from_str(text: &str) -> StoreResult<Self> {
        [Self::GaitRmse, Self::People, Self::Both]
            .into_iter()
            .find(|source| source.as_str() == text)
            .ok_or_else(|| StoreError::unknown_value("source of answers", text))
    }
}

/// Evaluation of trials: `optimizer`, by the service; `script`, by lab scripts that ask for trials and report results.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum Evaluation {
    /// The service, by optimisation.
    Optimizer,
    /// Lab scripts, which ask for trials and report their results.
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
            .ok_or_else(|| StoreError::unknown_value("evaluation", text))
    }
}

/// The gait from which a trial is warm-started: `incumbent`, the best gait so far, as in the published method; `root`, the
/// first gait of the study, which has the default bounds, so that the gait of an action does not depend on other trials.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum WarmStartFrom {
    /// The converged gait with the highest posterior mean.
    Incumbent,
    /// The first converged gait of the study.
    Root,
}

impl WarmStartFrom {
    /// The name in the record and in REST.
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Incumbent => "incumbent",
            Self::Root => "root",
        }
    }
}

impl FromStr for WarmStartFrom {
    type Err = StoreError;
    fn from_str(text: &str) -> StoreResult<Self> {
        [Self::Incumbent, Self::Root]
            .into_iter()
            .find(|from| from.as_str() == text)
            .ok_or_else(|| StoreError::unknown_value("warm start", text))
    }
}

/// Role of a study with an atlas, which has the gait of every action of a search space: `none`, no role; `make`, the study
/// is an atlas, whose trials find the gait of every action; `use`, the study tunes, and takes each gait at once from a
/// finished atlas of the same problem, if there is one on record.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum AtlasRole {
    /// Nothing.
    #[default]
    None,
    /// Finds the gait of every action.
    Make,
    /// Takes its gaits from an atlas.
    Use,
}

impl AtlasRole {
    /// The name in the record and in REST.
    pub fn as_str(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::Make => "make",
            Self::Use => "use",
        }
    }
}

impl FromStr for AtlasRole {
    type Err = StoreError;
    fn from_str(text: &str) -> StoreResult<Self> {
        [Self::None, Self::Make, Self::Use]
            .into_iter()
            .find(|role| role.as_str() == text)
            .ok_or_else(|| StoreError::unknown_value("role of an atlas", text))
    }
}

/// Set-up of a study.
#[derive(Debug, Clone, PartialEq)]
pub struct StudyPlan {
    /// Name shown to users.
    pub name: String,
    /// Identifier of the subject.
    pub subject_id: SubjectId,
    /// Height and mass used by solves, independent of later corrections.
    pub body: Body,
    /// Identifier of the device.
    pub device_id: DeviceId,
    /// Identifier of the reference gait for Gait RMSE.
    pub reference_gait_id: ReferenceGaitId,
    /// Whether the muscles are part of the gait problem (constraints C1 to C12 of the published method) or not (C1 to
    /// C4).
    pub muscles: bool,
    /// Settings of the gait problem.
    pub gait_settings: Box<GaitSettings>,
    /// Options of the solver: limits, tolerance, initial guesses and retries.
    pub solve_options: SolveOptions,
    /// Values of bounds that are not tuned.
    pub base_bounds: TunedBounds,
    /// Tuned bounds and their values, with each dimension named after its bound.
    pub search_space: SearchSpace,
    /// Settings of the learner.
    pub learner: LearnerSettings,
    /// Source of the answers.
    pub answer_source: AnswerSource,
    /// Evaluation of the trials, by the service or by lab scripts.
    pub evaluation: Evaluation,
    /// Number of trials.
    pub number_of_trials: u32,
    /// Total solve time, s, after which no new trial starts.
    pub solve_seconds_budget: Option<f64>,
    /// The study finishes when the best action has not changed over this many results.
    pub unchanged_limit: Option<u32>,
    /// Whether a trial may repeat an action whose gait another trial has already found, as in the published method.
    pub repeat_results: bool,
    /// The gait from which trials are warm-started.
    pub warm_start_from: WarmStartFrom,
    /// Role of the study with an atlas.
    pub atlas: AtlasRole,
    /// Simulated walks with each gait.
    pub simulated_walks: SimulatedWalks,
    /// Number of trials that run in parallel. Only 1 gives the published, reproducible order.
    pub parallel_trials: u32,
    /// Priority, -10 to 10. Higher values run first.
    pub priority: i32,
    /// Seed for all random draws except allocations.
    pub seed: u64,
}

impl StudyPlan {
    /// Whether no trial may have an action whose gait is known. Scripts measure, so equal actions can give other results.
    pub fn excludes_known_gaits(&self) -> bool {
        self.evaluation == Evaluation::Optimizer && !self.repeat_results
    }

    /// Whether a study with the other plan would try the same trials: same subject, problem, learner and seed. Name,
    /// priority and parallel trials do not matter.
    pub fn has_same_trials_as(&self, other: &Self) -> bool {
        let own = |plan: &Self| Self { name: String::new(), priority: 0, parallel_trials: 1, ..plan.clone() };
        own(self) == own(other)
    }
}
