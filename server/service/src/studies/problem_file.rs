//! The input of a solve (`problem.json`), for workers and for reproducing a solve elsewhere.

use super::device;
use crate::error::Error;
use gait_optimizer::{GaitProblem, SolveOptions, TunedBounds, WarmStart};
use gaitwright_compute::OnPool;
use gaitwright_store::studies::StudyPlan;
use gaitwright_store::{Connection, Packed, TrialId, devices, gaits, reference_gaits, studies, trials};
use serde::{Deserialize, Serialize};

/// Everything that a solve depends on. The same input gives the same outcome, bit for bit.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SolveInput {
    /// The gait problem.
    pub problem: GaitProblem,
    /// Settings and limits of the solver.
    #[serde(default)]
    pub options: SolveOptions,
    /// The warm start; `None` for a cold start.
    #[serde(default)]
    pub warm_start: Option<WarmStart>,
}

impl SolveInput {
    /// Checks every number, for input from a file.
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

    /// The text of `problem.json`.
    ///
    /// # Errors
    /// [`Error::Internal`] when it cannot be written as JSON.
    pub fn to_json(&self) -> Result<String, Error> {
        serde_json::to_string(self).map_err(|e| Error::Internal(e.to_string()))
    }

    /// SHA-256 of the version of the program and of `problem.json`. Equal hashes mean equal outcomes.
    ///
    /// # Errors
    /// As [`Self::to_json`].
    pub fn sha256(&self) -> Result<String, Error> {
        let json = self.to_json()?;
        Ok(gaitwright_store::sha256(format!("{}\n{json}", env!("CARGO_PKG_VERSION")).as_bytes()))
    }
}

/// A stored solve input, whose warm start is still compressed.
#[derive(Debug)]
pub struct PackedInput {
    problem: GaitProblem,
    options: SolveOptions,
    warm_start: Option<Packed<WarmStart>>,
}

impl PackedInput {
    /// The input of a trial's solve.
    ///
    /// # Errors
    /// [`Error::NotFound`], even if the gait of its warm start was pruned; errors of the database.
    pub async fn of_trial(db: &mut Connection, id: TrialId) -> Result<Self, Error> {
        let trial = trials::get(db, id).await?;
        let plan = studies::get(db, trial.study_id).await?.plan;
        Self::of(db, &plan, trial.action, trial.warm_started_from).await
    }

    /// The input for an action of a study, with a warm start from the gait of a trial.
    ///
    /// # Errors
    /// As [`Self::of_trial`].
    pub async fn of(
        db: &mut Connection,
        plan: &StudyPlan,
        bounds: TunedBounds,
        start: Option<TrialId>,
    ) -> Result<Self, Error> {
        let subject = plan.body;
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

    /// Decompresses the input.
    ///
    /// # Errors
    /// [`gaitwright_store::StoreError::Damaged`] for a start that cannot be unpacked.
    pub fn unpack(self, pool: &OnPool) -> Result<SolveInput, Error> {
        let Self { problem, options, warm_start } = self;
        let warm_start = warm_start.map(|start| start.unpack(pool)).transpose()?;
        Ok(SolveInput { problem, options, warm_start })
    }
}
