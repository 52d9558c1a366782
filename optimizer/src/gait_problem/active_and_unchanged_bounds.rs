//! For each tuned bound of a converged gait, the values with which the gait stays a solution, without a solve.
//!
//! A gait stays a solution if a constraint that moves with the bound was inactive and still is: its multiplier is zero and its
//! distance from the gait is not, both to the tolerance of the solve, margins included. Between the nodes, the gait must
//! satisfy the moved bound to the tolerance of the inter-node check. Constraints that do not move, because a limit of the
//! device or of the settings is stricter than the bound, do not matter. Each constraint depends on one tuned bound only,
//! so the conditions of several bounds are independent.

use super::active_constraint::{is_active, least_distance};
use super::foot_clearance::clearance_weight;
use super::inter_node_check::{BetweenNodes, inter_node_excess};
use super::margins::Margins;
use super::problem_definition::GaitProblem;
use super::program_data::GaitProgram;
use super::rows::HeightRow;
use super::variable_bounds::{ActiveLimits, VariableBounds, variable_bounds};
use crate::body::GRAVITY;
use crate::gait::Gait;
use crate::settings::GaitLimits;
use crate::tuned_bounds::TunedBounds;
use interior_point::{NonlinearProgram, WarmPoint};
use serde::{Deserialize, Serialize};

/// Number of halvings of the allowed range that find the end of an interval, to a share of 1e-12.
const HALVINGS: usize = 40;

/// A tuned bound and the range of its values for which a gait remains a solution.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct UnchangedBound {
    /// Name of the bound.
    pub bound: String,
    /// The smallest value; `None` if every smaller one leaves the gait as it is.
    pub least: Option<f64>,
    /// The largest value; `None` if every larger one leaves the gait as it is.
    pub most: Option<f64>,
}

impl UnchangedBound {
    /// Whether the gait is a solution with this value of the bound.
    pub fn contains(&self, value: f64) -> bool {
        self.least.is_none_or(|least| least <= value) && self.most.is_none_or(|most| value <= most)
    }

    /// Whether the bound, which has this value, is active: small changes of it change the gait. At an end of the range of the
    /// bound, one end of the interval is open. A torso lean below its tolerance acts as the tolerance.
    pub fn is_active(&self, value: f64, limits: &GaitLimits) -> bool {
        let tolerance = limits.torso_tolerance_rad;
        let acts_as_tolerance =
            self.bound == "a6" && value < tolerance && self.most.is_some_and(|most| most <= tolerance);
        acts_as_tolerance || [self.least, self.most].contains(&Some(value))
    }
}

/// A converged gait.
pub(crate) struct ConvergedGait<'a> {
    pub(crate) problem: &'a GaitProblem,
    pub(crate) program: &'a GaitProgram,
    /// Bounds that were tightened.
    pub(crate) margins: &'a Margins,
    pub(crate) gait: &'a Gait,
    /// The point of the gait.
    pub(crate) point: &'a WarmPoint,
    /// Largest complementarity product.
    pub(crate) tolerance: f64,
    /// Whether the solve checks the gait between its nodes.
    pub(crate) checks_between_nodes: bool,
}

impl ConvergedGait<'_> {
    /// The values of each tuned bound with which this gait stays a solution, in the order of an action. Empty if the gait
    /// exceeds bounds between its nodes.
    pub(crate) fn unchanged_bounds(&self) -> Vec<UnchangedBound> {
        let values = self.problem.bounds.to_array();
        // With any bounds, a solve would tighten a gait that exceeds a bound between nodes.
        if self.checks_between_nodes && inter_node_excess(self.program, self.gait, &self.point.x).worst > 1.0 {
            return Vec::new();
        }
        let solution = Solution::new(self);
        let end = |place: usize, end: f64| last_unchanged(values[place], end, |value| solution.stays(place, value));
        let names = TunedBounds::NAMES.into_iter().zip(TunedBounds::RANGES).enumerate();
        names
            .map(|(place, (name, (low, high)))| UnchangedBound {
                bound: name.to_owned(),
                least: end(place, low),
                most: end(place, high),
            })
            .collect()
    }
}

/// The last value from `from` to `end` up to which a condition holds; `None` if it holds at `end`. Once it fails, it fails
/// for every value beyond.
fn last_unchanged(from: f64, end: f64, holds: impl Fn(f64) -> bool) -> Option<f64> {
    if holds(end) {
        return None;
    }
    let (mut inside, mut outside) = (from, end);
    for _ in 0..HALVINGS {
        let middle = 0.5 * (inside + outside);
        if holds(middle) {
            inside = middle;
        } else {
            outside = middle;
        }
    }
    Some(inside)
}

/// Bounds of variables and the clearance that tuned bounds determine.
struct Limits {
    nominal: VariableBounds,
    tightened: VariableBounds,
    clearance_m: f64,
}

impl Limits {
    fn new(of: &ConvergedGait<'_>, bounds: &TunedBounds) -> Self {
        let &ConvergedGait { problem, program, margins, .. } = of;
        let weight_n = program.model.total_mass * GRAVITY;
        let (layout, settings) = (&program.layout, program.settings());
        let nominal = variable_bounds(layout, bounds, settings, &problem.device, &program.muscles, weight_n);
        let mut tightened = nominal.clone();
        margins.tighten_variables(&mut tightened.lower, &mut tightened.upper);
        Self { nominal, tightened, clearance_m: ActiveLimits::new(&settings.limits, bounds).clearance_m }
    }
}

/// A row with swing clearance.
struct Clearance {
    row: usize,
    value: f64,
    /// Decrease of the value per metre of clearance.
    per_metre: f64,
}

/// The quantities of a converged gait that tuned bounds limit.
struct Solution<'a> {
    of: &'a ConvergedGait<'a>,
    own: Limits,
    clearances: Vec<Clearance>,
    between: Option<BetweenNodes>,
}

impl<'a> Solution<'a> {
    fn new(of: &'a ConvergedGait<'a>) -> Self {
        let &ConvergedGait { problem, program, gait, point, .. } = of;
        let mut values = vec![0.0; program.rows()];
        program.constraints(&point.x, &mut values);
        let mut clearances = Vec::new();
        for (d, domain) in program.rows.domains.iter().enumerate() {
            for (k, node) in domain.points.iter().enumerate() {
                for &HeightRow { row, .. } in node.heights.iter().filter(|height| height.clearance) {
                    let per_metre = clearance_weight(program, d, program.layout.domains[d].sigma(k), &point.x);
                    clearances.push(Clearance { row, value: values[row], per_metre });
                }
            }
        }
        Self {
            own: Limits::new(of, &problem.bounds),
            between: of.checks_between_nodes.then(|| BetweenNodes::new(program, gait, &point.x)),
            of,
            clearances,
        }
    }

    /// Whether the gait stays a solution with another value of one bound.
    fn stays(&self, place: usize, value: f64) -> bool {
        let mut values = self.of.problem.bounds.to_array();
        values[place] = value;
        let moved = Limits::new(self.of, &TunedBounds::of_array(values));
        self.variables_stay(&moved) && self.clearance_stays(moved.clearance_m)
    }

    fn variables_stay(&self, moved: &Limits) -> bool {
        let (own, point, tolerance) = (&self.own, self.of.point, self.of.tolerance);
        let stays = |j: usize| {
            let x = point.x[j];
            let [least, most] = self.between.as_ref().map_or([f64::INFINITY, f64::NEG_INFINITY], |b| b.reach[j]);
            let lower = MovingBound {
                bound: moved.tightened.lower[j],
                distance: x - own.tightened.lower[j],
                moved: x - moved.tightened.lower[j],
                multiplier: point.lower_multipliers[j],
            };
            let upper = MovingBound {
                bound: moved.tightened.upper[j],
                distance: own.tightened.upper[j] - x,
                moved: moved.tightened.upper[j] - x,
                multiplier: point.upper_multipliers[j],
            };
            (moved.nominal.lower[j] == own.nominal.lower[j]
                || (moved.nominal.lower[j] <= least && lower.stays_inactive(tolerance)))
                && (moved.nominal.upper[j] == own.nominal.upper[j]
                    || (moved.nominal.upper[j] >= most && upper.stays_inactive(tolerance)))
        };
        (0..point.x.len()).all(stays)
    }

    fn clearance_stays(&self, clearance_m: f64) -> bool {
        let of = self.of;
        let by = clearance_m - self.own.clearance_m;
        if by == 0.0 {
            return true;
        }
        let row_stays = |clearance: &Clearance| {
            let &Clearance { row, value, per_metre } = clearance;
            let bound = of.program.rows.lower[row] + of.margins.rows.get(&row).copied().unwrap_or(0.0);
            let moved = value - by * per_metre;
            let multiplier = of.point.slack_lower_multipliers[row];
            let side = MovingBound { bound, distance: value - bound, moved: moved - bound, multiplier };
            moved == value || side.stays_inactive(of.tolerance)
        };
        let between = self.between.iter().flat_map(|between| &between.clearances);
        self.clearances.iter().all(row_stays) && between.into_iter().all(|b| b.room >= by * b.per_metre)
    }
}

/// A bound that moves, with its distances from the gait before and after.
struct MovingBound {
    bound: f64,
    distance: f64,
    moved: f64,
    multiplier: f64,
}

impl MovingBound {
    fn stays_inactive(&self, tolerance: f64) -> bool {
        !is_active(self.distance, self.multiplier, self.bound)
            && self.moved >= least_distance(self.bound)
            && self.multiplier * self.moved <= tolerance
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use crate::solve::{CancelToken, SolveOptions, SolveOutcome, SolveStatus, solve};
    use crate::subject::Subject;

    fn solved(bounds: &str) -> (GaitProblem, SolveOutcome) {
        let mut problem = GaitProblem::new(Subject::builtin(1).unwrap(), false).unwrap();
        problem.bounds = TunedBounds::parse(bounds).unwrap();
        let options = SolveOptions { initial_guesses: 1, ..SolveOptions::default() };
        let outcome = solve(&problem, None, &options, &mut |_| {}, &CancelToken::new()).unwrap();
        assert_eq!(outcome.report.status, SolveStatus::Converged);
        (problem, outcome)
    }

    /// Smallest distance of the gait from a bound or a row of the problem with these values, relative to the bound, and the
    /// excess between nodes as a multiple of its tolerance.
    fn distance_and_excess(problem: &GaitProblem, outcome: &SolveOutcome, values: [f64; 8]) -> (f64, f64) {
        let moved = GaitProblem { bounds: TunedBounds::of_array(values), ..problem.clone() };
        let program = moved.program(problem.muscles).unwrap();
        let x = &outcome.warm_start.point.x;
        let excess = inter_node_excess(&program, &outcome.gait, x).worst;
        let tightened = program.tightened(&outcome.warm_start.margins);
        let mut rows = vec![0.0; tightened.rows()];
        tightened.constraints(x, &mut rows);
        let (lower, upper) = tightened.stored_bounds();
        let beside = |value: f64, bound: f64, sign: f64| sign * (value - bound) / bound.abs().max(1.0);
        let of_bounds = x.iter().zip(lower).zip(upper).filter(|((_, low), high)| low < high);
        let of_bounds = of_bounds.map(|((x, low), high)| beside(*x, *low, 1.0).min(beside(*x, *high, -1.0)));
        let clearances = program.rows.domains.iter().flat_map(|domain| &domain.points).flat_map(|node| &node.heights);
        let of_rows = clearances.map(|height| rows[height.row] - tightened.rows.lower[height.row]);
        (of_bounds.chain(of_rows).fold(f64::INFINITY, f64::min), excess)
    }

    #[test]
    fn gait_violates_a_bound_just_outside_its_interval_and_none_just_inside() {
        let (problem, outcome) = solved("a2=80,a5=0.013,a7=35");
        let own = problem.bounds.to_array();
        let (_, excess) = distance_and_excess(&problem, &outcome, own);
        assert!(excess <= 1.0);
        let mut ends = 0;
        for (place, interval) in outcome.report.unchanged_bounds.iter().enumerate() {
            let strictest = if TunedBounds::IS_LOWER[place] { interval.most } else { interval.least };
            let Some(end) = strictest.filter(|end| (end - own[place]).abs() > 1e-6) else { continue };
            let stricter = if TunedBounds::IS_LOWER[place] { 1e-5 } else { -1e-5 };
            let at = |factor: f64| {
                let mut values = own;
                values[place] = end * factor;
                distance_and_excess(&problem, &outcome, values)
            };
            let (distance, excess) = at(1.0 + stricter);
            assert!(distance < 0.0 || excess > 1.0, "{interval:?} {distance} {excess}");
            let (distance, excess) = at(1.0 - stricter);
            assert!(distance > -1e-7 && excess <= 1.0, "{interval:?} {distance} {excess}");
            ends += 1;
        }
        assert!(ends >= 4, "{:?}", outcome.report.unchanged_bounds);
    }

    #[test]
    fn inactive_clearance_ends_where_the_foot_is() {
        let (mut problem, outcome) = solved("a5=0.03");
        let mut point = outcome.warm_start.point.clone();
        // As a gait that clears 0.03 m for another reason.
        problem.bounds.a5 = 0.01;
        point.slack_lower_multipliers.fill(0.0);
        let program = problem.program(false).unwrap();
        let margins = &outcome.warm_start.margins;
        let gait = ConvergedGait {
            problem: &problem,
            program: &program,
            margins,
            gait: &outcome.gait,
            point: &point,
            tolerance: 1e-6,
            checks_between_nodes: true,
        };
        let interval = &gait.unchanged_bounds()[4];
        assert_eq!(interval.least, None);
        // The barrier kept the foot a little higher.
        let most = interval.most.unwrap();
        assert!((0.03 - 1e-6..0.03 + 1e-5).contains(&most), "{interval:?}");
    }

    #[test]
    fn bounds_overridden_by_a_stricter_limit_have_no_effect() {
        let (problem, outcome) = solved("a5=0.0");
        // The settings demand some clearance in any case.
        assert!(problem.settings.limits.clearance_min_m > 0.0);
        let interval = &outcome.report.unchanged_bounds[4];
        assert!(interval.contains(problem.settings.limits.clearance_min_m * (1.0 - 1e-9)), "{interval:?}");
        assert!(!interval.contains(0.013), "{interval:?}");
    }

    #[test]
    fn gait_that_a_solve_would_tighten_further_has_no_unchanged_bounds() {
        let (problem, outcome) = solved("a2=70,a6=0.1");
        assert!(outcome.report.tightened_bounds > 0, "nothing was tightened");
        let loose = SolveOptions { initial_guesses: 1, tightening_rounds: 0, ..SolveOptions::default() };
        let at_nodes = solve(&problem, None, &loose, &mut |_| {}, &CancelToken::new()).unwrap();
        let program = problem.program(false).unwrap();
        let gait = ConvergedGait {
            problem: &problem,
            program: &program,
            margins: &Margins::default(),
            gait: &at_nodes.gait,
            point: &at_nodes.warm_start.point,
            tolerance: 1e-6,
            checks_between_nodes: true,
        };
        assert_eq!(gait.unchanged_bounds(), []);
    }
}
