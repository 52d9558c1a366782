//! The attempts of a solve: a warm start, then initial guesses in parallel, the choice of an attempt, and tightened
//! bounds between nodes.

use super::error::SolveError;
use super::multi_start::InitialGuess;
use super::options::LocalOptimumChoice;
use super::phases::{AttemptRun, SolveContext};
use super::progress::{IterationRecord, SolvePhase};
use super::solve_report::{CONVERGED_VIOLATION, LinearAlgebra, SolveAttempt, SolveStatus};
use super::warm_start::MeshStart;
use crate::gait::Gait;
use crate::gait_problem::gait_of;
use crate::gait_problem::inter_node_check::inter_node_excess;
use crate::gait_problem::margins::Margins;
use crate::gait_rmse::gait_rmse;
use interior_point::{NlpResult, NonlinearProgram};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc;

/// Largest differences of objective and Gait RMSE within a local optimum, at the tolerance of a solve.
const SAME_OBJECTIVE: f64 = 1e-4;
const SAME_RMSE_RAD: f64 = 5e-3;

/// A result with the quantities that decide the choice.
pub(super) struct Candidate {
    pub(super) result: NlpResult,
    pub(super) gait: Gait,
    pub(super) status: SolveStatus,
    objective: f64,
    rmse: f64,
    violation: f64,
}

impl Candidate {
    /// Measures the residuals after projection into the bounds, because the solver relaxes bounds by 1e-8.
    pub(super) fn new(context: &SolveContext<'_>, mut result: NlpResult) -> Self {
        let program = context.program;
        program.project_into_bounds(&mut result.x);
        let gait = gait_of(context.problem, program, &result.x);
        let violation = program.violations(&result.x).first().map_or(0.0, |v| v.amount);
        let mut status = SolveStatus::from(result.status);
        let met = violation <= CONVERGED_VIOLATION; // False for NaN.
        if status == SolveStatus::Converged && !met {
            status = SolveStatus::Stalled;
        }
        Self {
            objective: program.objective(&result.x),
            rmse: gait_rmse(&gait, &context.problem.reference).total,
            violation,
            status,
            gait,
            result,
        }
    }

    pub(super) fn attempt(&self, strategy: &str, run: &AttemptRun<'_>) -> SolveAttempt {
        SolveAttempt {
            strategy: strategy.to_owned(),
            status: self.status,
            iterations: run.iterations,
            seconds: run.seconds(),
            objective: self.objective,
            gait_rmse_rad: self.rmse,
            reason: run.reason.clone(),
            local_optimum: None,
            chosen: false,
        }
    }
}

/// A finished attempt.
pub(super) struct FinishedAttempt {
    pub(super) candidate: Candidate,
    pub(super) attempt: SolveAttempt,
    /// Tightened bounds.
    pub(super) margins: Margins,
    pub(super) evaluation_s: f64,
    pub(super) linear_algebra: LinearAlgebra,
}

impl FinishedAttempt {
    /// Whether no further attempt is needed: it converged or was stopped.
    pub(super) fn is_final(&self) -> bool {
        matches!(self.candidate.status, SolveStatus::Converged | SolveStatus::Cancelled | SolveStatus::TimeLimit)
    }

    fn new(
        context: &SolveContext<'_>,
        result: NlpResult,
        strategy: &str,
        margins: Margins,
        run: &AttemptRun<'_>,
    ) -> Self {
        let candidate = Candidate::new(context, result);
        Self {
            attempt: candidate.attempt(strategy, run),
            margins,
            evaluation_s: run.evaluation_s,
            linear_algebra: run.linear_algebra,
            candidate,
        }
    }
}

/// Tries a warm start with its tightened bounds. It has the same iteration limit as other attempts, because slow
/// progress does not predict failure (docs/benchmarks/optimizer.md, warm starts that fail).
pub(super) fn try_warm(
    context: &SolveContext<'_>,
    start: MeshStart,
    observer: &mut dyn FnMut(&IterationRecord),
) -> Result<FinishedAttempt, SolveError> {
    let mut run = AttemptRun::new(context, context.options.threads, observer);
    let MeshStart { point, mut margins, strategy } = start;
    if context.options.tightening_rounds == 0 {
        margins = Margins::default();
    }
    let result = if margins.is_empty() {
        run.warm(SolvePhase::Cost, context.program, point)
    } else {
        run.warm(SolvePhase::InterNode, &context.program.tightened(&margins), point)
    }?;
    Ok(FinishedAttempt::new(context, result, strategy, margins, &run))
}

/// Numbers the local optima of the attempts. Attempts with the same objective and Gait RMSE share a local optimum.
pub(super) fn number_local_optima(tried: &mut [FinishedAttempt]) {
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
        attempt.local_optimum = Some(number + 1);
    }
}

/// Tightens the bounds that the chosen gait violates between its nodes and continues the solve, until there is no
/// violation or the rounds are used up. Returns the index of the last converged attempt, or of a cancelled one.
pub(super) fn enforce_between_nodes(
    context: &SolveContext<'_>,
    tried: &mut Vec<FinishedAttempt>,
    mut chosen: usize,
    observer: &mut dyn FnMut(&IterationRecord),
) -> Result<usize, SolveError> {
    for _ in 0..context.options.tightening_rounds {
        let now = &tried[chosen];
        if now.candidate.status != SolveStatus::Converged {
            break;
        }
        let excess = inter_node_excess(context.program, &now.candidate.gait, &now.candidate.result.x);
        if excess.worst <= 1.0 {
            break;
        }
        let mut margins = now.margins.clone();
        margins.grow(&excess.margins);
        let point = now.candidate.result.warm_point();
        let mut run = AttemptRun::new(context, context.options.threads, observer);
        run.guess = tried.len();
        let result = run.warm(SolvePhase::InterNode, &context.program.tightened(&margins), point)?;
        let mut next = FinishedAttempt::new(context, result, "bounds tightened between nodes", margins, &run);
        next.attempt.local_optimum =
            tried[chosen].attempt.local_optimum.filter(|_| next.candidate.status == SolveStatus::Converged);
        let status = next.candidate.status;
        tried.push(next);
        if !matches!(status, SolveStatus::Converged | SolveStatus::Cancelled) {
            break;
        }
        chosen = tried.len() - 1;
    }
    Ok(chosen)
}

fn try_guess(
    context: &SolveContext<'_>,
    index: usize,
    guess: &InitialGuess,
    threads: usize,
    observer: &mut dyn FnMut(&IterationRecord),
) -> Result<FinishedAttempt, SolveError> {
    let mut run = AttemptRun::new(context, threads, observer);
    run.guess = index;
    let result = run.cold(guess)?;
    Ok(FinishedAttempt::new(context, result, &guess.label(), Margins::default(), &run))
}

/// Messages from the threads of the attempts to the calling thread.
#[allow(clippy::large_enum_variant)] // A few messages per solve, each moved once.
enum Message {
    Iteration(IterationRecord),
    Done(usize, Result<FinishedAttempt, SolveError>),
}

/// Tries all guesses, as many in parallel as there are threads. The results have the order of the guesses, the first
/// of which has the number `first`, and do not depend on the number of threads.
pub(super) fn try_guesses(
    context: &SolveContext<'_>,
    guesses: &[InitialGuess],
    first: usize,
    observer: &mut dyn FnMut(&IterationRecord),
) -> Result<Vec<FinishedAttempt>, SolveError> {
    let threads = context.options.threads;
    let workers = threads.min(guesses.len());
    if workers <= 1 {
        return (first..).zip(guesses).map(|(i, guess)| try_guess(context, i, guess, threads, observer)).collect();
    }
    let next = AtomicUsize::new(0);
    let mut done: Vec<Option<Result<FinishedAttempt, SolveError>>> = guesses.iter().map(|_| None).collect();
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

/// Number of attempts at a stationary point of the violation after which no further guess is tried. With feasible
/// bounds, so many guesses rarely end there.
const MOST_INFEASIBLE: usize = 3;

/// Tries the requested guesses in parallel, then further guesses until one converges.
pub(super) fn try_multi_start(
    context: &SolveContext<'_>,
    observer: &mut dyn FnMut(&IterationRecord),
) -> Result<Vec<FinishedAttempt>, SolveError> {
    let muscles = context.problem.muscles;
    let asked_for = context.options.initial_guesses;
    let guesses = InitialGuess::first(asked_for.max(InitialGuess::MULTI_START.len()), muscles);
    let (first, others) = guesses.split_at(asked_for);
    let mut tried = try_guesses(context, first, 0, observer)?;
    for guess in others.iter().filter(|guess| context.options.retry && InitialGuess::MULTI_START.contains(guess)) {
        let infeasible = tried.iter().filter(|t| t.candidate.status == SolveStatus::Infeasible).count();
        if tried.iter().any(FinishedAttempt::is_final) || infeasible >= MOST_INFEASIBLE {
            break;
        }
        tried.extend(try_guesses(context, std::slice::from_ref(guess), tried.len(), observer)?);
    }
    Ok(tried)
}

/// Index of the outcome: a cancelled attempt, otherwise a converged one by `choice`, otherwise the one with the
/// smallest violation. Among the latter, stationary points of the violation come first, because they show which
/// constraints conflict.
pub(super) fn choose(tried: &[FinishedAttempt], choice: LocalOptimumChoice) -> usize {
    if let Some(cancelled) = tried.iter().position(|t| t.candidate.status == SolveStatus::Cancelled) {
        return cancelled;
    }
    let converged = || tried.iter().enumerate().filter(|(_, t)| t.candidate.status == SolveStatus::Converged);
    let least = |key: &dyn Fn(&Candidate) -> f64, limit: f64| {
        converged()
            .filter(|(_, t)| t.candidate.objective <= limit)
            .min_by(|a, b| key(&a.1.candidate).total_cmp(&key(&b.1.candidate)))
            .map(|(index, t)| (index, t.candidate.objective))
    };
    let Some((lowest, objective)) = least(&|c| c.objective, f64::INFINITY) else {
        let gave_up = |t: &FinishedAttempt| t.candidate.status != SolveStatus::Infeasible;
        let violation = |t: &FinishedAttempt| t.candidate.violation;
        return tried
            .iter()
            .enumerate()
            .min_by(|(_, a), (_, b)| gave_up(a).cmp(&gave_up(b)).then(violation(a).total_cmp(&violation(b))))
            .map_or(0, |(index, _)| index);
    };
    match choice {
        LocalOptimumChoice::LowestObjective => lowest,
        LocalOptimumChoice::NearestToReference { within_percent } => {
            least(&|c| c.rmse, objective + 0.01 * within_percent * objective.abs()).map_or(lowest, |(index, _)| index)
        }
    }
}
