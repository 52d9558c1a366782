//! The inter-node check: what a gait exceeds between its nodes.
//!
//! A gait satisfies its constraints at the nodes. Between two nodes at a bound it may exceed that bound. The excess
//! becomes a margin of the bound at both nodes, and the problem is solved again (an exchange method of semi-infinite
//! programming, Hettich and Kortanek 1993, section 7).

use super::contact_limits::FRICTION_SCALE;
use super::foot_clearance::{HEIGHT_SCALE, clearance_weight, height_row};
use super::layout::{DomainLayout, FORCE, Q, QD, QDD, U};
use super::margins::Margins;
use super::program_data::GaitProgram;
use super::rows::HeightRow;
use crate::body::{Axis, COORDINATES, JOINTS, PointState};
use crate::gait::Gait;
use crate::gait::between_nodes::{GaitInstant, instant};
use crate::muscle::MUSCLE_COUNT;
use interior_point::NonlinearProgram;

/// Number of parts into which the check divides the interval between adjacent nodes.
const PARTS: usize = 10;
// Tolerances between nodes: half of the limits of the certificate.
const ANGLE_RAD: f64 = 0.005;
const SPEED_RAD_S: f64 = 0.05;
const ACCELERATION_RAD_S2: f64 = 2.5;
const TORQUE_N_M: f64 = 1.0;
const HEIGHT_M: f64 = 5e-4;
/// The tolerance of heights, in units of the rows.
const HEIGHT_TOLERANCE: f64 = HEIGHT_M * HEIGHT_SCALE;
const NORMAL_FORCE_N: f64 = 2.5;
const FRICTION_N: f64 = 6.0;
/// Share of the largest activation and of the largest fibre velocity.
const MUSCLE_SHARE: f64 = 0.025;

/// Violations of a gait between its nodes.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct InterNodeExcess {
    /// The violations, as margins of the adjacent nodes.
    pub margins: Margins,
    /// The largest violation, as a multiple of its tolerance.
    pub worst: f64,
}

impl InterNodeExcess {
    /// Adds a value of a variable between two nodes.
    fn note_variable(&mut self, program: &GaitProgram, points: [usize; 2], value: f64, left_alone: f64) {
        for variable in points {
            let (low, high) = program.variable_range(variable);
            self.note_side(program, variable, 0, low - value, left_alone);
            self.note_side(program, variable, 1, value - high, left_alone);
        }
    }

    /// Adds a violation; `side` is 0 for the lower and 1 for the upper bound.
    fn note_side(&mut self, program: &GaitProgram, variable: usize, side: usize, beyond: f64, left_alone: f64) {
        if beyond > 0.5 * left_alone {
            self.worst = self.worst.max(beyond / left_alone);
            let margin = &mut self.margins.variables.entry(variable).or_default()[side];
            *margin = margin.max(beyond / program.layout.scale[variable]);
        }
    }

    fn note_row(&mut self, row: usize, missing: f64, left_alone: f64) {
        if missing > 0.5 * left_alone {
            self.worst = self.worst.max(missing / left_alone);
            let margin = self.margins.rows.entry(row).or_default();
            *margin = margin.max(missing);
        }
    }
}

/// The violations between nodes of `gait`, the gait of the point `x` of `program`: coordinates, torques,
/// activations, fibre velocities, foot heights, normal forces and friction.
pub fn inter_node_excess(program: &GaitProgram, gait: &Gait, x: &[f64]) -> InterNodeExcess {
    let mut values = vec![0.0; program.rows.names.len()];
    program.constraints(x, &mut values);
    let mut excess = InterNodeExcess::default();
    visit(program, gait, |d, gap, share, now| {
        let mut note = |nodes, value, tolerance| excess.note_variable(program, nodes, value, tolerance);
        visit_variables(program, &program.layout.domains[d], gap, now, &mut note);
        let mut note = |height: HeightRow, value: f64| excess.note_row(height.row, -value, HEIGHT_TOLERANCE);
        visit_heights(program, (d, gap, share), now, x, &mut note);
        note_forces(program, (d, gap, share), now, &values, &mut excess);
    });
    excess
}

/// Calls `note` at the instants of the check, with domain, interval between adjacent nodes, and relative time in the domain.
fn visit(program: &GaitProgram, gait: &Gait, mut note: impl FnMut(usize, usize, f64, &GaitInstant)) {
    for (d, layout) in program.layout.domains.iter().enumerate() {
        let gaps = layout.points - 1;
        for gap in 0..gaps {
            for part in 1..PARTS {
                let share = (gap as f64 + part as f64 / PARTS as f64) / gaps as f64;
                note(d, gap, share, &instant(&gait.domains[d], share));
            }
        }
    }
}

/// The values between the nodes of a gait that tuned bounds limit.
pub(super) struct BetweenNodes {
    /// For each variable, the smallest and the largest bound that adjacent values satisfy to their tolerance, scaled.
    pub(super) reach: Vec<[f64; 2]>,
    /// The heights of the swing foot.
    pub(super) clearances: Vec<ClearanceBetween>,
}

/// A height with a clearance between nodes.
pub(super) struct ClearanceBetween {
    /// Value of the row, plus its tolerance.
    pub(super) room: f64,
    /// Decrease of the value per metre of clearance.
    pub(super) per_metre: f64,
}

impl BetweenNodes {
    /// The values of `gait`, the gait of the point `x` of `program`.
    pub(super) fn new(program: &GaitProgram, gait: &Gait, x: &[f64]) -> Self {
        let mut reach = vec![[f64::INFINITY, f64::NEG_INFINITY]; program.layout.variables];
        let mut clearances = Vec::new();
        visit(program, gait, |d, gap, share, now| {
            let layout = &program.layout.domains[d];
            visit_variables(program, layout, gap, now, &mut |nodes, value, tolerance| {
                for variable in nodes {
                    let scale = program.layout.scale[variable];
                    let [least, most] = &mut reach[variable];
                    *least = least.min((value + tolerance) / scale);
                    *most = most.max((value - tolerance) / scale);
                }
            });
            visit_heights(program, (d, gap, share), now, x, &mut |height, value| {
                if height.clearance {
                    let per_metre = clearance_weight(program, d, share, x);
                    clearances.push(ClearanceBetween { room: value + HEIGHT_TOLERANCE, per_metre });
                }
            });
        });
        Self { reach, clearances }
    }
}

/// Calls `note` for each variable with a bound: the two nodes beside the instant, the value, and its tolerance.
fn visit_variables(
    program: &GaitProgram,
    layout: &DomainLayout,
    gap: usize,
    now: &GaitInstant,
    note: &mut dyn FnMut([usize; 2], f64, f64),
) {
    let beside = |offset: usize| [layout.point(gap) + offset, layout.point(gap + 1) + offset];
    for i in 0..COORDINATES {
        // The bounds of the hip position are artificial.
        if i >= 2 {
            note(beside(Q + i), now.q[i], ANGLE_RAD);
        }
        note(beside(QD + i), now.qd[i], SPEED_RAD_S);
        note(beside(QDD + i), now.qdd[i], ACCELERATION_RAD_S2);
    }
    for i in 0..JOINTS {
        note(beside(U + i), now.u[i], TORQUE_N_M);
    }
    if let Some(muscles) = &now.muscles {
        for m in 0..MUSCLE_COUNT {
            let fastest = program.muscles[m].max_speed;
            let velocity = muscles.fibre_velocity[m];
            note(beside(layout.activation() + m), muscles.activation[m], MUSCLE_SHARE);
            note(beside(layout.fibre_velocity() + m), velocity, MUSCLE_SHARE * fastest);
        }
    }
}

/// Calls `note` with the value of each height row of the two nodes beside the instant.
fn visit_heights(
    program: &GaitProgram,
    (d, gap, share): (usize, usize, f64),
    now: &GaitInstant,
    x: &[f64],
    note: &mut dyn FnMut(HeightRow, f64),
) {
    let state = PointState::new(&now.q, &now.qd, &now.qdd);
    for k in [gap, gap + 1] {
        for height in &program.rows.domains[d].points[k].heights {
            note(*height, height_row(program, d, share, &state, *height, x));
        }
    }
}

fn note_forces(
    program: &GaitProgram,
    (d, gap, share): (usize, usize, f64),
    now: &GaitInstant,
    values: &[f64],
    excess: &mut InterNodeExcess,
) {
    let layout = &program.layout.domains[d];
    for (c, _) in program.contacts[d].iter().enumerate().filter(|(_, row)| row.axis == Axis::Z) {
        for k in [gap, gap + 1] {
            // The limit is 0, because some bounds at nodes are the load of a foot before lift-off.
            excess.note_side(program, layout.point(k) + FORCE + c, 0, -now.forces[c], NORMAL_FORCE_N);
        }
    }
    // Forces are parabolas, and the edges of the cone are linear in them.
    let points = &program.rows.domains[d].points;
    let first = gap - gap % 2;
    let s = 0.5 * (share * (layout.points - 1) as f64 - first as f64);
    let parabola = [(1.0 - s) * (1.0 - 2.0 * s), 4.0 * s * (1.0 - s), s * (2.0 * s - 1.0)];
    for edge in 0..points[gap].friction_edges {
        let value: f64 = (0..3).map(|i| parabola[i] * values[points[first + i].friction + edge]).sum();
        for k in [gap, gap + 1] {
            excess.note_row(points[k].friction + edge, -value, FRICTION_N * FRICTION_SCALE);
        }
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use crate::gait_problem::GaitProblem;
    use crate::gait_problem::gait_of;
    use crate::subject::Subject;

    /// A problem, and a posture at rest high above the ground that satisfies all bounds, with positive normal forces.
    fn hanging() -> (GaitProblem, GaitProgram, Vec<f64>) {
        let problem = GaitProblem::new(Subject::builtin(1).unwrap(), false).unwrap();
        let program = problem.program(false).unwrap();
        let mut x = vec![0.0; program.layout.variables];
        for (d, layout) in program.layout.domains.iter().enumerate() {
            x[layout.duration] = 1.0;
            for k in 0..layout.points {
                let mut point = program.layout.point_variables(&x, d, k);
                point.q[1] = 2.0;
                (point.q[4], point.q[7]) = (0.3, 0.3);
                for (force, row) in point.force.iter_mut().zip(&program.contacts[d]) {
                    *force = if row.axis == Axis::Z { 100.0 } else { 0.0 };
                }
                program.layout.set_point_variables(&mut x, d, k, &point);
            }
        }
        (problem, program, x)
    }

    fn excess(problem: &GaitProblem, program: &GaitProgram, x: &[f64]) -> InterNodeExcess {
        inter_node_excess(program, &gait_of(problem, program, x), x)
    }

    #[test]
    fn joint_violation_between_nodes_is_found_at_its_place_only() {
        let (problem, program, mut x) = hanging();
        assert_eq!(excess(&problem, &program, &x), InterNodeExcess::default());
        let layout = &program.layout.domains[2];
        let knee = |k: usize, block: usize| layout.point(k) + block + 4;
        let scale = &program.layout.scale;
        let (_, most) = program.variable_range(knee(5, Q));
        for (k, speed) in [(5, 3.0), (6, -3.0)] {
            x[knee(k, Q)] = most / scale[knee(k, Q)];
            x[knee(k, QD)] = speed / scale[knee(k, QD)];
        }
        let found = excess(&problem, &program, &x);
        assert!(found.worst > 1.0, "{}", found.worst);
        let of_angles: Vec<_> =
            found.margins.variables.iter().filter(|(at, _)| [4, 5, 6, 7].map(|k| knee(k, Q)).contains(at)).collect();
        let found_at: Vec<usize> = of_angles.iter().map(|(at, _)| **at).collect();
        assert_eq!(found_at, [knee(5, Q), knee(6, Q)]);
        assert!(of_angles.iter().all(|(_, [low, high])| *low == 0.0 && *high > ANGLE_RAD), "{of_angles:?}");

        let mut margins = Margins::default();
        margins.grow(&found.margins);
        let tightened = program.tightened(&margins);
        let by = most - tightened.variable_range(knee(5, Q)).1;
        assert!((by - of_angles[0].1[1] * scale[knee(5, Q)]).abs() < 1e-12);
        assert_eq!(tightened.variable_range(knee(4, Q)), program.variable_range(knee(4, Q)));
        // Margins near their bound stay relevant; others do not.
        let on = margins.relevant_at(&program, &x);
        assert!(on.variables.contains_key(&knee(5, Q)) && on.variables.contains_key(&knee(6, Q)));
        x[knee(5, Q)] = 0.0;
        assert!(!margins.relevant_at(&program, &x).variables.contains_key(&knee(5, Q)));
    }

    #[test]
    fn low_foot_and_pulling_force_between_nodes_are_found() {
        let (problem, program, mut x) = hanging();
        let layout = &program.layout.domains[0];
        let [first, second, third] = [0, 1, 2].map(|k| layout.point(k) + FORCE);
        let row = program.contacts[0].iter().position(|row| row.axis == Axis::Z).unwrap();
        x[first + row] = 1000.0 / program.layout.scale[first + row];
        (x[second + row], x[third + row]) = (0.0, 0.0);
        let found = excess(&problem, &program, &x);
        // The minimum of the parabola is in the second interval: -125 N.
        for at in [second + row, third + row] {
            let missing = found.margins.variables[&at][0] * program.layout.scale[at];
            assert!((missing - 120.0).abs() < 6.0, "{missing}");
        }
        assert!(!found.margins.variables.contains_key(&(first + row)));

        let (_, _, mut x) = hanging();
        let swing = &program.layout.domains[2];
        for k in 3..=4 {
            let height = swing.point(k) + Q + 1;
            x[height] = 0.85;
        }
        let found = excess(&problem, &program, &x);
        let rows: Vec<usize> =
            (2..=5).flat_map(|k| &program.rows.domains[2].points[k].heights).map(|height| height.row).collect();
        assert!(rows.iter().any(|row| found.margins.rows.contains_key(row)), "{:?}", found.margins.rows);
    }
}
