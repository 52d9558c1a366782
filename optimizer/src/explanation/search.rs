//! The search for conflicts and relaxations.

use super::at_limit::domains_at_limit;
use super::bound::{Level, least_move, loosened, loosest, step};
use super::conflict::{BoundSet, conflict, remedies};
use super::findings::{BoundAtLimit, Conflict, Explanation};
use super::given_bound::BoundValue;
use super::relaxation::{JointRelaxation, RelaxedBound, of_one_bound};
use super::solves::{FailedSearch, SearchEnd, Solves, Starts};
use crate::gait_problem::GaitProblem;
use crate::solve::{CancelToken, SolveError, SolveOptions, WarmStart};
use crate::tuned_bounds::TunedBounds;
use interior_point::NonlinearProgram;
use std::cell::RefCell;

/// Largest number of bounds in a joint relaxation.
const MAX_BOUNDS_RELAXED_TOGETHER: usize = 3;
/// Largest number of violations of a conflict that are kept.
const VIOLATIONS: usize = 5;

/// The search for conflicts and relaxations.
pub(super) struct Search<'a> {
    pub(super) problem: &'a GaitProblem,
    pub(super) solves: Solves<'a>,
    /// Bounds, the most suspected ones first.
    pub(super) order: Vec<usize>,
}

impl Search<'_> {
    /// The smallest relaxation of the bounds of a set that gives a gait, if there is one.
    fn level(&mut self, set: BoundSet) -> Result<Option<Level>, SearchEnd> {
        let before = self.solves.count;
        if self.solves.is_met(&loosened(&self.problem.bounds, set, Level::Usual)?, Starts::All)? {
            return Ok(Some(Level::Usual));
        }
        // Initial guesses that failed there also fail with the loosest values, which are further from walking.
        let starts = if self.solves.count > before { Starts::Nearest } else { Starts::All };
        let loosest = self.solves.is_met(&loosened(&self.problem.bounds, set, Level::Loosest)?, starts)?;
        Ok(loosest.then_some(Level::Loosest))
    }

    /// The smallest joint relaxation of the bounds of a set.
    fn relaxed(&mut self, set: BoundSet) -> Result<JointRelaxation, SearchEnd> {
        let given = self.problem.bounds;
        let before = self.solves.count;
        let (mut to, mut warm_start) = (None, None);
        let (not_with, searches) = match self.level(set)? {
            Some(level) => {
                let loose = loosened(&given, set, level)?;
                warm_start = self.solves.gait(&loose)?;
                // Tighter bounds than those without a gait need no solve.
                let tight = if level == Level::Usual { given } else { loosened(&given, set, Level::Usual)? };
                let solves = &mut self.solves;
                let (nearest, none) = least_move(&tight, &loose, |bounds| {
                    let gait = solves.solve(bounds, Starts::All)?;
                    let found = gait.is_some();
                    warm_start = gait.or(warm_start.take());
                    Ok::<_, SearchEnd>(found)
                })?;
                to = Some(nearest.to_array());
                (none, self.solves.unmet(&none).into_iter().filter(|_| none != given).collect())
            }
            None => (loosened(&given, set, Level::Loosest)?, self.searched(set)?),
        };
        let (starts, undecided) = (searches.iter().map(|s| s.starts).sum(), searches.iter().any(|s| s.undecided));
        let of_bound = |one: BoundValue, bound: usize| RelaxedBound {
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

/// Adds everything to an explanation as soon as it is found, so that a cancelled search keeps it.
pub(super) fn search_into(
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
        remedies(first, MAX_BOUNDS_RELAXED_TOGETHER, gives_a_gait, |without| search.borrow_mut().conflict(without))?
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
}
