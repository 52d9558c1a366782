//! Limits and numerical options of a solve.

use super::cold_guesses::ColdGuess;
use super::solver_settings;
use crate::nlp::NlpSettings;
use crate::subject::ModelError;
use serde::{Deserialize, Serialize};

/// Limits and numerical options of one solve.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct SolveOptions {
    /// Scaled optimality tolerance.
    pub tolerance: f64,
    /// Most iterations of each phase; those that track the reference have 200 at most.
    pub max_iterations: usize,
    /// Most seconds of wall time for the whole solve; `None`: no limit.
    pub time_limit_s: Option<f64>,
    /// Threads, 1 to 16: for the cold guesses side by side, then for the linear algebra of each. The result does not
    /// depend on it.
    pub threads: usize,
    /// How many guesses a cold start tries, whatever becomes of them ([`ColdGuess::first`]). 1 to [`ColdGuess::MOST`].
    pub cold_guesses: usize,
    /// Whether the other guesses follow, one after the other, until one converges.
    pub retry: bool,
    /// Which of the converged guesses is the answer.
    pub basin_choice: BasinChoice,
    /// How often bounds are tightened where the gait exceeds them between its nodes by more than half of what its
    /// certificate allows there, each time solving on from where it was; 0: never.
    pub tightening_rounds: usize,
    /// Settings of the interior point, but for those that the phases of a solve decide. In JSON only
    /// what differs from the default needs to be there.
    #[serde(with = "solver_settings", skip_serializing_if = "solver_settings::are_default")]
    pub solver: NlpSettings,
}

impl Default for SolveOptions {
    fn default() -> Self {
        Self {
            tolerance: 1e-6,
            max_iterations: 1000,
            time_limit_s: None,
            threads: 1,
            cold_guesses: 2,
            retry: true,
            basin_choice: BasinChoice::default(),
            tightening_rounds: 4,
            solver: solver_settings::default(),
        }
    }
}

impl SolveOptions {
    /// Checks every option.
    ///
    /// # Errors
    /// [`ModelError::OutOfRange`] naming the field.
    pub fn validate(&self) -> Result<(), ModelError> {
        ModelError::check_range("tolerance", self.tolerance, 1e-10, 1e-2)?;
        ModelError::check_range("max_iterations", self.max_iterations as f64, 1.0, 1e6)?;
        ModelError::check_range("threads", self.threads as f64, 1.0, 16.0)?;
        ModelError::check_range("cold_guesses", self.cold_guesses as f64, 1.0, ColdGuess::MOST as f64)?;
        self.basin_choice.validate()?;
        ModelError::check_range("tightening_rounds", self.tightening_rounds as f64, 0.0, 20.0)?;
        solver_settings::validate(&self.solver)?;
        if let Some(limit) = self.time_limit_s {
            ModelError::check_range("time_limit_s", limit, 0.0, 1e7)?;
        }
        Ok(())
    }
}

/// Which of several converged gaits is the answer.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, Default)]
#[serde(rename_all = "snake_case")]
pub enum BasinChoice {
    /// The one with the lowest objective.
    #[default]
    LowestObjective,
    /// The one with the lowest Gait RMSE among those whose objective is near the lowest.
    NearestToReference {
        /// How far above the lowest objective a gait may be, per cent.
        within_percent: f64,
    },
}

impl BasinChoice {
    /// Checks the percentage.
    ///
    /// # Errors
    /// [`ModelError::OutOfRange`] naming the field.
    pub fn validate(&self) -> Result<(), ModelError> {
        match self {
            Self::LowestObjective => Ok(()),
            Self::NearestToReference { within_percent } => {
                ModelError::check_range("basin_choice.within_percent", *within_percent, 0.0, 100.0).map(|_| ())
            }
        }
    }
}
