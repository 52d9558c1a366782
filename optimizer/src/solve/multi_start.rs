//! Multi-start: cold starts from several initial guesses, in parallel.

use super::cold_start_guesses::InitialGuess;
use super::error::SolveError;
use super::phases::{RunInProgress, SolveContext};
use super::progress::IterationRecord;
use super::solve_report::SolveStatus;
use super::solver_runs::FinishedRun;
use crate::gait_problem::margins::Margins;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc;

fn try_guess(
    context: &SolveContext<'_>,
    index: usize,
    guess: &InitialGuess,
    threads: usize,
    observer: &mut dyn FnMut(&IterationRecord),
) -> Result<FinishedRun, SolveError> {
    let mut run = RunInProgress::new(context, threads, observer);
    run.guess = index;
    let result = run.cold(guess)?;
    Ok(FinishedRun::new(context, result, &guess.label(), Margins::default(), &run))
}

/// Messages from the threads of the runs to the calling thread.
#[allow(clippy::large_enum_variant)] // A few messages per solve, each moved once.
enum Message {
    Iteration(IterationRecord),
    Done(usize, Result<FinishedRun, SolveError>),
}

/// Tries all guesses, as many in parallel as there are threads. The results have the order of the guesses, the first
/// of which has the number `first`, and do not depend on the number of threads.
pub(super) fn try_guesses(
    context: &SolveContext<'_>,
    guesses: &[InitialGuess],
    first: usize,
    observer: &mut dyn FnMut(&IterationRecord),
) -> Result<Vec<FinishedRun>, SolveError> {
    let threads = context.options.threads;
    let workers = threads.min(guesses.len());
    if workers <= 1 {
        return (first..).zip(guesses).map(|(i, guess)| try_guess(context, i, guess, threads, observer)).collect();
    }
    let next = AtomicUsize::new(0);
    let mut done: Vec<Option<Result<FinishedRun, SolveError>>> = guesses.iter().map(|_| None).collect();
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

/// Number of runs at a stationary point of the violation after which no further guess is tried. With feasible
/// bounds, so many guesses rarely end there.
const MAX_INFEASIBLE: usize = 3;

/// Tries the requested guesses in parallel, then further guesses until one converges.
pub(super) fn try_multi_start(
    context: &SolveContext<'_>,
    observer: &mut dyn FnMut(&IterationRecord),
) -> Result<Vec<FinishedRun>, SolveError> {
    let muscles = context.problem.muscles;
    let asked_for = context.options.initial_guesses;
    let guesses = InitialGuess::first(asked_for.max(InitialGuess::MULTI_START.len()), muscles);
    let (first, others) = guesses.split_at(asked_for);
    let mut tried = try_guesses(context, first, 0, observer)?;
    for guess in others.iter().filter(|guess| context.options.retry && InitialGuess::MULTI_START.contains(guess)) {
        let infeasible = tried.iter().filter(|t| t.candidate.status == SolveStatus::Infeasible).count();
        if tried.iter().any(FinishedRun::is_final) || infeasible >= MAX_INFEASIBLE {
            break;
        }
        tried.extend(try_guesses(context, std::slice::from_ref(guess), tried.len(), observer)?);
    }
    Ok(tried)
}
