//! What a solve tries: a warm start, then several cold guesses, because the problem has several local optima. The
//! guesses are tried side by side, one attempt is chosen.

use super::run::{Context, Run};
use super::{CONVERGED_VIOLATION, GaitProblem, IterationRecord, SolveError, SolveStatus, WarmStart, status_of};
use crate::cold_start::GuessSettings;
use crate::gait::Gait;
use crate::gait_problem::gait_of;
use crate::gait_problem::programme::{EVEN_TIMING, StrideTiming};
use crate::metrics::gait_rmse;
use crate::nlp::{NlpResult, NonlinearProgram};
use crate::subject::ModelError;
use serde::{Deserialize, Serialize};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc;

/// From the tracked motion without muscles to the start of the cost phase with muscles. Without muscles: the same.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ColdRoute {
    /// Tracks the reference again with muscles.
    MuscleTracking,
    /// Straight from the muscle guess on the tracked motion.
    Direct,
    /// Straight from the muscle guess on the cheapest gait without muscles.
    PlainOptimum,
}

/// Place of the knee among the reference's angles.
const KNEE: usize = 2;

/// Share of the stride that each domain of a cold guess takes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, Default)]
#[serde(rename_all = "snake_case")]
pub enum GuessTiming {
    /// Both steps alike.
    #[default]
    Even,
    /// The step on the prosthesis rises early onto its toe, the other late.
    EarlyRise,
}

impl GuessTiming {
    pub(super) fn fractions(self) -> StrideTiming {
        match self {
            Self::Even => EVEN_TIMING,
            Self::EarlyRise => [0.0, 0.04, 0.06, 0.15, 0.5, 0.54, 0.56, 0.86, 1.0],
        }
    }
}

/// One way to begin cold.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ColdGuess {
    /// Route to the cost phase.
    pub route: ColdRoute,
    /// Factor on the knee flexion of the reference that is tracked (1: as measured).
    pub knee_flexion: f64,
    /// Stride time, s.
    pub stride_time_s: f64,
    /// Stride length, m.
    pub stride_length_m: f64,
    /// Shares of the domains.
    pub timing: GuessTiming,
    /// First barrier parameter of the cost phase.
    pub barrier: f64,
}

impl ColdGuess {
    /// The plainest guess: the basin with the natural swing knee.
    pub const NATURAL: Self = Self {
        route: ColdRoute::Direct,
        knee_flexion: 1.0,
        stride_time_s: 1.2,
        stride_length_m: 1.15,
        timing: GuessTiming::Even,
        barrier: 1e-4,
    };

    /// The guesses of a cold start, the first [`SolveOptions::cold_guesses`](super::SolveOptions) of which are tried.
    /// The timing decides the basin (with muscles: natural or stiff swing knee); route, knee flexion, stride and barrier
    /// hardly matter (`examples/basins.rs`).
    pub const CATALOGUE: [Self; 5] = [
        Self::NATURAL,
        Self { timing: GuessTiming::EarlyRise, ..Self::NATURAL },
        Self { route: ColdRoute::MuscleTracking, ..Self::NATURAL },
        Self { route: ColdRoute::MuscleTracking, timing: GuessTiming::EarlyRise, ..Self::NATURAL },
        Self { route: ColdRoute::PlainOptimum, ..Self::NATURAL },
    ];

    /// Checks every field.
    ///
    /// # Errors
    /// [`ModelError::OutOfRange`] naming the field.
    pub fn validate(&self) -> Result<(), ModelError> {
        ModelError::check_range("guess.knee_flexion", self.knee_flexion, 0.0, 2.0)?;
        ModelError::check_range("guess.stride_time_s", self.stride_time_s, 0.5, 3.0)?;
        ModelError::check_range("guess.stride_length_m", self.stride_length_m, 0.4, 2.0)?;
        ModelError::check_range("guess.barrier", self.barrier, 1e-9, 1.0)?;
        Ok(())
    }

    pub(super) fn settings(&self) -> GuessSettings {
        GuessSettings { stride_time_s: self.stride_time_s, stride_length_m: self.stride_length_m }
    }

    /// The problem whose reference is tracked.
    pub(super) fn tracked(&self, problem: &GaitProblem) -> GaitProblem {
        let mut problem = problem.clone();
        for angles in &mut problem.reference.angles_rad {
            angles[KNEE] *= self.knee_flexion;
        }
        problem
    }

    /// In words: `cold, muscle tracking`.
    pub fn label(&self) -> String {
        let mut label = match self.route {
            ColdRoute::MuscleTracking => "cold, muscle tracking",
            ColdRoute::Direct => "cold, direct",
            ColdRoute::PlainOptimum => "cold, from the optimum without muscles",
        }
        .to_owned();
        if self.timing == GuessTiming::EarlyRise {
            label.push_str(", early rise");
        }
        let normal = Self::NATURAL;
        for (name, value, usual, unit) in [
            ("knee flexion x", self.knee_flexion, normal.knee_flexion, ""),
            ("stride time ", self.stride_time_s, normal.stride_time_s, " s"),
            ("stride length ", self.stride_length_m, normal.stride_length_m, " m"),
            ("barrier ", self.barrier, normal.barrier, ""),
        ] {
            if value != usual {
                for part in [", ", name, &value.to_string(), unit] {
                    label.push_str(part);
                }
            }
        }
        label
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

/// One thing that a solve tried.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Attempt {
    /// What, in words.
    pub strategy: String,
    /// How it ended.
    pub status: SolveStatus,
    /// Iterations over its phases.
    pub iterations: usize,
    /// Wall time, s.
    pub seconds: f64,
    /// Objective where it ended.
    pub objective: f64,
    /// Gait RMSE where it ended, rad.
    pub gait_rmse_rad: f64,
    /// Why it could not be carried through, in words; empty when it could.
    #[serde(default)]
    pub reason: String,
    /// Whether it is the answer.
    pub chosen: bool,
}

/// A result with what choosing needs.
pub(super) struct Choice {
    pub(super) result: NlpResult,
    pub(super) gait: Gait,
    pub(super) status: SolveStatus,
    objective: f64,
    rmse: f64,
    violation: f64,
}

impl Choice {
    /// The residuals of the point that is handed out are measured on that point, after it is moved into its bounds
    /// (the solver works in bounds widened by 1e-8).
    pub(super) fn new(context: &Context<'_>, mut result: NlpResult) -> Self {
        let programme = context.programme;
        programme.project_into_bounds(&mut result.x);
        let gait = gait_of(context.problem, programme, &result.x);
        let violation = programme.violations(&result.x).first().map_or(0.0, |v| v.amount);
        let mut status = status_of(result.status);
        let met = violation <= CONVERGED_VIOLATION; // false for NaN
        if status == SolveStatus::Converged && !met {
            status = SolveStatus::Stalled;
        }
        Self {
            objective: programme.objective(&result.x),
            rmse: gait_rmse(&gait, &context.problem.reference).total,
            violation,
            status,
            gait,
            result,
        }
    }

    pub(super) fn attempt(&self, strategy: &str, run: &Run<'_>) -> Attempt {
        Attempt {
            strategy: strategy.to_owned(),
            status: self.status,
            iterations: run.iterations,
            seconds: run.seconds(),
            objective: self.objective,
            gait_rmse_rad: self.rmse,
            reason: run.reason.clone(),
            chosen: false,
        }
    }
}

/// A finished attempt.
pub(super) struct Tried {
    pub(super) choice: Choice,
    pub(super) attempt: Attempt,
    pub(super) evaluation_s: f64,
    pub(super) linear_algebra_s: f64,
}

impl Tried {
    fn new(context: &Context<'_>, result: NlpResult, strategy: &str, run: &Run<'_>) -> Self {
        let choice = Choice::new(context, result);
        Self {
            attempt: choice.attempt(strategy, run),
            evaluation_s: run.evaluation_s,
            linear_algebra_s: run.linear_algebra_s,
            choice,
        }
    }
}

/// Tries a warm start.
pub(super) fn try_warm(
    context: &Context<'_>,
    warm: &WarmStart,
    observer: &mut dyn FnMut(&IterationRecord),
) -> Result<Tried, SolveError> {
    let mut run = Run::new(context, context.options.threads, observer);
    let result = run.warm(warm)?;
    Ok(Tried::new(context, result, "warm start", &run))
}

fn try_guess(
    context: &Context<'_>,
    index: usize,
    guess: &ColdGuess,
    threads: usize,
    observer: &mut dyn FnMut(&IterationRecord),
) -> Result<Tried, SolveError> {
    let mut run = Run::new(context, threads, observer);
    run.guess = index;
    let result = run.cold(guess)?;
    Ok(Tried::new(context, result, &guess.label(), &run))
}

/// What the threads tell the calling one.
#[allow(clippy::large_enum_variant)] // a handful of messages per solve end, each moved once
enum Message {
    Iteration(IterationRecord),
    Done(usize, Result<Tried, SolveError>),
}

/// Tries every guess, as many at a time as there are threads. Results come in the order of the guesses and do not
/// depend on the number of threads.
pub(super) fn try_guesses(
    context: &Context<'_>,
    guesses: &[ColdGuess],
    observer: &mut dyn FnMut(&IterationRecord),
) -> Result<Vec<Tried>, SolveError> {
    let threads = context.options.threads;
    let workers = threads.min(guesses.len());
    if workers <= 1 {
        return guesses.iter().enumerate().map(|(i, guess)| try_guess(context, i, guess, threads, observer)).collect();
    }
    let next = AtomicUsize::new(0);
    let mut done: Vec<Option<Result<Tried, SolveError>>> = guesses.iter().map(|_| None).collect();
    std::thread::scope(|scope| {
        let (sender, receiver) = mpsc::channel();
        for _ in 0..workers {
            let (sender, next) = (sender.clone(), &next);
            scope.spawn(move || {
                loop {
                    let index = next.fetch_add(1, Ordering::Relaxed);
                    let Some(guess) = guesses.get(index) else { break };
                    let mut tell = |record: &IterationRecord| {
                        // Nobody listens any more only when the calling thread is unwinding.
                        let _ = sender.send(Message::Iteration(*record));
                    };
                    let tried = try_guess(context, index, guess, threads / workers, &mut tell);
                    let _ = sender.send(Message::Done(index, tried));
                }
            });
        }
        drop(sender);
        for message in receiver {
            match message {
                Message::Iteration(record) => observer(&record),
                Message::Done(index, tried) => done[index] = Some(tried),
            }
        }
    });
    done.into_iter().flatten().collect()
}

/// Index of the answer: a cancelled attempt if there is one (the caller wants no answer), otherwise by `choice` among
/// the converged, otherwise the one with the smallest violation.
pub(super) fn choose(tried: &[Tried], choice: BasinChoice) -> usize {
    if let Some(cancelled) = tried.iter().position(|t| t.choice.status == SolveStatus::Cancelled) {
        return cancelled;
    }
    let converged = || tried.iter().enumerate().filter(|(_, t)| t.choice.status == SolveStatus::Converged);
    let least = |key: &dyn Fn(&Choice) -> f64, limit: f64| {
        converged()
            .filter(|(_, t)| t.choice.objective <= limit)
            .min_by(|a, b| key(&a.1.choice).total_cmp(&key(&b.1.choice)))
            .map(|(index, t)| (index, t.choice.objective))
    };
    let Some((lowest, objective)) = least(&|c| c.objective, f64::INFINITY) else {
        let violation = |t: &Tried| t.choice.violation;
        return tried
            .iter()
            .enumerate()
            .min_by(|a, b| violation(a.1).total_cmp(&violation(b.1)))
            .map_or(0, |(index, _)| index);
    };
    match choice {
        BasinChoice::LowestObjective => lowest,
        BasinChoice::NearestToReference { within_percent } => {
            least(&|c| c.rmse, objective + 0.01 * within_percent * objective.abs()).map_or(lowest, |(index, _)| index)
        }
    }
}
