//! Content and source of an entry of the feedback log.

use crate::trials::Label;
use crate::{StoreError, StoreResult, TrialId};
use gait_learner::ActionIndex;
use serde::{Deserialize, Serialize};
use std::str::FromStr;
use utoipa::ToSchema;

/// Source of an entry: `evaluation`, the optimiser or script that evaluated the trial; `gait_rmse`, the lower Gait RMSE wins; `subject` and
/// `clinician`, a person; `script`, a lab script.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum Source {
    /// The optimiser or script that evaluated the trial.
    Evaluation,
    /// Gait RMSE; the smaller one wins.
    GaitRmse,
    /// The subject.
    Subject,
    /// A clinician.
    Clinician,
    /// A script of the lab.
    Script,
}

impl Source {
    /// The name in the record and in REST.
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Evaluation => "evaluation",
            Self::GaitRmse => "gait_rmse",
            Self::Subject => "subject",
            Self::Clinician => "clinician",
            Self::Script => "script",
        }
    }
}

impl FromStr for Source {
    type Err = StoreError;
    fn from_str(text: &str) -> StoreResult<Self> {
        [Self::Evaluation, Self::GaitRmse, Self::Subject, Self::Clinician, Self::Script]
            .into_iter()
            .find(|source| source.as_str() == text)
            .ok_or_else(|| StoreError::unknown_value("feedback source", text))
    }
}

/// Content of an entry, in terms of trials.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FeedbackContent {
    /// Label of a trial.
    Label {
        /// Identifier of the trial.
        trial: TrialId,
        /// Whether the evaluation found a gait.
        label: Label,
    },
    /// One trial is better than another.
    Preference {
        /// Better trial.
        winner: TrialId,
        /// Worse trial.
        loser: TrialId,
    },
    /// Two trials are equally good.
    NoDifference {
        /// One trial.
        a: TrialId,
        /// The other trial.
        b: TrialId,
    },
    /// An action would have been better than a trial.
    Suggestion {
        /// Index of the suggested action.
        suggested: ActionIndex,
        /// Trial that it would have been better than.
        over: TrialId,
    },
}
