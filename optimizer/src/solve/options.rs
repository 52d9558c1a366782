//! Options of a solve.

use super::cold_start_guesses::InitialGuess;
use super::solver_settings;
use crate::model_error::ModelError;
use interior_point::NlpSettings;
use serde::{Deserialize, Serialize};

/// Options of a solve.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct SolveOptions {
    /// Scaled optimality tolerance.
    pub tolerance: f64,
    /// Largest number of iterations of each phase; tracking phases have at most 200.
    pub max_iterations: usize,
    /// Largest wall time of the whole solve, s; `None` for no limit. With a limit, equal inputs need not give equal bits:
    /// the machine's speed decides which runs and iterations come before it.
    pub time_limit_s: Option<f64>,
    /// Number of threads, 1 to 16: for initial guesses in parallel, then for the linear algebra of each. The result
    /// does not depend on it.
    pub threads: usize,
    /// Number of initial guesses that a cold start always tries ([`InitialGuess::first`]), 1 to [`InitialGuess::MAX_GUESSES`].
    pub initial_guesses: usize,
    /// Whether further guesses follow until one converges.
    pub retry: bool,
    /// The choice among converged runs.
    pub local_optimum_choice: LocalOptimumChoice,
    /// Largest number of rounds in which bounds are tightened if the gait violates them between nodes by more than
    /// half of the limit of the certificate. 0 disables the check.
    pub tightening_rounds: usize,
    /// Settings of the interior-point solver, except those that the phases of a solve determine. In JSON, missing
    /// fields have their defaults.
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
            initial_guesses: 2,
            retry: true,
            local_optimum_choice: LocalOptimumChoice::default(),
            tightening_rounds: 4,
            solver: solver_settings::default(),
        }
    }
}

impl SolveOptions {
    /// Checks each option.
    ///
    /// # Errors
    /// [`ModelError::OutOfRange`] with the field.
    pub fn validate(&self) -> Result<(), ModelError> {
        ModelError::check_range("tolerance", self.tolerance, 1e-10, 1e-2)?;
        ModelError::check_range("max_iterations", self.max_iterations as f64, 1.0, 1e6)?;
        ModelError::check_range("threads", self.threads as f64, 1.0, 16.0)?;
        ModelError::check_range("initial_guesses", self.initial_guesses as f64, 1.0, InitialGuess::MAX_GUESSES as f64)?;
        self.local_optimum_choice.validate()?;
        ModelError::check_range("tightening_rounds", self.tightening_rounds as f64, 0.0, 20.0)?;
        solver_settings::validate(&self.solver)?;
        if let Some(limit) = self.time_limit_s {
            ModelError::check_range("time_limit_s", limit, 0.0, 1e7)?;
        }
        Ok(())
    }
}

/// The choice among several converged gaits.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, Default)]
#[serde(rename_all = "snake_case")]
pub enum LocalOptimumChoice {
    /// The gait with the lowest objective.
    #[default]
    LowestObjective,
    /// The gait with the lowest Gait RMSE among those with an objective near the lowest.
    NearestToReference {
        /// Largest excess over the lowest objective, per cent.
        within_percent: f64,
    },
    /// The gait of one local optimum. A cold start in place of a warm start that found no gait chooses the lowest objective
    /// instead, because its local optima are others.
    Numbered {
        /// Number of the local optimum, in the order in which the initial guesses of the cold start reached them, from 1.
        number: usize,
    },
}

impl LocalOptimumChoice {
    /// Checks percentage and number.
    ///
    /// # Errors
    /// [`ModelError::OutOfRange`] with the field.
    pub fn validate(&self) -> Result<(), ModelError> {
        match self {
            Self::LowestObjective => Ok(()),
            Self::NearestToReference { within_percent } => {
                ModelError::check_range("local_optimum_choice.within_percent", *within_percent, 0.0, 100.0).map(|_| ())
            }
            Self::Numbered { number } => {
                let most = InitialGuess::MAX_GUESSES as f64;
                ModelError::check_range("local_optimum_choice.number", *number as f64, 1.0, most).map(|_| ())
            }
        }
    }
}
