//! The solves of an explanation: whether a gait is found with these bounds or those, and what is remembered of it.

use super::bound::{halfway, is_as_loose, way};
use crate::bounds::TunedBounds;
use crate::solve::{
    CONVERGED_VIOLATION, CancelToken, ColdGuess, GaitProblem, SolveError, SolveOptions, SolveOutcome, SolveStatus,
    Violation, WarmStart, solve_from_guesses, solve_from_warm_start,
};
use std::cmp::Ordering;

/// Cold guesses that are tried side by side where the nearest gait leads to none, before it is said that none was found: of the
/// catalogue, those without which gaits were missed close to where there are none any more.
const COLD: [ColdGuess; 3] = [ColdGuess::NATURAL, ColdGuess::EARLY_RISE, ColdGuess::CATALOGUE[2]];
/// Iterations of a phase of one of these solves, cold and warm: gaits that converge take fewer, and most that do not would
/// go on for many more.
const MAX_ITERATIONS: usize = 400;
const MAX_ITERATIONS_WARM: usize = 250;
/// Bounds that are further from those of the nearest gait are approached in two steps.
const FAR: f64 = 0.5;

/// Why the search ends early.
pub(super) enum Stop {
    /// Somebody cancelled it.
    Cancelled,
    /// A solve could not be tried.
    Failed(SolveError),
}

impl<E: Into<SolveError>> From<E> for Stop {
    fn from(error: E) -> Self {
        Self::Failed(error.into())
    }
}

/// What a gait is looked for from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Starts {
    /// The nearest gait that is known, then cold.
    All,
    /// The nearest gait that is known, where one is.
    Nearest,
}

/// Bounds with which no gait was found, and where the search for one ended.
#[derive(Debug, Clone)]
pub(super) struct Unmet {
    bounds: TunedBounds,
    /// What is violated where the search came nearest, worst first; a stationary point of the violation before others.
    pub(super) violations: Vec<Violation>,
    rank: (bool, f64),
    /// Solves, each from another start.
    pub(super) starts: usize,
    /// Whether one of them gave up, at a limit or stalled.
    pub(super) undecided: bool,
}

impl Unmet {
    fn new(bounds: &TunedBounds) -> Self {
        let rank = (true, f64::INFINITY);
        Self { bounds: *bounds, violations: Vec::new(), rank, starts: 0, undecided: false }
    }

    /// Less: it came nearer to a gait, a stationary point of the violation before others.
    pub(super) fn nearness(&self, other: &Self) -> Ordering {
        compared(self.rank, other.rank)
    }

    fn take_in(&mut self, outcome: SolveOutcome) {
        let gave_up = |status: SolveStatus| status != SolveStatus::Infeasible;
        self.starts += outcome.report.attempts.len();
        self.undecided |= outcome.report.attempts.iter().any(|attempt| gave_up(attempt.status));
        let rank = (gave_up(outcome.report.status), outcome.report.max_violation);
        if compared(rank, self.rank).is_lt() {
            (self.rank, self.violations) = (rank, outcome.violations);
        }
    }
}

fn compared(a: (bool, f64), b: (bool, f64)) -> Ordering {
    a.0.cmp(&b.0).then(a.1.total_cmp(&b.1))
}

/// The solves of one explanation.
pub(super) struct Solves<'a> {
    problem: &'a GaitProblem,
    options: SolveOptions,
    cancel: &'a CancelToken,
    met: Vec<(TunedBounds, WarmStart)>,
    unmet: Vec<Unmet>,
    /// How many there were.
    pub(super) count: usize,
}

impl<'a> Solves<'a> {
    pub(super) fn new(problem: &'a GaitProblem, options: &SolveOptions, cancel: &'a CancelToken) -> Self {
        let options = SolveOptions {
            max_iterations: options.max_iterations.min(MAX_ITERATIONS),
            // Whether a gait converges does not depend on it.
            tightening_rounds: 0,
            ..*options
        };
        Self { problem, options, cancel, met: Vec::new(), unmet: Vec::new(), count: 0 }
    }

    /// Whether a gait is known or found with these bounds. What was found once is remembered: with looser bounds than
    /// those of a gait there is one, with tighter ones than those with which none was found none is looked for.
    pub(super) fn is_met(&mut self, bounds: &TunedBounds, starts: Starts) -> Result<bool, Stop> {
        if self.met.iter().any(|(known, _)| is_as_loose(bounds, known)) {
            return Ok(true);
        }
        if self.unmet(bounds).is_some() {
            return Ok(false);
        }
        let programme = self.with(bounds).programme(self.problem.muscles)?;
        let keeps = |warm: &WarmStart| {
            programme.violations(&warm.point.x).first().is_none_or(|worst| worst.amount <= CONVERGED_VIOLATION)
        };
        if let Some((_, gait)) = self.met.iter().find(|(_, gait)| keeps(gait)) {
            let gait = gait.clone();
            self.met.push((*bounds, gait));
            return Ok(true);
        }
        Ok(self.solve(bounds, starts)?.is_some())
    }

    fn with(&self, bounds: &TunedBounds) -> GaitProblem {
        GaitProblem { bounds: *bounds, ..self.problem.clone() }
    }

    /// A gait with these bounds: from the nearest that is known, at once or in two steps, then cold.
    pub(super) fn solve(&mut self, bounds: &TunedBounds, starts: Starts) -> Result<Option<WarmStart>, Stop> {
        let mut unmet = Unmet::new(bounds);
        let nearest = self.met.iter().min_by(|a, b| way(&a.0, bounds).total_cmp(&way(&b.0, bounds))).cloned();
        let cold = starts == Starts::All || nearest.is_none();
        if let Some((from, gait)) = nearest {
            if self.warm(bounds, &gait, &mut unmet)? {
                return Ok(self.latest());
            }
            let middle = halfway(&from, bounds)?;
            if way(&from, bounds) > FAR
                && self.warm(&middle, &gait, &mut Unmet::new(&middle))?
                && let Some(gait) = self.latest()
                && self.warm(bounds, &gait, &mut unmet)?
            {
                return Ok(self.latest());
            }
        }
        if cold {
            let outcome = solve_from_guesses(&self.with(bounds), &COLD, &self.options, &mut |_| {}, self.cancel)?;
            if self.is_gait(bounds, outcome, &mut unmet)? {
                return Ok(self.latest());
            }
        }
        self.unmet.push(unmet);
        Ok(None)
    }

    fn warm(&mut self, bounds: &TunedBounds, gait: &WarmStart, unmet: &mut Unmet) -> Result<bool, Stop> {
        let max_iterations = self.options.max_iterations.min(MAX_ITERATIONS_WARM);
        let options = SolveOptions { max_iterations, ..self.options };
        let outcome = solve_from_warm_start(&self.with(bounds), gait, &options, self.cancel)?;
        self.is_gait(bounds, outcome, unmet)
    }

    /// Takes in how a search for a gait ended.
    fn is_gait(&mut self, bounds: &TunedBounds, outcome: SolveOutcome, unmet: &mut Unmet) -> Result<bool, Stop> {
        self.count += outcome.report.attempts.len();
        if self.cancel.is_cancelled() {
            return Err(Stop::Cancelled);
        }
        if outcome.report.status == SolveStatus::Converged {
            self.met.push((*bounds, outcome.warm_start));
            return Ok(true);
        }
        unmet.take_in(outcome);
        Ok(false)
    }

    /// The gait that was found last.
    fn latest(&self) -> Option<WarmStart> {
        self.met.last().map(|(_, gait)| gait.clone())
    }

    /// A gait with bounds that are met, solved for where that converges.
    pub(super) fn gait(&mut self, bounds: &TunedBounds) -> Result<Option<WarmStart>, Stop> {
        if let Some((_, gait)) = self.met.iter().find(|(known, _)| known == bounds) {
            return Ok(Some(gait.clone()));
        }
        if let Some(gait) = self.solve(bounds, Starts::All)? {
            return Ok(Some(gait));
        }
        Ok(self.met.iter().find(|(known, _)| is_as_loose(bounds, known)).map(|(_, gait)| gait.clone()))
    }

    /// What is known of bounds with which no gait was found, or of looser ones.
    pub(super) fn unmet(&self, bounds: &TunedBounds) -> Option<&Unmet> {
        self.unmet.iter().find(|known| is_as_loose(&known.bounds, bounds))
    }
}
