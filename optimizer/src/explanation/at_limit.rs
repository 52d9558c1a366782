//! The tuned bounds that the last iterate of a solve reaches.

use super::bound::{Level, loosened};
use super::conflict::BoundSet;
use crate::gait_problem::{GaitProblem, GaitProgram};
use crate::solve::SolveError;
use interior_point::NonlinearProgram;

/// Largest distance from a limit, in scaled units, at which it counts as reached.
const AT_LIMIT: f64 = 1e-4;

/// Names of the domains in which `x` reaches a limit that `bound` sets.
pub(super) fn domains_at_limit(
    problem: &GaitProblem,
    program: &GaitProgram,
    x: &[f64],
    bound: usize,
) -> Result<Vec<String>, SolveError> {
    let bounds = loosened(&problem.bounds, BoundSet::EMPTY.with(bound), Level::Loosest)?;
    let relaxed = GaitProblem { bounds, ..problem.clone() }.program(problem.muscles)?;
    let mut values = [vec![0.0; program.rows()], vec![0.0; program.rows()]];
    program.constraints(x, &mut values[0]);
    relaxed.constraints(x, &mut values[1]);
    let row_at_limit = |row: usize| {
        let value = values[0][row];
        let slack = (value - program.rows.lower[row]).min(program.rows.upper[row] - value);
        values[0][row] != values[1][row] && slack < AT_LIMIT
    };
    let bounds = |program: &GaitProgram| {
        let mut pair = [vec![0.0; program.variables()], vec![0.0; program.variables()]];
        let [lower, upper] = &mut pair;
        program.variable_bounds(lower, upper);
        pair
    };
    let ([lower, upper], [loose_lower, loose_upper]) = (bounds(program), bounds(&relaxed));
    let variable_at_limit = |j: usize| {
        lower[j] != loose_lower[j] && x[j] - lower[j] < AT_LIMIT
            || upper[j] != loose_upper[j] && upper[j] - x[j] < AT_LIMIT
    };
    let mut names: Vec<String> = Vec::new();
    let places = (0..program.variables())
        .filter(|variable| variable_at_limit(*variable))
        .map(|variable| program.layout.variable_label(variable).0)
        .chain((0..program.rows()).filter(|row| row_at_limit(*row)).map(|row| program.rows.names[row].label()));
    for place in places {
        // `SS1_R node 3, ...`, or a variable of the whole stride.
        let name = place.split_once(" node").map_or("stride", |(domain, _)| domain);
        if !names.iter().any(|known| known == name) {
            names.push(name.to_owned());
        }
    }
    Ok(names)
}
