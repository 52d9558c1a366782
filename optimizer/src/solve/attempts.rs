//! The attempts of a solve: a warm start, then initial guesses in parallel, the choice of an attempt, and tightened bounds
//! between nodes.

use super::cold_guesses::ColdGuess;
use super::run::{Context, Run};
use super::warm_start::Start;
use super::{Attempt, BasinChoice, IterationRecord, LinearAlgebra, Phase, SolveError, SolveStatus};
use crate::gait::Gait;
use crate::gait_problem::gait_of;
use crate::gait_problem::margins::{Margins, excess_between_points};
use crate::metrics::gait_rmse;
use crate::nlp::{NlpResult, NonlinearProgram};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc;

/// Largest scaled violation of a converged gait.
pub const CONVERGED_VIOLATION: f64 = 1e-6;

/// Largest differences of objective and Gait RMSE within a local optimum, at the tolerance of a solve.
const SAME_OBJECTIVE: f64 = 1e-4;
const SAME_RMSE_RAD: f64 = 5e-3;

/// A result with the quantities that decide the choice.
pub(super) struct Choice {
    pub(super) result: NlpResult,
    pub(super) gait: Gait,
    pub(super) status: SolveStatus,
    objective: f64,
    rmse: f64,
    violation: f64,
}

impl Choice {
    /// Measures the residuals after projection into the bounds, because the solver relaxes bounds by 1e-8.
    pub(super) fn new(context: &Context<'_>, mut result: NlpResult) -> Self {
        let programme = context.programme;
        programme.project_into_bounds(&mut result.x);
        let gait = gait_of(context.problem, programme, &result.x);
        let violation = programme.violations(&result.x).first().map_or(0.0, |v| v.amount);
        let mut status = SolveStatus::from(result.status);
        let met = violation <= CONVERGED_VIOLATION; // False for NaN.
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
            basin: None,
            chosen: false,
        }
    }
}

/// A finished attempt.
pub(super) struct Tried {
    pub(super) choice: Choice,
    pub(super) attempt: Attempt,
    /// Tightened bounds.
    pub(super) margins: Margins,
    pub(super) evaluation_s: f64,
    pub(super) linear_algebra: LinearAlgebra,
}

impl Tried {
    /// Whether no further attempt is needed: it converged or was stopped.
    pub(super) fn is_final(&self) -> bool {
        matches!(self.choice.status, SolveStatus::Converged | SolveStatus::Cancelled | SolveStatus::TimeLimit)
    }

    fn new(context: &Context<'_>, result: NlpResult, strategy: &str, margins: Margins, run: &Run<'_>) -> Self {
        let choice = Choice::new(context, result);
        Self {
            attempt: choice.attempt(strategy, run),
            margins,
            evaluation_s: run.evaluation_s,
            linear_algebra: run.linear_algebra,
            choice,
        }
    }
}

/// Tries a warm start with its tightened bounds. It has the same iteration limit as other attempts, because slow progress does
/// not predict failure (docs/benchmarks/optimizer.md, warm starts that fail).
pub(super) fn try_warm(
    context: &Context<'_>,
    start: Start,
    observer: &mut dyn FnMut(&IterationRecord),
) -> Result<Tried, SolveError> {
    let mut run = Run::new(context, context.options.threads, observer);
    let Start { point, mut margins, strategy } = start;
    if context.options.tightening_rounds == 0 {
        margins = Margins::default();
    }
    let result = if margins.is_empty() {
        run.warm(Phase::Cost, context.programme, point)
    } else {
        run.warm(Phase::BetweenPoints, &context.programme.tightened(&margins), point)
    }?;
    Ok(Tried::new(context, result, strategy, margins, &run))
}

/// Numbers the local optima of the attempts. Attempts with the same objective and Gait RMSE share a local optimum.
pub(super) fn number_basins(tried: &mut [Tried]) {
    let mut known: Vec<(f64, f64)> = Vec::new();
    for attempt in tried.iter_mut().map(|t| &mut t.attempt).filter(|a| a.status == SolveStatus::Converged) {
        let (objective, rmse) = (attempt.objective, attempt.gait_rmse_rad);
        let same = |&(other, other_rmse): &(f64, f64)| {
            (objective - other).abs() <= SAME_OBJECTIVE * other.abs() && (rmse - other_rmse).abs() <= SAME_RMSE_RAD
        };
        let number = known.iter().position(same).unwrap_or_else(|| {
            known.push((objective, rmse));
            known.len() - 1
        });
        attempt.basin = Some(number + 1);
    }
}

/// Tightens the bounds that the chosen gait violates between its nodes and continues the solve, until there is no violation or
/// the rounds are used up. Returns the index of the last converged attempt, or of a cancelled one.
pub(super) fn keep_between_points(
    context: &Context<'_>,
    tried: &mut Vec<Tried>,
    mut chosen: usize,
    observer: &mut dyn FnMut(&IterationRecord),
) -> Result<usize, SolveError> {
    for _ in 0..context.options.tightening_rounds {
        let now = &tried[chosen];
        if now.choice.status != SolveStatus::Converged {
            break;
        }
        let excess = excess_between_points(context.programme, &now.choice.gait, &now.choice.result.x);
        if excess.worst <= 1.0 {
            break;
        }
        let mut margins = now.margins.clone();
        margins.grow(&excess);
        let point = now.choice.result.warm_point();
        let mut run = Run::new(context, context.options.threads, observer);
        run.guess = tried.len();
        let result = run.warm(Phase::BetweenPoints, &context.programme.tightened(&margins), point)?;
        let mut next = Tried::new(context, result, "bounds tightened between nodes", margins, &run);
        next.attempt.basin = tried[chosen].attempt.basin.filter(|_| next.choice.status == SolveStatus::Converged);
        let status = next.choice.status;
        tried.push(next);
        if !matches!(status, SolveStatus::Converged | SolveStatus::Cancelled) {
            break;
        }
        chosen = tried.len() - 1;
    }
    Ok(chosen)
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
    Ok(Tried::new(context, result, &guess.label(), Margins::default(), &run))
}

/// Messages from the threads of the attempts to the calling thread.
#[allow(clippy::large_enum_variant)] // A few messages per solve, each moved once.
enum Message {
    Iteration(IterationRecord),
    Done(usize, Result<Tried, SolveError>),
}

/// Tries all guesses, as many in parallel as there are threads. The results have the order of the guesses, the first of which
/// has the number `first`, and do not depend on the number of threads.
pub(super) fn try_guesses(
    context: &Context<'_>,
    guesses: &[ColdGuess],
    first: usize,
    observer: &mut dyn FnMut(&IterationRecord),
) -> Result<Vec<Tried>, SolveError> {
    let threads = context.options.threads;
    let workers = threads.min(guesses.len());
    if workers <= 1 {
        return (first..).zip(guesses).map(|(i, guess)| try_guess(context, i, guess, threads, observer)).collect();
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
                        // The receiver is gone only if the calling thread panics.
                        let _ = sender.send(Message::Iteration(*record));
                    };
                    let tried = try_guess(context, first + index, guess, threads / workers, &mut tell);
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

/// Number of attempts at a stationary point of the violation after which no further guess is tried. With feasible bounds, so
/// many guesses rarely end there.
const MOST_INFEASIBLE: usize = 3;

/// Tries the requested guesses in parallel, then further guesses until one converges.
pub(super) fn try_catalogue(
    context: &Context<'_>,
    observer: &mut dyn FnMut(&IterationRecord),
) -> Result<Vec<Tried>, SolveError> {
    let muscles = context.problem.muscles;
    let asked_for = context.options.cold_guesses;
    let guesses = ColdGuess::first(asked_for.max(ColdGuess::CATALOGUE.len()), muscles);
    let (first, others) = guesses.split_at(asked_for);
    let mut tried = try_guesses(context, first, 0, observer)?;
    for guess in others.iter().filter(|guess| context.options.retry && ColdGuess::CATALOGUE.contains(guess)) {
        let infeasible = tried.iter().filter(|t| t.choice.status == SolveStatus::Infeasible).count();
        if tried.iter().any(Tried::is_final) || infeasible >= MOST_INFEASIBLE {
            break;
        }
        tried.extend(try_guesses(context, std::slice::from_ref(guess), tried.len(), observer)?);
    }
    Ok(tried)
}

/// Index of the outcome: a cancelled attempt, otherwise a converged one by `choice`, otherwise the one with the smallest
/// violation. Among the latter, stationary points of the violation come first, because they show which constraints conflict.
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
        let gave_up = |t: &Tried| t.choice.status != SolveStatus::Infeasible;
        let violation = |t: &Tried| t.choice.violation;
        return tried
            .iter()
            .enumerate()
            .min_by(|(_, a), (_, b)| gave_up(a).cmp(&gave_up(b)).then(violation(a).total_cmp(&violation(b))))
            .map_or(0, |(index, _)| index);
    };
    match choice {
        BasinChoice::LowestObjective => lowest,
        BasinChoice::NearestToReference { within_percent } => {
            least(&|c| c.rmse, objective + 0.01 * within_percent * objective.abs()).map_or(lowest, |(index, _)| index)
        }
    }
}
