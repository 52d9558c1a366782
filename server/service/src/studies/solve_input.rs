//! What a solve begins with: for the worker that runs it, and as a file with which it is done again elsewhere.

use super::device;
use crate::error::Error;
use gait_optimizer::{GaitProblem, SolveOptions, TunedBounds, WarmStart};
use gaitwright_compute::OnPool;
use gaitwright_store::studies::StudyPlan;
use gaitwright_store::{Connection, Packed, TrialId, devices, gaits, reference_gaits, studies, subjects, trials};
use serde::{Deserialize, Serialize};

/// Everything that a solve depends on: the same input has the same outcome, to the last bit.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SolveInput {
    /// What to solve.
    pub problem: GaitProblem,
    /// Limits of the solve.
    #[serde(default)]
    pub options: SolveOptions,
    /// What to start from; `None`: cold.
    #[serde(default)]
    pub warm_start: Option<WarmStart>,
}

impl SolveInput {
    /// Checks every number that a file may hold.
    ///
    /// # Errors
    /// [`Error::Invalid`] naming the field.
    pub fn check(&self) -> Result<(), Error> {
        let Self { problem, options, .. } = self;
        problem.subject.validate()?;
        device::check(&problem.device)?;
        problem.bounds.validate()?;
        problem.settings.validate()?;
        problem.reference.validate()?;
        Ok(options.validate()?)
    }

    /// As a file.
    ///
    /// # Errors
    /// [`Error::Internal`] when it cannot be written as JSON.
    pub fn to_json(&self) -> Result<String, Error> {
        serde_json::to_string(self).map_err(|e| Error::Internal(e.to_string()))
    }
}

/// A solve input as it was read: its start is not unpacked yet.
#[derive(Debug)]
pub struct PackedInput {
    problem: GaitProblem,
    options: SolveOptions,
    warm_start: Option<Packed<WarmStart>>,
}

impl PackedInput {
    /// That of a trial, as its solve has it or had it.
    ///
    /// # Errors
    /// [`Error::NotFound`], also for the gait that it started from where that was dropped, or what the database reports.
    pub async fn of_trial(db: &mut Connection, id: TrialId) -> Result<Self, Error> {
        let trial = trials::get(db, id).await?;
        let plan = studies::get(db, trial.study_id).await?.plan;
        Self::of(db, &plan, trial.action, trial.warm_started_from).await
    }

    /// That of an action in a study, from the gait of a trial.
    ///
    /// # Errors
    /// As [`Self::of_trial`].
    pub async fn of(
        db: &mut Connection,
        plan: &StudyPlan,
        bounds: TunedBounds,
        start: Option<TrialId>,
    ) -> Result<Self, Error> {
        let subject = match plan.body {
            Some(body) => body,
            None => subjects::body_as_entered(db, plan.subject_id).await?,
        };
        let device = devices::get(db, plan.device_id).await?.definition;
        let reference = reference_gaits::get(db, plan.reference_gait_id).await?.definition;
        let warm_start = match start {
            Some(from) => Some(gaits::warm_start(db, from).await?),
            None => None,
        };
        let (muscles, settings) = (plan.muscles, *plan.gait_settings);
        let problem = GaitProblem { subject, device, bounds, muscles, settings, reference };
        Ok(Self { problem, options: plan.solve_options, warm_start })
    }

    /// The input.
    ///
    /// # Errors
    /// [`gaitwright_store::StoreError::Damaged`] for a start that cannot be unpacked.
    pub fn unpack(self, pool: &OnPool) -> Result<SolveInput, Error> {
        let Self { problem, options, warm_start } = self;
        let warm_start = warm_start.map(|start| start.unpack(pool)).transpose()?;
        Ok(SolveInput { problem, options, warm_start })
    }
}
