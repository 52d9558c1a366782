//! The solves of an explanation: tests whether bounds have a gait, with a memory of earlier results.

use super::bound::{distance, halfway, is_as_loose};
use crate::gait_problem::GaitProblem;
use crate::solve::{
    CONVERGED_VIOLATION, CancelToken, InitialGuess, SolveError, SolveOptions, SolveOutcome, SolveStatus, Violation,
    WarmStart, solve_from_guesses, solve_from_warm_start,
};
use crate::tuned_bounds::TunedBounds;
use std::cmp::Ordering;

/// Initial guesses that are tried if the nearest gait leads to none: those that find gaits near the boundary of feasibility.
const COLD: [InitialGuess; 3] = [InitialGuess::NATURAL, InitialGuess::EARLY_RISE, InitialGuess::MULTI_START[2]];
/// Iteration limits of a phase in cold and warm solves. Solves that converge need fewer iterations.
const MAX_ITERATIONS: usize = 400;
const MAX_ITERATIONS_WARM: usize = 250;
/// Distance from the bounds of the nearest gait above which a solve takes two steps.
const TWO_STEP_DISTANCE: f64 = 0.5;

/// The reason for an early end of the search.
pub(super) enum SearchEnd {
    /// The explanation was cancelled.
    Cancelled,
    /// A solve could not start.
    Failed(SolveError),
}

impl<E: Into<SolveError>> From<E> for SearchEnd {
    fn from(error: E) -> Self {
        Self::Failed(error.into())
    }
}

/// The starts of a search for a gait.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Starts {
    /// The nearest known gait, then initial guesses.
    All,
    /// The nearest known gait only, if there is one.
    Nearest,
}

/// A failed search: bounds without a gait, and the nearest motion.
#[derive(Debug, Clone)]
pub(super) struct FailedSearch {
    bounds: TunedBounds,
    /// Violations of the nearest motion, worst first. Stationary points of the violation are preferred.
    pub(super) violations: Vec<Violation>,
    rank: (bool, f64),
    /// Number of solves, each from another start.
    pub(super) starts: usize,
    /// Whether a solve ended at a limit or stalled.
    pub(super) undecided: bool,
}

impl FailedSearch {
    fn new(bounds: &TunedBounds) -> Self {
        let rank = (true, f64::INFINITY);
        Self { bounds: *bounds, violations: Vec::new(), rank, starts: 0, undecided: false }
    }

    /// Rank of the result: smaller is nearer to a gait; stationary points of the violation come first.
    pub(super) fn nearness(&self, other: &Self) -> Ordering {
        compared(self.rank, other.rank)
    }

    fn take_in(&mut self, outcome: SolveOutcome) {
        let gave_up = |status: SolveStatus| status != SolveStatus::Infeasible;
        self.starts += outcome.report.solver_runs.len();
        self.undecided |= outcome.report.solver_runs.iter().any(|run| gave_up(run.status));
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
    unmet: Vec<FailedSearch>,
    /// Number of solves so far.
    pub(super) count: usize,
}

impl<'a> Solves<'a> {
    pub(super) fn new(problem: &'a GaitProblem, options: &SolveOptions, cancel: &'a CancelToken) -> Self {
        let options = SolveOptions {
            max_iterations: options.max_iterations.min(MAX_ITERATIONS),
            // Tightening between nodes begins after convergence.
            tightening_rounds: 0,
            ..*options
        };
        Self { problem, options, cancel, met: Vec::new(), unmet: Vec::new(), count: 0 }
    }

    /// Whether these bounds have a gait. Earlier results answer without a solve: looser bounds than those of a gait have one, and
    /// tighter bounds than those of a failed search count as having none.
    pub(super) fn is_met(&mut self, bounds: &TunedBounds, starts: Starts) -> Result<bool, SearchEnd> {
        if self.met.iter().any(|(known, _)| is_as_loose(bounds, known)) {
            return Ok(true);
        }
        if self.unmet(bounds).is_some() {
            return Ok(false);
        }
        let program = self.with(bounds).program(self.problem.muscles)?;
        let keeps = |warm: &WarmStart| {
            program.violations(&warm.point.x).first().is_none_or(|worst| worst.amount <= CONVERGED_VIOLATION)
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

    /// Searches a gait with these bounds: from the nearest known gait, in one or two steps, then from initial guesses.
    pub(super) fn solve(&mut self, bounds: &TunedBounds, starts: Starts) -> Result<Option<WarmStart>, SearchEnd> {
        let mut unmet = FailedSearch::new(bounds);
        let nearest = self.met.iter().min_by(|a, b| distance(&a.0, bounds).total_cmp(&distance(&b.0, bounds))).cloned();
        let cold = starts == Starts::All || nearest.is_none();
        if let Some((from, gait)) = nearest {
            if self.warm(bounds, &gait, &mut unmet)? {
                return Ok(self.latest());
            }
            let middle = halfway(&from, bounds)?;
            if distance(&from, bounds) > TWO_STEP_DISTANCE
                && self.warm(&middle, &gait, &mut FailedSearch::new(&middle))?
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

    fn warm(&mut self, bounds: &TunedBounds, gait: &WarmStart, unmet: &mut FailedSearch) -> Result<bool, SearchEnd> {
        let max_iterations = self.options.max_iterations.min(MAX_ITERATIONS_WARM);
        let options = SolveOptions { max_iterations, ..self.options };
        let outcome = solve_from_warm_start(&self.with(bounds), gait, &options, self.cancel)?;
        self.is_gait(bounds, outcome, unmet)
    }

    /// Adds the result of a solve to a failed search.
    fn is_gait(
        &mut self,
        bounds: &TunedBounds,
        outcome: SolveOutcome,
        unmet: &mut FailedSearch,
    ) -> Result<bool, SearchEnd> {
        self.count += outcome.report.solver_runs.len();
        if self.cancel.is_cancelled() {
            return Err(SearchEnd::Cancelled);
        }
        if outcome.report.status == SolveStatus::Converged {
            self.met.push((*bounds, outcome.warm_start));
            return Ok(true);
        }
        unmet.take_in(outcome);
        Ok(false)
    }

    /// The last gait that was found.
    fn latest(&self) -> Option<WarmStart> {
        self.met.last().map(|(_, gait)| gait.clone())
    }

    /// A gait with feasible bounds, by a solve if that converges.
    pub(super) fn gait(&mut self, bounds: &TunedBounds) -> Result<Option<WarmStart>, SearchEnd> {
        if let Some((_, gait)) = self.met.iter().find(|(known, _)| known == bounds) {
            return Ok(Some(gait.clone()));
        }
        if let Some(gait) = self.solve(bounds, Starts::All)? {
            return Ok(Some(gait));
        }
        Ok(self.met.iter().find(|(known, _)| is_as_loose(bounds, known)).map(|(_, gait)| gait.clone()))
    }

    /// The failed search with these bounds or looser ones.
    pub(super) fn unmet(&self, bounds: &TunedBounds) -> Option<&FailedSearch> {
        self.unmet.iter().find(|known| is_as_loose(&known.bounds, bounds))
    }
}
