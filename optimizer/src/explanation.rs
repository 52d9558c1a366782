//! Why no gait was found for a set of tuned bounds: which of them contradict each other, what cannot be met with those, and
//! which one has to give way and how far, or which several. Nothing is said of bounds that were not solved with.

use crate::bounds::TunedBounds;
use crate::nlp::NonlinearProgram;
use crate::solve::{
    CancelToken, GaitProblem, SolveError, SolveOptions, SolveOutcome, SolveStatus, Violation, WarmStart,
};
use serde::{Deserialize, Serialize};
use std::cell::RefCell;

mod at_limit;
mod bound;
mod conflict;
mod solves;
mod words;

use at_limit::domains_at_limit;
use bound::{Level, least_move, loosened, loosest, step};
use conflict::{BoundSet, conflict, remedies};
use solves::{Solves, Starts, Stop, Unmet};
pub use words::verdict;

/// The most bounds that are made to give way together.
const MOST_TOGETHER: usize = 3;
/// The most violations that are kept of a conflict.
const VIOLATIONS: usize = 5;

/// A solve that ended without a gait, as it left off.
#[derive(Debug, Clone, Copy)]
pub struct Unsolved<'a> {
    /// How it ended.
    pub status: SolveStatus,
    /// What its last iterate violates, worst first.
    pub violations: &'a [Violation],
    /// Its last iterate.
    pub last: &'a WarmStart,
}

impl<'a> From<&'a SolveOutcome> for Unsolved<'a> {
    fn from(outcome: &'a SolveOutcome) -> Self {
        Self { status: outcome.report.status, violations: &outcome.violations, last: &outcome.warm_start }
    }
}

/// A tuned bound that the last iterate runs into.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct BoundAtLimit {
    /// `a1`..`a8`.
    pub bound: String,
    /// What it limits, with its unit.
    pub meaning: String,
    /// Its value.
    pub value: f64,
    /// Where it is reached.
    pub domains: Vec<String>,
}

/// A tuned bound as it is given.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct GivenBound {
    /// `a1`..`a8`.
    pub bound: String,
    /// What it limits, with its unit.
    pub meaning: String,
    /// Its value.
    pub value: f64,
}

/// Tuned bounds that contradict each other: no gait was found with all of them, one was without any one of them, every other
/// tuned bound being at its loosest.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Conflict {
    /// Those bounds. None: no gait was found with every tuned bound at its loosest, so what is fixed contradicts itself.
    pub bounds: Vec<GivenBound>,
    /// Bounds of the other conflicts that had given way when this one was left.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub without: Vec<String>,
    /// Wishes that are part of what is fixed, where that contradicts itself.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub wishes: Vec<String>,
    /// What these bounds make impossible: violated where the search for a gait came nearest, all other tuned bounds
    /// loosened, worst first; a stationary point of the violation before others.
    pub violations: Vec<Violation>,
    /// From how many starts a gait was looked for.
    pub starts: usize,
    /// Whether one of them gave up, at a limit or stalled: others are at a stationary point of the violation.
    pub undecided: bool,
}

/// What relaxing one tuned bound alone achieves.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Relaxation {
    /// `a1`..`a8`.
    pub bound: String,
    /// What it limits, with its unit.
    pub meaning: String,
    /// The given value.
    pub from: f64,
    /// The value nearest to it, of those tried, with which a gait converged; `None`: not even with the loosest.
    pub to: Option<f64>,
    /// The loosest value tried with which none did.
    pub not_with: f64,
    /// Whether a solve with it gave up, at a limit or stalled: that there is no gait is not known then.
    pub undecided: bool,
    /// Solves that this took.
    pub solves: usize,
    /// From how many starts a gait with `not_with` was looked for; 0: unknown, or only those of the solve that is explained.
    #[serde(default)]
    pub starts: usize,
    /// Where the gait with `to` was found. It came from its neighbours: other starts may not reach it.
    #[serde(skip)]
    pub warm_start: Option<WarmStart>,
}

/// How far one of several bounds gives way.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RelaxedBound {
    /// `a1`..`a8`.
    pub bound: String,
    /// What it limits, with its unit.
    pub meaning: String,
    /// The given value.
    pub from: f64,
    /// The value nearest to it, of those tried together, with which a gait converged; `None`: not even with the loosest.
    pub to: Option<f64>,
    /// The loosest value tried, together with those of the others, with which none did.
    pub not_with: f64,
}

/// What relaxing several tuned bounds together achieves, where no single one helps: each by the same share of the way to its
/// loosest.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct JointRelaxation {
    /// Those bounds, one of each conflict.
    pub bounds: Vec<RelaxedBound>,
    /// As in a [`Relaxation`].
    pub undecided: bool,
    /// Solves that this took.
    pub solves: usize,
    /// As in a [`Relaxation`].
    pub starts: usize,
    /// As in a [`Relaxation`].
    #[serde(skip)]
    pub warm_start: Option<WarmStart>,
}

/// Why no gait was found.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Explanation {
    /// How the solve ended.
    pub status: SolveStatus,
    /// What the last iterate violates, worst first.
    pub violations: Vec<Violation>,
    /// The bounds that contradict each other; further ones where no single bound resolves the first. Explanations of
    /// earlier versions have none.
    #[serde(default)]
    pub conflicts: Vec<Conflict>,
    /// Whether the search found a gait with the bounds as they are: the solve missed it.
    #[serde(default)]
    pub gait_found: bool,
    /// The bounds that the last iterate runs into.
    pub at_limit: Vec<BoundAtLimit>,
    /// What relaxing each bound of the first conflict alone achieves (no other can), the smallest relaxation (as a factor
    /// or share of the range) first, those that do not help last.
    pub relaxations: Vec<Relaxation>,
    /// What relaxing several together achieves, where no single one helps, smallest first.
    #[serde(default)]
    pub together: Vec<JointRelaxation>,
    /// Where the gait that the solve missed was found.
    #[serde(skip)]
    pub missed: Option<WarmStart>,
}

/// How far the bounds of a relaxation give way.
fn size<'a>(bounds: impl Iterator<Item = (&'a str, f64, Option<f64>)>) -> f64 {
    bounds
        .map(|(name, from, to)| {
            let bound = TunedBounds::NAMES.iter().position(|known| *known == name).unwrap_or(0);
            to.map_or(f64::INFINITY, |to| step(bound, from, to))
        })
        .sum()
}

impl Relaxation {
    fn size(&self) -> f64 {
        size(std::iter::once((self.bound.as_str(), self.from, self.to)))
    }
}

impl JointRelaxation {
    fn size(&self) -> f64 {
        size(self.bounds.iter().map(|one| (one.bound.as_str(), one.from, one.to)))
    }
}

/// The search for what has to give way.
struct Search<'a> {
    problem: &'a GaitProblem,
    solves: Solves<'a>,
    /// Bounds in the order in which they are suspected.
    order: Vec<usize>,
}

impl Search<'_> {
    fn given(&self, set: BoundSet) -> Vec<GivenBound> {
        let values = self.problem.bounds.to_array();
        let given = |bound: usize| GivenBound {
            bound: TunedBounds::NAMES[bound].to_owned(),
            meaning: TunedBounds::MEANINGS[bound].to_owned(),
            value: values[bound],
        };
        set.bounds().map(given).collect()
    }

    /// An irreducible conflict among the bounds, those of `without` at their loosest.
    fn conflict(&mut self, without: BoundSet) -> Result<Option<BoundSet>, Stop> {
        let order: Vec<usize> = self.order.iter().copied().filter(|bound| !without.contains(*bound)).collect();
        conflict(&order, |set| Ok(self.level(BoundSet::ALL.without(set))?.is_some()))
    }

    /// How far the bounds of a set have to be loosened so that there is a gait, if that is any help.
    fn level(&mut self, set: BoundSet) -> Result<Option<Level>, Stop> {
        let before = self.solves.count;
        if self.solves.is_met(&loosened(&self.problem.bounds, set, Level::Usual)?, Starts::All)? {
            return Ok(Some(Level::Usual));
        }
        // Cold guesses that found none there find none with the loosest: those are further from what walks.
        let starts = if self.solves.count > before { Starts::Nearest } else { Starts::All };
        let loosest = self.solves.is_met(&loosened(&self.problem.bounds, set, Level::Loosest)?, starts)?;
        Ok(loosest.then_some(Level::Loosest))
    }

    fn described(&self, set: BoundSet, without: BoundSet) -> Result<Conflict, Stop> {
        let wished = self.problem.settings.naturalness.trailing_load_share;
        let wishes = if set == BoundSet::EMPTY && wished > 0.0 {
            vec![format!("at least {wished} of the weight on the trailing foot at heel strike")]
        } else {
            Vec::new()
        };
        let unmet = self.searched(BoundSet::ALL.without(set))?;
        let nearest = unmet.iter().min_by(|a, b| a.nearness(b));
        let violations =
            nearest.map_or_else(Vec::new, |unmet| unmet.violations.iter().take(VIOLATIONS).cloned().collect());
        Ok(Conflict {
            bounds: self.given(set),
            without: without.bounds().map(|bound| TunedBounds::NAMES[bound].to_owned()).collect(),
            wishes,
            violations,
            starts: unmet.iter().map(|unmet| unmet.starts).sum(),
            undecided: unmet.iter().any(|unmet| unmet.undecided),
        })
    }

    /// The searches that found no gait with a set loosened, at each level, the loosest last.
    fn searched(&self, set: BoundSet) -> Result<Vec<&Unmet>, Stop> {
        let mut known: Vec<&Unmet> = Vec::new();
        for level in [Level::Usual, Level::Loosest] {
            let unmet = self.solves.unmet(&loosened(&self.problem.bounds, set, level)?);
            known.extend(unmet.filter(|unmet| known.iter().all(|other| !std::ptr::eq(*other, *unmet))));
        }
        Ok(known)
    }

    /// How far the bounds of a set have to give way together.
    fn relaxed(&mut self, set: BoundSet) -> Result<JointRelaxation, Stop> {
        let given = self.problem.bounds;
        let before = self.solves.count;
        let (mut to, mut warm_start) = (None, None);
        let (not_with, searches) = match self.level(set)? {
            Some(level) => {
                let loose = loosened(&given, set, level)?;
                warm_start = self.solves.gait(&loose)?;
                // What is tighter than bounds without a gait is not asked about again.
                let tight = if level == Level::Usual { given } else { loosened(&given, set, Level::Usual)? };
                let solves = &mut self.solves;
                let (nearest, none) = least_move(&tight, &loose, |bounds| {
                    let gait = solves.solve(bounds, Starts::All)?;
                    let found = gait.is_some();
                    warm_start = gait.or(warm_start.take());
                    Ok::<_, Stop>(found)
                })?;
                to = Some(nearest.to_array());
                (none, self.solves.unmet(&none).into_iter().filter(|_| none != given).collect())
            }
            None => (loosened(&given, set, Level::Loosest)?, self.searched(set)?),
        };
        let (starts, undecided) = (searches.iter().map(|s| s.starts).sum(), searches.iter().any(|s| s.undecided));
        let of_bound = |one: GivenBound, bound: usize| RelaxedBound {
            bound: one.bound,
            meaning: one.meaning,
            from: one.value,
            to: to.map(|to| to[bound]),
            not_with: not_with.to_array()[bound],
        };
        Ok(JointRelaxation {
            bounds: self.given(set).into_iter().zip(set.bounds()).map(|(one, bound)| of_bound(one, bound)).collect(),
            undecided,
            solves: self.solves.count - before,
            starts,
            warm_start,
        })
    }
}

/// A joint relaxation of one bound.
fn alone(joint: JointRelaxation) -> Option<Relaxation> {
    let JointRelaxation { bounds, undecided, solves, starts, warm_start } = joint;
    let RelaxedBound { bound, meaning, from, to, not_with } = bounds.into_iter().next()?;
    Some(Relaxation { bound, meaning, from, to, not_with, undecided, solves, starts, warm_start })
}

/// Bounds by how much they are suspected: those that the last iterate runs into before others, tightened ones before those at
/// their usual values.
fn suspects(bounds: &TunedBounds, at_limit: BoundSet) -> Vec<usize> {
    let (own, usual) = (bounds.to_array(), TunedBounds::default().to_array());
    let tightened = |bound: usize| step(bound, own[bound], loosest(bound)) > step(bound, usual[bound], loosest(bound));
    let mut order: Vec<usize> = (0..own.len()).collect();
    order.sort_by_key(|bound| (!tightened(*bound), !at_limit.contains(*bound)));
    order
}

/// Explains a solve that did not converge: finds the smallest conflict among its tuned bounds, then which of them has to give
/// way and how far, by solving with other bounds.
///
/// Takes some dozens of solves. `progress` hears of each step. `None`: cancelled, or the solve converged or was
/// cancelled itself.
///
/// # Errors
/// [`SolveError`] when the problem is invalid or the last iterate belongs to another one.
pub fn explain(
    problem: &GaitProblem,
    unsolved: Unsolved<'_>,
    options: &SolveOptions,
    progress: &mut dyn FnMut(&str),
    cancel: &CancelToken,
) -> Result<Option<Explanation>, SolveError> {
    if matches!(unsolved.status, SolveStatus::Converged | SolveStatus::Cancelled) {
        return Ok(None);
    }
    match found_out(problem, unsolved, options, progress, cancel) {
        Ok(explanation) => Ok(Some(explanation)),
        Err(Stop::Cancelled) => Ok(None),
        Err(Stop::Failed(error)) => Err(error),
    }
}

fn found_out(
    problem: &GaitProblem,
    unsolved: Unsolved<'_>,
    options: &SolveOptions,
    progress: &mut dyn FnMut(&str),
    cancel: &CancelToken,
) -> Result<Explanation, Stop> {
    let Unsolved { status, violations, last } = unsolved;
    let programme = problem.programme(problem.muscles)?;
    let x = &last.point.x;
    if x.len() != programme.variables() {
        let sizes = format!("{} variables, expected {}", x.len(), programme.variables());
        return Err(SolveError::WarmStartShape(sizes).into());
    }
    let (mut at_limit, mut reached) = (Vec::new(), BoundSet::EMPTY);
    for (bound, value) in problem.bounds.to_array().into_iter().enumerate() {
        let domains = domains_at_limit(problem, &programme, x, bound)?;
        if !domains.is_empty() {
            let (bound_name, meaning) = (TunedBounds::NAMES[bound].to_owned(), TunedBounds::MEANINGS[bound].to_owned());
            at_limit.push(BoundAtLimit { bound: bound_name, meaning, value, domains });
            reached = reached.with(bound);
        }
    }
    let mut explanation = Explanation {
        status,
        violations: violations.to_vec(),
        conflicts: Vec::new(),
        gait_found: false,
        at_limit,
        relaxations: Vec::new(),
        together: Vec::new(),
        missed: None,
    };
    let order = suspects(&problem.bounds, reached);
    let mut search = Search { problem, solves: Solves::new(problem, options, cancel), order };
    progress("which bounds contradict each other?");
    let Some(first) = search.conflict(BoundSet::EMPTY)? else {
        explanation.gait_found = true;
        explanation.missed = search.solves.gait(&problem.bounds)?;
        return Ok(explanation);
    };
    explanation.conflicts.push(search.described(first, BoundSet::EMPTY)?);
    let found = {
        let search = RefCell::new(&mut search);
        let gives_a_gait = |set| Ok::<_, Stop>(search.borrow_mut().level(set)?.is_some());
        remedies(first, MOST_TOGETHER, gives_a_gait, |without| search.borrow_mut().conflict(without))?
    };
    for (conflict, without) in found.conflicts {
        explanation.conflicts.push(search.described(conflict, without)?);
    }
    for set in found.help.into_iter().chain(found.do_not_help) {
        let names: Vec<&str> = set.bounds().map(|bound| TunedBounds::NAMES[bound]).collect();
        progress(&format!("how far must {} give way?", names.join(" and ")));
        let relaxed = search.relaxed(set)?;
        if relaxed.bounds.len() > 1 {
            explanation.together.push(relaxed);
        } else {
            explanation.relaxations.extend(alone(relaxed));
        }
    }
    explanation.relaxations.sort_by(|a, b| a.size().total_cmp(&b.size()));
    explanation.together.sort_by(|a, b| a.size().total_cmp(&b.size()));
    Ok(explanation)
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    #[test]
    fn what_is_tightened_is_suspected_first_then_what_is_reached() {
        let bounds = TunedBounds { a3: 0.5, a5: 0.02, a7: 10.0, a8: 50.0, ..TunedBounds::default() };
        let at_limit = [1, 6, 7].into_iter().fold(BoundSet::EMPTY, BoundSet::with);
        assert_eq!(suspects(&bounds, at_limit), [6, 2, 4, 1, 7, 0, 3, 5]);
    }

    #[test]
    fn explanations_of_earlier_versions_are_read() {
        let kept = r#"{"status": "infeasible", "violations": [], "at_limit": [], "relaxations": [{"bound": "a5",
            "meaning": "swing-foot clearance, m", "from": 0.04, "to": 0.03, "not_with": 0.031, "undecided": false, "solves": 8}]}"#;
        let read: Explanation = serde_json::from_str(kept).unwrap();
        assert_eq!((read.conflicts.len(), read.together.len(), read.gait_found), (0, 0, false));
        assert_eq!((read.relaxations[0].starts, read.relaxations[0].to), (0, Some(0.03)));
    }
}
