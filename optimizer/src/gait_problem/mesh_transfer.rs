//! Transfer of a primal-dual point to another mesh.
//!
//! Variables are interpolated by the parabola through the three nodes of their mesh interval. Constraints at nodes
//! approximate constraints at all times, so a multiplier is a density times the Simpson weight of its node. Densities
//! are interpolated linearly, which preserves their signs. Multipliers of integration rows are values of a costate and
//! are interpolated directly.

use super::layout::DomainLayout;
use super::program_data::GaitProgram;
use super::row_names::{RowKind, RowName, RowPlace};
use interior_point::WarmPoint;
use std::collections::HashMap;

/// Transfers `point` from the mesh of `from` to that of `to`, a problem of the same variant. The solver initialises
/// slacks and their multipliers from the rows.
pub fn transfer(from: &GaitProgram, to: &GaitProgram, point: &WarmPoint) -> WarmPoint {
    WarmPoint {
        x: transfer_variables(from, to, &point.x, parabola),
        lower_multipliers: transfer_variables(from, to, &point.lower_multipliers, density),
        upper_multipliers: transfer_variables(from, to, &point.upper_multipliers, density),
        row_multipliers: transfer_rows(from, to, &point.row_multipliers),
        ..WarmPoint::default()
    }
}

/// Interpolates at a position in the domain, given the values at its old nodes.
type Interpolation = fn(&DomainLayout, &DomainLayout, usize, &dyn Fn(usize) -> f64) -> f64;

fn transfer_variables(from: &GaitProgram, to: &GaitProgram, values: &[f64], by: Interpolation) -> Vec<f64> {
    let mut result = vec![0.0; to.layout.variables];
    for (old, new) in from.layout.domains.iter().zip(&to.layout.domains) {
        for k in 0..new.points {
            for offset in 0..new.per_point {
                result[new.point(k) + offset] = by(old, new, k, &|at| values[old.point(at) + offset]);
            }
        }
    }
    // The variables without node come last, in the same order.
    let (start_old, start) = (from.layout.hip_velocities, to.layout.hip_velocities);
    result[start..].copy_from_slice(&values[start_old..]);
    result
}

/// Parabola through the three nodes of the old interval.
fn parabola(old: &DomainLayout, new: &DomainLayout, k: usize, value: &dyn Fn(usize) -> f64) -> f64 {
    let place = new.sigma(k) * old.intervals as f64;
    let interval = whole_below(place, old.intervals - 1);
    let s = place - interval as f64;
    let [a, b, c] = [0, 1, 2].map(|i| value(2 * interval + i));
    a * (1.0 - s) * (1.0 - 2.0 * s) + b * 4.0 * s * (1.0 - s) + c * s * (2.0 * s - 1.0)
}

/// Linear interpolation of the densities at the old nodes.
fn density(old: &DomainLayout, new: &DomainLayout, k: usize, value: &dyn Fn(usize) -> f64) -> f64 {
    let place = new.sigma(k) * old.last() as f64;
    let at = whole_below(place, old.last() - 1);
    let share = place - at as f64;
    let of = |k: usize| value(k) / old.simpson(k);
    new.simpson(k) * ((1.0 - share) * of(at) + share * of(at + 1))
}

/// Largest whole number not above `value`, at most `most`.
#[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // a place between 0 and the number of points
fn whole_below(value: f64, most: usize) -> usize {
    (value.max(0.0) as usize).min(most)
}

fn transfer_rows(from: &GaitProgram, to: &GaitProgram, values: &[f64]) -> Vec<f64> {
    // Rows that differ in their node only, in the order of the nodes.
    let mut alike: HashMap<RowName, Vec<usize>> = HashMap::new();
    for (row, name) in from.rows.names.iter().enumerate() {
        alike.entry(whatever_the_point(*name)).or_default().push(row);
    }
    let multiplier = |name: RowName| match alike.get(&whatever_the_point(name)).map(Vec::as_slice) {
        None => 0.0,
        // A condition at one instant has no density.
        Some([row]) => values[*row],
        Some(rows) => {
            let sigma_of = |row: usize| sigma(from, from.rows.names[row]);
            let density_of = |row: usize| values[row] / weight(from, from.rows.names[row]);
            let place = sigma(to, name);
            let above = rows.partition_point(|row| sigma_of(*row) < place).clamp(1, rows.len() - 1);
            let (a, b) = (rows[above - 1], rows[above]);
            // Constant before the first and after the last.
            let share = ((place - sigma_of(a)) / (sigma_of(b) - sigma_of(a))).clamp(0.0, 1.0);
            weight(to, name) * ((1.0 - share) * density_of(a) + share * density_of(b))
        }
    };
    to.rows.names.iter().copied().map(multiplier).collect()
}

fn whatever_the_point(name: RowName) -> RowName {
    match name.place {
        RowPlace::Point { domain, .. } => RowName { place: RowPlace::Point { domain, point: 0 }, ..name },
        RowPlace::Transition { .. } | RowPlace::Stride => name,
    }
}

/// Position of a row in its domain, 0 to 1.
fn sigma(program: &GaitProgram, name: RowName) -> f64 {
    let RowPlace::Point { domain, point } = name.place else { return 0.0 };
    program.layout.domains[domain].sigma(point)
}

/// Simpson weight of the node of a row; 1 for an integration row.
fn weight(program: &GaitProgram, name: RowName) -> f64 {
    let RowPlace::Point { domain, point } = name.place else { return 1.0 };
    match name.kind {
        RowKind::MidpointPhase
        | RowKind::EndpointPhase
        | RowKind::MidpointPhaseRate
        | RowKind::EndpointPhaseRate
        | RowKind::MidpointFibre
        | RowKind::EndpointFibre => 1.0,
        _ => program.layout.domains[domain].simpson(point),
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use crate::gait_problem::GaitProblem;
    use crate::settings::Mesh;
    use crate::subject::Subject;
    use interior_point::NonlinearProgram;

    fn program(mesh: Mesh) -> GaitProgram {
        let mut problem = GaitProblem::new(Subject::builtin(1).unwrap(), true).unwrap();
        problem.settings.mesh = mesh;
        problem.program(true).unwrap()
    }

    const COARSE: Mesh = Mesh { ds2: 2, ds3: 2, ss2: 3, ss1: 3 };
    const FINE: Mesh = Mesh { ds2: 4, ds3: 2, ss2: 6, ss1: 5 };

    /// Arbitrary positive numbers, as bound multipliers must be positive.
    fn numbers(count: usize) -> Vec<f64> {
        (0..count).map(|i| 1.0 + (i as f64 * 0.7).sin()).collect()
    }

    fn some_point(program: &GaitProgram) -> WarmPoint {
        let (n, m) = (program.variables(), program.rows());
        WarmPoint {
            x: numbers(n),
            row_multipliers: numbers(m),
            lower_multipliers: numbers(n),
            upper_multipliers: numbers(n),
            ..WarmPoint::default()
        }
    }

    #[test]
    fn transfer_to_the_same_mesh_is_the_identity() {
        let program = program(COARSE);
        let point = some_point(&program);
        let moved = transfer(&program, &program, &point);
        let pairs = [
            (&moved.x, &point.x),
            (&moved.row_multipliers, &point.row_multipliers),
            (&moved.lower_multipliers, &point.lower_multipliers),
            (&moved.upper_multipliers, &point.upper_multipliers),
        ];
        for (moved, point) in pairs {
            assert_eq!(moved.len(), point.len());
            assert!(moved.iter().zip(point).all(|(a, b)| (a - b).abs() < 1e-12));
        }
    }

    #[test]
    fn transfer_reproduces_parabolas_and_linear_densities() {
        let (coarse, fine) = (program(COARSE), program(FINE));
        let fill = |program: &GaitProgram| {
            let mut point = some_point(program);
            for layout in &program.layout.domains {
                for k in 0..layout.points {
                    let sigma = layout.sigma(k);
                    for j in layout.point(k)..layout.point(k) + layout.per_point {
                        point.x[j] = 1.0 - 2.0 * sigma + 3.0 * sigma * sigma;
                        point.lower_multipliers[j] = layout.simpson(k) * (2.0 + sigma);
                        point.upper_multipliers[j] = layout.simpson(k) * (3.0 - sigma);
                    }
                }
            }
            let rows = program.rows.names.iter();
            point.row_multipliers = rows.map(|name| weight(program, *name) * (1.0 + name.component as f64)).collect();
            let tail = program.layout.hip_velocities;
            for values in [&mut point.x, &mut point.lower_multipliers, &mut point.upper_multipliers] {
                values[tail..].fill(4.0);
            }
            point
        };
        let (moved, expected) = (transfer(&coarse, &fine, &fill(&coarse)), fill(&fine));
        let near = |a: &[f64], b: &[f64]| a.len() == b.len() && a.iter().zip(b).all(|(x, y)| (x - y).abs() < 1e-12);
        assert!(near(&moved.x, &expected.x));
        assert!(near(&moved.lower_multipliers, &expected.lower_multipliers));
        assert!(near(&moved.upper_multipliers, &expected.upper_multipliers));
        let alone = |row: usize| {
            let key = whatever_the_point(fine.rows.names[row]);
            fine.rows.names.iter().filter(|name| whatever_the_point(**name) == key).count() == 1
        };
        for row in (0..fine.rows()).filter(|row| !alone(*row)) {
            let (a, b) = (moved.row_multipliers[row], expected.row_multipliers[row]);
            assert!((a - b).abs() < 1e-12, "{}: {a} {b}", fine.rows.names[row].label());
        }
        assert!(moved.row_multipliers.iter().all(|y| *y > 0.0));
    }
}
