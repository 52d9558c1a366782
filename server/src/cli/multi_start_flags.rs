//! Flags for the initial guesses of a cold start, shared by `solve` and `tune`.

use super::flag_numbers::{number, whole};
use clap::Args;
use gait_optimizer::{InitialGuess, LocalOptimumChoice, ModelError, SolveOptions};
use gaitwright_service::error::Error;

fn initial_guesses(text: &str) -> Result<usize, String> {
    whole(text, 1, InitialGuess::MAX_GUESSES)
}

#[derive(Debug, Clone, Args)]
pub(super) struct MultiStartFlags {
    /// Minimum number of initial guesses of a cold start (default: 2). Different guesses may lead to different local
    /// optima, that is, to different gaits.
    #[arg(long, value_name = "NUMBER", value_parser = initial_guesses, allow_negative_numbers = true)]
    initial_guesses: Option<usize>,
    /// Among the gaits whose objective is within this percentage of the lowest, choose the one with the lowest Gait
    /// RMSE (default: the gait with the lowest objective).
    #[arg(long, value_name = "PERCENT", value_parser = number, allow_negative_numbers = true)]
    nearest_within: Option<f64>,
    /// Choose the gait of this local optimum: `solve` numbers them from 1, in the order in which the initial guesses of the cold
    /// start reached them.
    #[arg(long, value_name = "NUMBER", value_parser = initial_guesses, allow_negative_numbers = true, conflicts_with = "nearest_within")]
    local_optimum: Option<usize>,
}

impl MultiStartFlags {
    /// The options with these flags, validated.
    pub(super) fn applied_to(&self, mut options: SolveOptions) -> Result<SolveOptions, Error> {
        options.initial_guesses = self.initial_guesses.unwrap_or(options.initial_guesses);
        if let Some(within_percent) = self.nearest_within {
            ModelError::check_range("--nearest-within", within_percent, 0.0, 100.0)?;
            options.local_optimum_choice = LocalOptimumChoice::NearestToReference { within_percent };
        }
        if let Some(number) = self.local_optimum {
            options.local_optimum_choice = LocalOptimumChoice::Numbered { number };
        }
        options.validate()?;
        Ok(options)
    }
}
