//! The initial guesses of a cold start. There are several because the problem has several local optima.

use crate::gait_problem::program_data::{EVEN_TIMING, StrideTiming};
use crate::gait_problem::{GaitProblem, GaitProgram};
use crate::initial_guess::{self, GuessSettings};
use crate::model_error::ModelError;
use crate::number_format::with_unit;
use interior_point::{BarrierStrategy, NlpSettings};
use serde::{Deserialize, Serialize};

/// Route from the tracked motion without muscles to the cost phase with muscles. Without muscles all routes are the
/// same.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum MuscleRoute {
    /// Tracks the reference gait again with muscles.
    MuscleTracking,
    /// Starts the cost phase from the muscle states of the tracked motion.
    Direct,
    /// Starts the cost phase from the muscle states of the optimal gait without muscles.
    PlainOptimum,
}

/// Larger than any scaled violation: the curvature of the constraints counts from the first iteration.
const WHOLE_HESSIAN: f64 = 1e6;

/// Index of the knee among the angles of a reference gait.
const KNEE: usize = 2;

/// Shares of the stride of the domains of an initial guess.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, Default)]
#[serde(rename_all = "snake_case")]
pub enum GuessTiming {
    /// The same shares in both steps.
    #[default]
    Even,
    /// Time at which each stance foot rises onto its toe: from 0, early (0.15 of the stride after heel strike), to 1,
    /// late (0.36).
    Rises {
        /// The prosthetic foot.
        right: f64,
        /// The intact foot.
        left: f64,
    },
}

impl GuessTiming {
    /// The prosthetic foot rises early onto its toe, the intact foot late.
    pub const EARLY_RISE: Self = Self::Rises { right: 0.0, left: 1.0 };

    pub(super) fn fractions(self) -> StrideTiming {
        match self {
            Self::Even => EVEN_TIMING,
            Self::Rises { right, left } => {
                [0.0, 0.04, 0.06, 0.15 + 0.21 * right, 0.5, 0.54, 0.56, 0.65 + 0.21 * left, 1.0]
            }
        }
    }
}

/// Settings of the interior-point solver in the cost phase.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, Default)]
#[serde(rename_all = "snake_case")]
pub enum CostStrategy {
    /// The settings of the options.
    #[default]
    Usual,
    /// Adaptive barrier update: the barrier parameter follows the complementarity and may increase.
    AdaptiveBarrier,
    /// Regularisation of the Hessian and proximal term start at a hundred times their values, which shortens steps.
    MoreRegularisation,
    /// The restoration phase starts after two short steps, and ends when the violation has decreased to a tenth.
    EarlyRestoration,
}

impl CostStrategy {
    /// Applies the strategy to the settings of the phase.
    pub(super) fn applied(self, usual: &NlpSettings) -> NlpSettings {
        match self {
            Self::Usual => *usual,
            Self::AdaptiveBarrier => NlpSettings { barrier_strategy: BarrierStrategy::Adaptive, ..*usual },
            Self::MoreRegularisation => NlpSettings {
                hessian_regularisation_first: 100.0 * usual.hessian_regularisation_first,
                proximal_first: 100.0 * usual.proximal_first,
                ..*usual
            },
            Self::EarlyRestoration => NlpSettings { short_step_limit: 2, required_reduction: 0.1, ..*usual },
        }
    }

    fn in_words(self) -> Option<&'static str> {
        match self {
            Self::Usual => None,
            Self::AdaptiveBarrier => Some("adaptive barrier"),
            Self::MoreRegularisation => Some("more regularisation"),
            Self::EarlyRestoration => Some("early restoration"),
        }
    }
}

/// An initial guess.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct InitialGuess {
    /// Route to the cost phase.
    pub route: MuscleRoute,
    /// Factor on the knee flexion of the tracked reference gait; 1 as measured.
    pub knee_flexion: f64,
    /// Stride time, s.
    pub stride_time_s: f64,
    /// Stride length, m.
    pub stride_length_m: f64,
    /// Shares of the stride of the domains.
    pub timing: GuessTiming,
    /// Initial barrier parameter of the cost phase with muscles. Without muscles it is a tenth of this.
    pub barrier: f64,
    /// Scaled violation below which the curvature of the constraints counts (`NlpSettings::curvature_from_violation`).
    pub curvature_from: f64,
    /// Strategy of the cost phase.
    pub strategy: CostStrategy,
}

impl InitialGuess {
    /// The basic guess. With muscles it usually leads to the local optimum with a natural swing knee.
    pub const NATURAL: Self = Self {
        route: MuscleRoute::Direct,
        knee_flexion: 1.0,
        stride_time_s: 1.2,
        stride_length_m: 1.15,
        timing: GuessTiming::Even,
        barrier: 1e-5,
        curvature_from: 0.03,
        strategy: CostStrategy::Usual,
    };
    /// With muscles, this guess usually leads to the local optimum with the lowest objective and a stiff swing knee.
    pub const EARLY_RISE: Self = Self { timing: GuessTiming::EARLY_RISE, curvature_from: 0.3, ..Self::NATURAL };

    /// The fixed guesses. A cold start always tries the first [`SolveOptions::initial_guesses`](super::SolveOptions),
    /// and the others until one converges. If more are requested, [perturbed](Self::perturbed) ones follow. The
    /// timing of the domains has the largest influence on the local optimum, then the curvature of the constraints
    /// (`examples/local_optima.rs`).
    pub const MULTI_START: [Self; 14] = [
        Self::NATURAL,
        Self::EARLY_RISE,
        Self { curvature_from: WHOLE_HESSIAN, ..Self::NATURAL },
        Self { route: MuscleRoute::MuscleTracking, ..Self::NATURAL },
        Self { route: MuscleRoute::MuscleTracking, ..Self::EARLY_RISE },
        Self { route: MuscleRoute::PlainOptimum, ..Self::NATURAL },
        Self { stride_time_s: 1.1, stride_length_m: 1.25, ..Self::NATURAL },
        Self { stride_time_s: 1.1, stride_length_m: 1.25, ..Self::EARLY_RISE },
        Self { strategy: CostStrategy::MoreRegularisation, ..Self::NATURAL },
        Self { strategy: CostStrategy::AdaptiveBarrier, ..Self::NATURAL },
        Self { strategy: CostStrategy::EarlyRestoration, ..Self::NATURAL },
        Self { timing: GuessTiming::Rises { right: 0.0, left: 0.0 }, ..Self::NATURAL },
        Self { timing: GuessTiming::Rises { right: 1.0, left: 0.0 }, ..Self::NATURAL },
        Self { timing: GuessTiming::Rises { right: 1.0, left: 1.0 }, ..Self::NATURAL },
    ];

    /// Largest number of guesses of a cold start.
    pub const MAX_GUESSES: usize = 64;

    /// The first `count` guesses of a cold start: the fixed ones, then perturbed ones. Without muscles only those with
    /// [`MuscleRoute::Direct`] are used, because all routes are the same.
    pub fn first(count: usize, muscles: bool) -> Vec<Self> {
        let multi_start = Self::MULTI_START.into_iter().filter(|guess| muscles || guess.route == MuscleRoute::Direct);
        multi_start.chain((0..Self::MAX_GUESSES).map(Self::perturbed)).take(count).collect()
    }

    /// The guess with a number, from 1: the fixed ones for both variants, then perturbed ones. `None` for 0 and above
    /// [`MAX_GUESSES`](Self::MAX_GUESSES).
    pub fn numbered(number: usize) -> Option<Self> {
        let index = number.checked_sub(1).filter(|index| *index < Self::MAX_GUESSES)?;
        let perturbed = || Self::perturbed(index - Self::MULTI_START.len());
        Some(Self::MULTI_START.get(index).copied().unwrap_or_else(perturbed))
    }

    /// A guess with a perturbed timing, stride, knee flexion and threshold of the curvature. The perturbations are a
    /// quasirandom sequence (Roberts 2018, *The unreasonable effectiveness of quasirandom sequences*), which fills
    /// the ranges evenly for any count.
    pub fn perturbed(number: usize) -> Self {
        // The root of x^7 = x + 1, for six coordinates.
        const BASE: f64 = 1.112_775_684_278_705_5;
        let draw = |coordinate: i32, low: f64, high: f64| {
            let share = (0.5 + (number + 1) as f64 * BASE.powi(-coordinate)).fract();
            // Three decimals, so that labels are exact.
            (1e3 * (low + share * (high - low))).round() / 1e3
        };
        Self {
            timing: GuessTiming::Rises { right: draw(1, 0.0, 1.0), left: draw(2, 0.0, 1.0) },
            stride_time_s: draw(3, 1.0, 1.35),
            stride_length_m: draw(4, 1.0, 1.4),
            knee_flexion: draw(5, 0.7, 1.2),
            curvature_from: draw(6, 0.03, 0.5),
            ..Self::NATURAL
        }
    }

    /// Checks each field.
    ///
    /// # Errors
    /// [`ModelError::OutOfRange`] with the field.
    pub fn validate(&self) -> Result<(), ModelError> {
        ModelError::check_range("guess.knee_flexion", self.knee_flexion, 0.0, 2.0)?;
        ModelError::check_range("guess.stride_time_s", self.stride_time_s, 0.5, 3.0)?;
        ModelError::check_range("guess.stride_length_m", self.stride_length_m, 0.4, 2.0)?;
        if let GuessTiming::Rises { right, left } = self.timing {
            ModelError::check_range("guess.timing.right", right, 0.0, 1.0)?;
            ModelError::check_range("guess.timing.left", left, 0.0, 1.0)?;
        }
        ModelError::check_range("guess.barrier", self.barrier, 1e-9, 1.0)?;
        ModelError::check_range("guess.curvature_from", self.curvature_from, 0.0, WHOLE_HESSIAN)?;
        Ok(())
    }

    fn settings(&self) -> GuessSettings {
        GuessSettings { stride_time_s: self.stride_time_s, stride_length_m: self.stride_length_m }
    }

    /// The first point of the first phase, as scaled variables without muscles, for comparisons with other solvers.
    ///
    /// # Errors
    /// [`ModelError`] if the problem is invalid.
    pub fn first_point(&self, problem: &GaitProblem) -> Result<Vec<f64>, ModelError> {
        Ok(self.begin(&self.tracked(problem), &|| false)?.1)
    }

    /// The problem of the first phase, without muscles, and its first point.
    pub(super) fn begin(
        &self,
        tracked: &GaitProblem,
        cancel: &dyn Fn() -> bool,
    ) -> Result<(GaitProgram, Vec<f64>), ModelError> {
        let settings = self.settings();
        let plain = tracked.program(false)?.with_timing(&self.timing.fractions());
        let first = initial_guess::without_muscles(&plain, &settings, cancel);
        Ok((plain, first))
    }

    /// The problem with the modified reference gait for tracking.
    pub(super) fn tracked(&self, problem: &GaitProblem) -> GaitProblem {
        let mut problem = problem.clone();
        for angles in &mut problem.reference.angles_rad {
            angles[KNEE] *= self.knee_flexion;
        }
        problem
    }

    /// Label: `cold, muscle tracking`.
    pub fn label(&self) -> String {
        let mut label = match self.route {
            MuscleRoute::MuscleTracking => "cold, muscle tracking",
            MuscleRoute::Direct => "cold, direct",
            MuscleRoute::PlainOptimum => "cold, from the optimum without muscles",
        }
        .to_owned();
        let early_rise = self.timing == GuessTiming::EARLY_RISE;
        if early_rise {
            label.push_str(", early heel rise");
        }
        if let Some(strategy) = self.strategy.in_words() {
            label.push_str(", ");
            label.push_str(strategy);
        }
        if let GuessTiming::Rises { right, left } = self.timing
            && !early_rise
        {
            let when = |rise: f64| match rise {
                0.0 => "early".to_owned(),
                1.0 => "late".to_owned(),
                between => format!("at {between}"),
            };
            for part in [", heel rise ", &when(right), " on the right, ", &when(left), " on the left"] {
                label.push_str(part);
            }
        }
        let normal = if early_rise { Self::EARLY_RISE } else { Self::NATURAL };
        for (name, value, usual, unit) in [
            ("knee flexion × ", self.knee_flexion, normal.knee_flexion, ""),
            ("stride time ", self.stride_time_s, normal.stride_time_s, "s"),
            ("stride length ", self.stride_length_m, normal.stride_length_m, "m"),
            ("barrier ", self.barrier, normal.barrier, ""),
            ("constraint curvature once the violation is below ", self.curvature_from, normal.curvature_from, ""),
        ] {
            if value == WHOLE_HESSIAN {
                label.push_str(", exact Hessian from the start");
            } else if value != usual {
                for part in [", ", name, &with_unit(value, unit)] {
                    label.push_str(part);
                }
            }
        }
        label
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use std::collections::HashSet;

    #[test]
    fn guesses_are_valid_and_differ() {
        for muscles in [false, true] {
            let guesses = InitialGuess::first(InitialGuess::MAX_GUESSES, muscles);
            assert_eq!(guesses.len(), InitialGuess::MAX_GUESSES);
            for guess in &guesses {
                guess.validate().unwrap();
            }
            let labels: HashSet<String> = guesses.iter().map(InitialGuess::label).collect();
            assert_eq!(labels.len(), InitialGuess::MAX_GUESSES);
            assert_eq!(guesses[..2], [InitialGuess::NATURAL, InitialGuess::EARLY_RISE]);
        }
        assert!(
            InitialGuess::first(InitialGuess::MAX_GUESSES, false)
                .iter()
                .all(|guess| guess.route == MuscleRoute::Direct)
        );
    }

    #[test]
    fn early_rise_is_early_on_the_right_and_late_on_the_left() {
        assert_eq!(GuessTiming::EARLY_RISE.fractions(), [0.0, 0.04, 0.06, 0.15, 0.5, 0.54, 0.56, 0.86, 1.0]);
    }

    #[test]
    fn guesses_are_numbered_across_multi_start_and_perturbation() {
        let last = InitialGuess::MULTI_START.len();
        assert_eq!(InitialGuess::numbered(1), Some(InitialGuess::MULTI_START[0]));
        assert_eq!(InitialGuess::numbered(last), InitialGuess::MULTI_START.last().copied());
        assert_eq!(InitialGuess::numbered(last + 1), Some(InitialGuess::perturbed(0)));
        assert_eq!((InitialGuess::numbered(0), InitialGuess::numbered(InitialGuess::MAX_GUESSES + 1)), (None, None));
    }

    #[test]
    fn guess_label_names_the_perturbation() {
        assert_eq!(InitialGuess::MULTI_START[4].label(), "cold, muscle tracking, early heel rise");
        assert_eq!(
            InitialGuess::MULTI_START[12].label(),
            "cold, direct, heel rise late on the right, early on the left"
        );
        assert_eq!(
            InitialGuess::perturbed(0).label(),
            "cold, direct, heel rise at 0.399 on the right, at 0.308 on the left, knee flexion × 0.743, stride time 1.079 s, \
             stride length 1.061 m, constraint curvature once the violation is below 0.043"
        );
    }
}
