//! Active constraints of a solution, and how far a parameter can move until they change.

use crate::gait_problem::GaitProgram;
use crate::gait_problem::active_constraint::is_active;
use interior_point::{NonlinearProgram, ParameterDerivative, WarmPoint};
use serde::Serialize;

/// Largest ratio of distance and multiplier, or its inverse, at which a constraint counts as weakly active.
const WEAK_RATIO: f64 = 100.0;

/// A constraint that is active at a node or over the stride.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ActiveConstraint {
    /// Domain, node and quantity, as in `SS1_R node 3, velocity of the right knee`.
    pub place: String,
    /// Multiplier of the scaled constraint: decrease of the objective per unit by which the constraint is relaxed.
    pub multiplier: f64,
}

/// One side of a variable or of a row.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct ConstraintSide {
    of_row: bool,
    index: usize,
    is_upper: bool,
}

/// Distances and multipliers of every finite bound at a solution.
pub(super) struct ActiveSet {
    /// Side, distance from the limit, multiplier, limit.
    sides: Vec<(ConstraintSide, f64, f64, f64)>,
}

impl ActiveSet {
    pub(super) fn new(program: &GaitProgram, point: &WarmPoint) -> Self {
        let (n, m) = (program.variables(), program.rows());
        let (mut lower, mut upper) = (vec![0.0; n], vec![0.0; n]);
        program.variable_bounds(&mut lower, &mut upper);
        let (mut row_lower, mut row_upper) = (vec![0.0; m], vec![0.0; m]);
        program.row_bounds(&mut row_lower, &mut row_upper);
        let mut sides = Vec::new();
        let mut note = |side: ConstraintSide, value: f64, limit: f64, multiplier: f64| {
            let distance = if side.is_upper { limit - value } else { value - limit };
            if distance.is_finite() {
                sides.push((side, distance.max(0.0), multiplier, limit));
            }
        };
        for index in (0..n).filter(|&j| lower[j] < upper[j]) {
            let side = ConstraintSide { of_row: false, index, is_upper: false };
            let value = point.x[index];
            note(side, value, lower[index], point.lower_multipliers[index]);
            note(ConstraintSide { is_upper: true, ..side }, value, upper[index], point.upper_multipliers[index]);
        }
        for index in (0..m).filter(|&i| row_lower[i] < row_upper[i]) {
            let side = ConstraintSide { of_row: true, index, is_upper: false };
            let slack = point.slacks[index];
            note(side, slack, row_lower[index], point.slack_lower_multipliers[index]);
            note(
                ConstraintSide { is_upper: true, ..side },
                slack,
                row_upper[index],
                point.slack_upper_multipliers[index],
            );
        }
        Self { sides }
    }

    /// The largest negative and the smallest positive step of the parameter at which a constraint becomes active or
    /// inactive, to first order.
    pub(super) fn steps(&self, parameter: &ParameterDerivative, along: &WarmPoint) -> (Option<f64>, Option<f64>) {
        let (mut back, mut forth): (Option<f64>, Option<f64>) = (None, None);
        for &(side, distance, multiplier, _) in &self.sides {
            let (value, rate) = if distance > multiplier {
                (distance, distance_rate(side, parameter, along))
            } else {
                (multiplier, multiplier_rate(side, along))
            };
            let step = -value / rate;
            if step > 0.0 && step.is_finite() {
                forth = Some(forth.map_or(step, |known| known.min(step)));
            } else if step < 0.0 && step.is_finite() {
                back = Some(back.map_or(step, |known| known.max(step)));
            }
        }
        (back, forth)
    }

    /// Whether a constraint that depends on the parameter is neither clearly active nor clearly inactive.
    pub(super) fn is_weak(&self, parameter: &ParameterDerivative) -> bool {
        let weak =
            |distance: f64, multiplier: f64| distance < WEAK_RATIO * multiplier && multiplier < WEAK_RATIO * distance;
        self.sides.iter().any(|&(side, distance, multiplier, _)| depends(side, parameter) && weak(distance, multiplier))
    }
}

/// Whether a bound, or the row that it limits, depends on the parameter.
fn depends(side: ConstraintSide, parameter: &ParameterDerivative) -> bool {
    let i = side.index;
    match (side.of_row, side.is_upper) {
        (false, false) => parameter.lower[i] != 0.0,
        (false, true) => parameter.upper[i] != 0.0,
        (true, false) => parameter.row_lower[i] != 0.0 || parameter.rows[i] != 0.0,
        (true, true) => parameter.row_upper[i] != 0.0 || parameter.rows[i] != 0.0,
    }
}

/// Derivative of the distance from a bound.
fn distance_rate(side: ConstraintSide, parameter: &ParameterDerivative, along: &WarmPoint) -> f64 {
    let i = side.index;
    match (side.of_row, side.is_upper) {
        (false, false) => along.x[i] - parameter.lower[i],
        (false, true) => parameter.upper[i] - along.x[i],
        (true, false) => along.slacks[i] - parameter.row_lower[i],
        (true, true) => parameter.row_upper[i] - along.slacks[i],
    }
}

fn multiplier_rate(side: ConstraintSide, along: &WarmPoint) -> f64 {
    let i = side.index;
    match (side.of_row, side.is_upper) {
        (false, false) => along.lower_multipliers[i],
        (false, true) => along.upper_multipliers[i],
        (true, false) => along.slack_lower_multipliers[i],
        (true, true) => along.slack_upper_multipliers[i],
    }
}

/// The active constraints that depend on the parameter, largest multiplier first.
pub(super) fn of_parameter(
    program: &GaitProgram,
    set: &ActiveSet,
    parameter: &ParameterDerivative,
) -> Vec<ActiveConstraint> {
    let active = set.sides.iter().filter(|&&(_, distance, multiplier, limit)| is_active(distance, multiplier, limit));
    let mut found: Vec<ActiveConstraint> = active
        .filter(|(side, ..)| depends(*side, parameter))
        .map(|&(side, _, multiplier, _)| ActiveConstraint {
            place: if side.of_row {
                program.rows.names[side.index].label()
            } else {
                program.layout.variable_label(side.index).0
            },
            multiplier,
        })
        .collect();
    found.sort_by(|one, other| other.multiplier.total_cmp(&one.multiplier));
    found
}
