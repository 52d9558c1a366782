//! Common context of the checks of an imported archive.

use super::super::archive_file::refuse;
use crate::error::Error;
use gait_optimizer::{ModelError, ReferenceGait};
use gaitwright_store::studies::Study;
use gaitwright_store::trials::{Trial, TrialState};
use gaitwright_store::{StoreError, TrialId};
use std::collections::HashMap;

/// The study data that trials must agree with.
pub(super) struct Context {
    pub(super) study: Study,
    pub(super) body: gait_optimizer::Subject,
    pub(super) device: gait_optimizer::Device,
    pub(super) reference: ReferenceGait,
}

/// A fault that a check found in an archive. The rows are checked in a record of their own, so advice for the record of the
/// service does not belong in it.
pub(super) trait Finding {
    fn finding(&self) -> String;
}

impl Finding for String {
    fn finding(&self) -> String {
        self.clone()
    }
}

impl Finding for ModelError {
    fn finding(&self) -> String {
        self.to_string()
    }
}

impl Finding for StoreError {
    fn finding(&self) -> String {
        self.finding()
    }
}

impl Finding for Error {
    fn finding(&self) -> String {
        match self {
            Self::Store(error) => error.finding(),
            other => other.to_string(),
        }
    }
}

/// Adds to an error where it occurred.
pub(super) fn at<T, E: Finding>(what: impl std::fmt::Display, result: Result<T, E>) -> Result<T, Error> {
    result.map_err(|error| refuse(format!("{what}: {}", error.finding())))
}

/// Checks that comparisons are about gaits of the study.
pub(super) fn of_gaits<const N: usize>(trials: &HashMap<TrialId, &Trial>, asked: [TrialId; N]) -> Result<(), String> {
    match asked.iter().find(|id| trials.get(*id).is_none_or(|trial| trial.state != TrialState::Converged)) {
        Some(id) => Err(format!("trial {id} is not a converged trial of this study")),
        None => Ok(()),
    }
}
