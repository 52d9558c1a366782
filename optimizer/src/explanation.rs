//! Why no gait was found for a set of tuned bounds: what cannot be met, which bounds the last iterate runs into, and
//! which one, relaxed alone, gives a gait. Nothing is said of a relaxation that was not solved.

use crate::bounds::TunedBounds;
use crate::gait_problem::GaitProgramme;
use crate::nlp::NonlinearProgram;
use crate::solve::{
    CancelToken, GaitProblem, SolveError, SolveOptions, SolveOutcome, SolveStatus, Violation, WarmStart, solve,
};
use serde::{Deserialize, Serialize};

mod words;

pub use words::verdict;

/// A variable or row nearer to a limit than this, in scaled units, is at it.
const AT_LIMIT: f64 = 1e-4;
/// Values tried between the given one and the loosest.
const BISECTIONS: usize = 7;
/// Digits of the values tried.
const DIGITS: i32 = 3;
/// Iterations of one of these solves: gaits that converge take fewer, and most that do not would go on for many more.
const MAX_ITERATIONS: usize = 400;

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
    /// Whether a solve without a gait gave up, at a limit or stalled: that there is no gait is not known then.
    pub undecided: bool,
    /// Solves that this took.
    pub solves: usize,
    /// Where the gait with `to` was found. It came from its neighbours: other starts may not reach it.
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
    /// The bounds that it runs into.
    pub at_limit: Vec<BoundAtLimit>,
    /// What relaxing each of them alone achieves, the smallest relaxation (as a factor or share of the range) first,
    /// those that do not help last.
    pub relaxations: Vec<Relaxation>,
}

/// The loosest value of a bound: a3 and a5 are lower bounds.
fn loosest(bound: usize) -> f64 {
    let (lowest, highest) = TunedBounds::RANGES[bound];
    if matches!(bound, 2 | 4) { lowest } else { highest }
}

fn with_bound(problem: &GaitProblem, bound: usize, value: f64) -> Result<GaitProblem, SolveError> {
    let mut relaxed = problem.clone();
    relaxed.bounds.set(TunedBounds::NAMES[bound], value)?;
    Ok(relaxed)
}

/// Between two values, by their ratio where they have one, with few digits.
fn between(a: f64, b: f64) -> f64 {
    let middle = if a > 0.0 && b > 0.0 { (a * b).sqrt() } else { f64::midpoint(a, b) };
    if middle == 0.0 {
        return middle;
    }
    #[allow(clippy::cast_possible_truncation)] // the exponent of a double
    let place = DIGITS - 1 - middle.abs().log10().floor() as i32;
    let unit = 10f64.powi(place);
    (middle * unit).round() / unit
}

/// How far a relaxation goes: by ratio, or as a share of the bound's range.
fn size(relaxation: &Relaxation) -> f64 {
    let Some(to) = relaxation.to else { return f64::INFINITY };
    if relaxation.from > 0.0 && to > 0.0 {
        return (to / relaxation.from).ln().abs();
    }
    let bound = TunedBounds::NAMES.iter().position(|name| *name == relaxation.bound).unwrap_or(0);
    let (lowest, highest) = TunedBounds::RANGES[bound];
    (to - relaxation.from).abs() / (highest - lowest)
}

impl GaitProblem {
    /// Names of the domains in which `x` is at a limit that `bound` sets.
    fn domains_at_limit(&self, programme: &GaitProgramme, x: &[f64], bound: usize) -> Result<Vec<String>, SolveError> {
        let relaxed = with_bound(self, bound, loosest(bound))?.programme(self.muscles)?;
        let mut values = [vec![0.0; programme.rows()], vec![0.0; programme.rows()]];
        programme.constraints(x, &mut values[0]);
        relaxed.constraints(x, &mut values[1]);
        let row_at_limit = |row: usize| {
            let value = values[0][row];
            let slack = (value - programme.rows.lower[row]).min(programme.rows.upper[row] - value);
            values[0][row] != values[1][row] && slack < AT_LIMIT
        };
        let bounds = |programme: &GaitProgramme| {
            let mut pair = [vec![0.0; programme.variables()], vec![0.0; programme.variables()]];
            let [lower, upper] = &mut pair;
            programme.variable_bounds(lower, upper);
            pair
        };
        let ([lower, upper], [loose_lower, loose_upper]) = (bounds(programme), bounds(&relaxed));
        let variable_at_limit = |j: usize| {
            lower[j] != loose_lower[j] && x[j] - lower[j] < AT_LIMIT
                || upper[j] != loose_upper[j] && upper[j] - x[j] < AT_LIMIT
        };
        let mut names: Vec<String> = Vec::new();
        let places = (0..programme.variables())
            .filter(|variable| variable_at_limit(*variable))
            .map(|variable| programme.layout.variable_label(variable).0)
            .chain((0..programme.rows()).filter(|row| row_at_limit(*row)).map(|row| programme.rows.names[row].label()));
        for place in places {
            // `SS1_R point 3, ...`, or a variable of the whole stride.
            let name = place.split_once(" point").map_or("stride", |(domain, _)| domain);
            if !names.iter().any(|known| known == name) {
                names.push(name.to_owned());
            }
        }
        Ok(names)
    }
}

/// Bisects one bound between its value, with which no gait was found, and its loosest. `None`: cancelled.
fn relax(
    problem: &GaitProblem,
    bound: usize,
    options: &SolveOptions,
    cancel: &CancelToken,
) -> Result<Option<Relaxation>, SolveError> {
    let from = problem.bounds.to_array()[bound];
    let (mut solves, mut undecided) = (0, false);
    let mut try_value = |value: f64, warm: Option<&WarmStart>| -> Result<SolveOutcome, SolveError> {
        solves += 1;
        let outcome = solve(&with_bound(problem, bound, value)?, warm, options, &mut |_| {}, cancel)?;
        undecided |= !matches!(outcome.report.status, SolveStatus::Converged | SolveStatus::Infeasible);
        Ok(outcome)
    };
    let mut last = try_value(loosest(bound), None)?;
    let (mut not_with, mut to, mut warm_start) = (from, None, None);
    if last.report.status == SolveStatus::Converged {
        let mut nearest = loosest(bound);
        for _ in 0..BISECTIONS {
            let value = between(not_with, nearest);
            if value == not_with || value == nearest {
                break;
            }
            let outcome = try_value(value, Some(&last.warm_start))?;
            if cancel.is_cancelled() {
                return Ok(None);
            }
            if outcome.report.status == SolveStatus::Converged {
                (nearest, last) = (value, outcome);
            } else {
                not_with = value;
            }
        }
        (to, warm_start) = (Some(nearest), Some(last.warm_start));
    } else {
        not_with = loosest(bound);
    }
    if cancel.is_cancelled() {
        return Ok(None);
    }
    let (name, meaning) = (TunedBounds::NAMES[bound].to_owned(), TunedBounds::MEANINGS[bound].to_owned());
    Ok(Some(Relaxation { bound: name, meaning, from, to, not_with, undecided, solves, warm_start }))
}

/// Explains a solve that did not converge, by relaxing each bound that it runs into alone and solving again.
///
/// Takes up to eight solves a bound. `progress` is told the bound that is being relaxed. `None`: cancelled, or the solve
/// converged or was cancelled itself.
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
    let Unsolved { status, violations, last } = unsolved;
    if matches!(status, SolveStatus::Converged | SolveStatus::Cancelled) {
        return Ok(None);
    }
    let programme = problem.programme(problem.muscles)?;
    let x = &last.point.x;
    if x.len() != programme.variables() {
        return Err(SolveError::WarmStartShape(format!("{} variables, expected {}", x.len(), programme.variables())));
    }
    let max_iterations = options.max_iterations.min(MAX_ITERATIONS);
    let options = SolveOptions { cold_guesses: 1, retry: false, max_iterations, ..*options };
    let (mut at_limit, mut relaxations) = (Vec::new(), Vec::new());
    for (bound, value) in problem.bounds.to_array().into_iter().enumerate() {
        let domains = problem.domains_at_limit(&programme, x, bound)?;
        if domains.is_empty() {
            continue;
        }
        let (name, meaning) = (TunedBounds::NAMES[bound].to_owned(), TunedBounds::MEANINGS[bound].to_owned());
        progress(&name);
        let Some(relaxation) = relax(problem, bound, &options, cancel)? else { return Ok(None) };
        relaxations.push(relaxation);
        at_limit.push(BoundAtLimit { bound: name, meaning, value, domains });
    }
    relaxations.sort_by(|a, b| size(a).total_cmp(&size(b)));
    Ok(Some(Explanation { status, violations: violations.to_vec(), at_limit, relaxations }))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_in_between_have_few_digits_and_lie_between() {
        assert_eq!(between(40.0, 1000.0), 200.0);
        assert_eq!(between(0.1, 0.0), 0.05);
        assert_eq!(between(15.0, 16.123), 15.6);
        assert_eq!(between(0.0, 0.0), 0.0);
    }

    #[test]
    fn lower_bounds_are_loosest_where_they_are_lowest() {
        let loose: Vec<f64> = (0..8).map(loosest).collect();
        assert_eq!(loose, [100.0, 1000.0, 0.05, 3.0, 0.0, 1.0, 68.0, 60.0]);
    }

    #[test]
    fn relaxations_are_compared_by_ratio_or_by_share_of_the_range() {
        let relaxation = |bound: &str, from, to| Relaxation {
            bound: bound.to_owned(),
            meaning: String::new(),
            from,
            to,
            not_with: from,
            undecided: false,
            solves: 1,
            warm_start: None,
        };
        assert!((size(&relaxation("a2", 40.0, Some(80.0))) - 2f64.ln()).abs() < 1e-15);
        assert!((size(&relaxation("a5", 0.0, Some(0.03))) - 0.1).abs() < 1e-15);
        assert_eq!(size(&relaxation("a8", 15.0, None)), f64::INFINITY);
    }
}
