//! Infeasibility explanations: which tuned bounds conflict, which constraint they make infeasible, and which
//! relaxations of one or several bounds give a gait. All statements are about bounds for which a solve was done.

use crate::gait_problem::GaitProblem;
use crate::solve::{CancelToken, SolveError, SolveOptions, SolveOutcome, SolveStatus, Violation, WarmStart};
use crate::tuned_bounds::TunedBounds;
use interior_point::NonlinearProgram;
use serde::{Deserialize, Serialize};
use std::cell::RefCell;

mod at_limit;
mod bound;
mod conflict;
mod explanation_sentences;
mod given_bound;
mod relaxation;
mod search;
mod solves;

use at_limit::domains_at_limit;
use bound::{Level, loosened, loosest, step};
use conflict::{BoundSet, conflict, remedies};
pub use explanation_sentences::{quantity, status_in_words};
pub use given_bound::BoundValue;
use relaxation::of_one_bound;
pub use relaxation::{JointRelaxation, Relaxation, RelaxedBound};
use search::Search;
use solves::{FailedSearch, SearchEnd, Solves};

/// Largest number of bounds in a joint relaxation.
const MOST_TOGETHER: usize = 3;
/// Largest number of violations of a conflict that are kept.
const VIOLATIONS: usize = 5;

/// The end of a solve without a gait.
#[derive(Debug, Clone, Copy)]
pub struct SolveWithoutGait<'a> {
    /// Status of the solve.
    pub status: SolveStatus,
    /// Violations of its last iterate, worst first.
    pub violations: &'a [Violation],
    /// Its last iterate.
    pub last: &'a WarmStart,
}

impl<'a> From<&'a SolveOutcome> for SolveWithoutGait<'a> {
    fn from(outcome: &'a SolveOutcome) -> Self {
        Self { status: outcome.report.status, violations: &outcome.violations, last: &outcome.warm_start }
    }
}

/// A tuned bound that the last iterate reaches.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct BoundAtLimit {
    /// Name of the bound.
    pub bound: String,
    /// What it limits, with its unit.
    pub meaning: String,
    /// Its value.
    pub value: f64,
    /// Domains in which it is reached.
    pub domains: Vec<String>,
}

/// A conflict of tuned bounds: with the other tuned bounds at their loosest values, no gait was found with all of
/// them, and a gait was found without any one of them.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Conflict {
    /// The conflicting bounds. Empty if no gait was found with every tuned bound at its loosest value: then fixed
    /// constraints conflict.
    pub bounds: Vec<BoundValue>,
    /// Bounds of other conflicts that were relaxed when this conflict remained.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub without: Vec<String>,
    /// Naturalness terms that take part, if fixed constraints conflict.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub naturalness_terms: Vec<String>,
    /// Violations of the nearest motion with these bounds and the other tuned bounds relaxed, worst first. Stationary
    /// points of the violation are preferred.
    pub violations: Vec<Violation>,
    /// Number of starts of the search.
    pub starts: usize,
    /// Whether a solve ended at a limit or stalled instead of at a stationary point of the violation.
    pub undecided: bool,
}

/// An infeasibility explanation.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Explanation {
    /// Status of the solve.
    pub status: SolveStatus,
    /// Violations of the last iterate, worst first.
    pub violations: Vec<Violation>,
    /// The conflicts: the first one, and further ones if no single bound resolves it. Empty if unknown.
    #[serde(default)]
    pub conflicts: Vec<Conflict>,
    /// Whether the search found a gait with exactly the given bounds, which the solve had missed.
    #[serde(default)]
    pub gait_found: bool,
    /// The bounds that the last iterate reaches.
    pub at_limit: Vec<BoundAtLimit>,
    /// Relaxations of each bound of the first conflict; no other bound can resolve it. The smallest one, as a factor
    /// or a share of the range, is first. Insufficient ones are last.
    pub relaxations: Vec<Relaxation>,
    /// Joint relaxations, if no single one is sufficient, smallest first.
    #[serde(default)]
    pub together: Vec<JointRelaxation>,
    /// Whether the search was cancelled after it had found the first conflict, so that further conflicts and relaxations may
    /// be missing.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub stopped_early: bool,
    /// Warm start of the gait that the solve had missed.
    #[serde(skip)]
    pub missed: Option<WarmStart>,
}

impl Search<'_> {
    fn given(&self, set: BoundSet) -> Vec<BoundValue> {
        let values = self.problem.bounds.to_array();
        let given = |bound: usize| BoundValue {
            bound: TunedBounds::NAMES[bound].to_owned(),
            meaning: TunedBounds::MEANINGS[bound].to_owned(),
            value: values[bound],
        };
        set.bounds().map(given).collect()
    }

    /// An irreducible conflict among the bounds, with those of `without` at their loosest values.
    fn conflict(&mut self, without: BoundSet) -> Result<Option<BoundSet>, SearchEnd> {
        let order: Vec<usize> = self.order.iter().copied().filter(|bound| !without.contains(*bound)).collect();
        conflict(&order, |set| Ok(self.level(BoundSet::ALL.without(set))?.is_some()))
    }

    fn described(&self, set: BoundSet, without: BoundSet) -> Result<Conflict, SearchEnd> {
        let share = self.problem.settings.naturalness.trailing_load_share;
        let naturalness_terms = if set == BoundSet::EMPTY && share > 0.0 {
            vec![format!("at least {share} of the weight on the trailing foot at heel strike")]
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
            naturalness_terms,
            violations,
            starts: unmet.iter().map(|unmet| unmet.starts).sum(),
            undecided: unmet.iter().any(|unmet| unmet.undecided),
        })
    }

    /// The failed searches with a relaxed set at each level, the loosest last.
    fn searched(&self, set: BoundSet) -> Result<Vec<&FailedSearch>, SearchEnd> {
        let mut known: Vec<&FailedSearch> = Vec::new();
        for level in [Level::Usual, Level::Loosest] {
            let unmet = self.solves.unmet(&loosened(&self.problem.bounds, set, level)?);
            known.extend(unmet.filter(|unmet| known.iter().all(|other| !std::ptr::eq(*other, *unmet))));
        }
        Ok(known)
    }
}

/// Bounds in order of suspicion: those that the last iterate reaches first, and tightened ones before those at their
/// defaults.
fn suspects(bounds: &TunedBounds, at_limit: BoundSet) -> Vec<usize> {
    let (own, usual) = (bounds.to_array(), TunedBounds::default().to_array());
    let tightened = |bound: usize| step(bound, own[bound], loosest(bound)) > step(bound, usual[bound], loosest(bound));
    let mut order: Vec<usize> = (0..own.len()).collect();
    order.sort_by_key(|bound| (!tightened(*bound), !at_limit.contains(*bound)));
    order
}

/// Explains a solve that did not converge: finds an irreducible conflict among its tuned bounds, and the smallest
/// relaxations that give a gait, by solves with other bounds.
///
/// It takes dozens of solves; `progress` receives each step. If it is cancelled, it returns what it has found
/// ([`Explanation::stopped_early`]), and `None` before the first conflict. `None` if the solve converged or was cancelled.
///
/// # Errors
/// [`SolveError`] if the problem is invalid or the last iterate belongs to another problem.
pub fn explain(
    problem: &GaitProblem,
    unsolved: SolveWithoutGait<'_>,
    options: &SolveOptions,
    progress: &mut dyn FnMut(&str),
    cancel: &CancelToken,
) -> Result<Option<Explanation>, SolveError> {
    if matches!(unsolved.status, SolveStatus::Converged | SolveStatus::Cancelled) {
        return Ok(None);
    }
    let SolveWithoutGait { status, violations, last } = unsolved;
    let mut explanation = Explanation {
        status,
        violations: violations.to_vec(),
        conflicts: Vec::new(),
        gait_found: false,
        at_limit: Vec::new(),
        relaxations: Vec::new(),
        together: Vec::new(),
        stopped_early: false,
        missed: None,
    };
    match search_into(&mut explanation, problem, last, options, progress, cancel) {
        Ok(()) => {}
        Err(SearchEnd::Cancelled) if explanation.conflicts.is_empty() => return Ok(None),
        Err(SearchEnd::Cancelled) => explanation.stopped_early = true,
        Err(SearchEnd::Failed(error)) => return Err(error),
    }
    explanation.relaxations.sort_by(|a, b| a.size().total_cmp(&b.size()));
    explanation.together.sort_by(|a, b| a.size().total_cmp(&b.size()));
    Ok(Some(explanation))
}

/// Adds everything to an explanation as soon as it is found, so that a cancelled search keeps it.
fn search_into(
    explanation: &mut Explanation,
    problem: &GaitProblem,
    last: &WarmStart,
    options: &SolveOptions,
    progress: &mut dyn FnMut(&str),
    cancel: &CancelToken,
) -> Result<(), SearchEnd> {
    let program = problem.program(problem.muscles)?;
    let x = &last.point.x;
    if x.len() != program.variables() {
        let sizes = format!("it has {} variables; the problem has {}", x.len(), program.variables());
        return Err(SolveError::WarmStartShape(sizes).into());
    }
    let mut reached = BoundSet::EMPTY;
    for (bound, value) in problem.bounds.to_array().into_iter().enumerate() {
        let domains = domains_at_limit(problem, &program, x, bound)?;
        if !domains.is_empty() {
            let (bound_name, meaning) = (TunedBounds::NAMES[bound].to_owned(), TunedBounds::MEANINGS[bound].to_owned());
            explanation.at_limit.push(BoundAtLimit { bound: bound_name, meaning, value, domains });
            reached = reached.with(bound);
        }
    }
    let order = suspects(&problem.bounds, reached);
    let mut search = Search { problem, solves: Solves::new(problem, options, cancel), order };
    progress("searching for conflicting bounds");
    let Some(first) = search.conflict(BoundSet::EMPTY)? else {
        explanation.gait_found = true;
        explanation.missed = search.solves.gait(&problem.bounds)?;
        return Ok(());
    };
    explanation.conflicts.push(search.described(first, BoundSet::EMPTY)?);
    let found = {
        let search = RefCell::new(&mut search);
        let gives_a_gait = |set| Ok::<_, SearchEnd>(search.borrow_mut().level(set)?.is_some());
        remedies(first, MOST_TOGETHER, gives_a_gait, |without| search.borrow_mut().conflict(without))?
    };
    for (conflict, without) in found.conflicts {
        explanation.conflicts.push(search.described(conflict, without)?);
    }
    for set in found.help.into_iter().chain(found.do_not_help) {
        let names: Vec<&str> = set.bounds().map(|bound| TunedBounds::NAMES[bound]).collect();
        progress(&format!("searching for the smallest relaxation of {}", names.join(" and ")));
        let relaxed = search.relaxed(set)?;
        if relaxed.bounds.len() > 1 {
            explanation.together.push(relaxed);
        } else {
            explanation.relaxations.extend(of_one_bound(relaxed));
        }
    }
    Ok(())
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    #[test]
    fn tightened_bounds_are_suspected_first_then_reached_ones() {
        let bounds = TunedBounds { a3: 0.5, a5: 0.02, a7: 10.0, a8: 50.0, ..TunedBounds::default() };
        let at_limit = [1, 6, 7].into_iter().fold(BoundSet::EMPTY, BoundSet::with);
        assert_eq!(suspects(&bounds, at_limit)[..8], [6, 2, 4, 1, 7, 0, 3, 5]);
    }

    #[test]
    fn explanation_without_conflicts_is_read() {
        let kept = r#"{"status": "infeasible", "violations": [], "at_limit": [], "relaxations": [{"bound": "a5",
            "meaning": "swing-foot clearance, m", "from": 0.04, "to": 0.03, "not_with": 0.031, "undecided": false, "solves": 8}]}"#;
        let read: Explanation = serde_json::from_str(kept).unwrap();
        assert_eq!((read.conflicts.len(), read.together.len(), read.gait_found), (0, 0, false));
        assert_eq!((read.relaxations[0].starts, read.relaxations[0].to), (0, Some(0.03)));
    }
}
