//! Torques and ground reaction forces for a given acceleration: `M qdd + h = B u + J^T f`.
//!
//! In single support the solution is unique. In double support it is redundant, by one dimension in DS2 and two in DS3:
//! a convex quadratic program chooses the torques nearest to those of the gait at the same phase, subject to
//! unilateral contact, friction and torque limits. One slack variable with a large penalty relaxes these limits
//! together. Optimal gaits leave the trailing foot almost unloaded, on the boundary of the limits, and the periodic
//! motion may cross it slightly; the slack measures by how much.

use super::feedback_linearization::{Control, State, split};
use super::limit_excess::AllowedRanges;
use crate::body::{Axis, InverseDynamics, PointState, Side};
use crate::walking::DomainKind;
use clarabel::algebra::CscMatrix;
use clarabel::solver::{DefaultSettingsBuilder, DefaultSolver, IPSolver, SolverStatus, SupportedConeT};

/// Unit of the torques in the program, N m.
const TORQUE_UNIT_N_M: f64 = 100.0;
/// Unit of the forces in the program, N.
const FORCE_UNIT_N: f64 = 500.0;
/// Number of equations of motion without a torque.
const UNACTUATED: usize = 3;

/// Torques of the controller and ground reaction forces.
#[derive(Debug, Clone)]
pub(super) struct TorquesAndForces {
    pub(super) u: [f64; 6],
    pub(super) forces: Vec<f64>,
}

/// Penalty on the slack: far above any gain in torque, so that the slack is positive only if the limits are infeasible.
const EXCESS_PRICE: f64 = 1e4;

/// Dense rows `a . (f, excess) <= bound` of the program; equations come first.
struct ProgramRows {
    coefficients: Vec<Vec<f64>>,
    bounds: Vec<f64>,
}

impl Control<'_> {
    /// Torques and forces of an acceleration; `None` if no forces produce it. The caller checks the limits.
    pub(super) fn effort(
        &self,
        x: &State,
        qdd: &[f64; 9],
        plan: &[f64; 6],
        limits: &AllowedRanges,
    ) -> Option<TorquesAndForces> {
        let (q, qd) = split(x);
        let state = PointState::new(&q, &qd, qdd);
        let wanted = InverseDynamics::new(self.model).rows(&state);
        let gradients: Vec<[f64; 9]> = self.contacts.iter().map(|c| c.gradient(&state)).collect();
        let forces = match self.domain.kind {
            DomainKind::Ss2 | DomainKind::Ss1 => {
                (0..self.contacts.len()).map(|row| self.force(x, row)).collect::<Option<Vec<_>>>()?
            }
            DomainKind::Ds2 | DomainKind::Ds3 => self.distribute(&wanted, &gradients, plan, limits)?,
        };
        let mut u = [0.0; 6];
        for (i, torque) in u.iter_mut().enumerate() {
            let carried: f64 = gradients.iter().zip(&forces).map(|(gradient, force)| gradient[3 + i] * force).sum();
            *torque = wanted[3 + i] - carried;
        }
        Some(TorquesAndForces { u, forces })
    }

    /// Minimises `|u(f) - plan|^2 / 2 + penalty * excess` over the contact forces f.
    fn distribute(
        &self,
        wanted: &[f64; 9],
        gradients: &[[f64; 9]],
        plan: &[f64; 6],
        limits: &AllowedRanges,
    ) -> Option<Vec<f64>> {
        let count = gradients.len();
        // u = offset + slope f, in the units of the program.
        let slope = |i: usize, c: usize| -gradients[c][3 + i] * FORCE_UNIT_N / TORQUE_UNIT_N_M;
        let offset = |i: usize| wanted[3 + i] / TORQUE_UNIT_N_M;
        let mut quadratic = vec![vec![0.0; count + 1]; count + 1];
        let mut linear = vec![0.0; count + 1];
        for c in 0..count {
            for other in c..count {
                quadratic[c][other] = (0..6).map(|i| slope(i, c) * slope(i, other)).sum();
            }
            linear[c] = (0..6).map(|i| slope(i, c) * (offset(i) - plan[i] / TORQUE_UNIT_N_M)).sum();
        }
        linear[count] = EXCESS_PRICE;
        let of_forces = |value: &dyn Fn(usize) -> f64| (0..count).map(value).collect::<Vec<f64>>();
        let mut rows = ProgramRows { coefficients: Vec::new(), bounds: Vec::new() };
        for i in 0..UNACTUATED {
            rows.push(of_forces(&|c| gradients[c][i]), 0.0, wanted[i] / FORCE_UNIT_N);
        }
        rows.push(vec![0.0; count], -1.0, 0.0);
        for (i, &(low, high)) in limits.torque_ranges().iter().enumerate() {
            rows.push(of_forces(&|c| slope(i, c)), -1.0, high / TORQUE_UNIT_N_M - offset(i));
            rows.push(of_forces(&|c| -slope(i, c)), -1.0, offset(i) - low / TORQUE_UNIT_N_M);
        }
        let at = |c: usize| (self.contacts[c].row.side, self.contacts[c].row.axis);
        for pushed in (0..count).filter(|&c| at(c).1 == Axis::Z) {
            rows.push(of_forces(&|c| if c == pushed { -1.0 } else { 0.0 }), -1.0, 0.0);
        }
        let friction = limits.friction_coefficient();
        for foot in [Side::Left, Side::Right] {
            for sign in [-1.0, 1.0] {
                let cone = |c: usize| match at(c) {
                    (side, _) if side != foot => 0.0,
                    (_, Axis::X) => sign,
                    (_, Axis::Z) => -friction,
                };
                rows.push(of_forces(&cone), -1.0, 0.0);
            }
        }
        let cones =
            [SupportedConeT::ZeroConeT(UNACTUATED), SupportedConeT::NonnegativeConeT(rows.bounds.len() - UNACTUATED)];
        let settings = DefaultSettingsBuilder::default().verbose(false).max_iter(100).build().ok()?;
        let matrix = CscMatrix::from(&rows.coefficients);
        let mut solver =
            DefaultSolver::new(&CscMatrix::from(&quadratic), &linear, &matrix, &rows.bounds, &cones, settings).ok()?;
        solver.solve();
        let solved = matches!(solver.solution.status, SolverStatus::Solved | SolverStatus::AlmostSolved);
        solved.then(|| solver.solution.x[..count].iter().map(|f| f * FORCE_UNIT_N).collect())
    }
}

impl ProgramRows {
    fn push(&mut self, mut coefficients: Vec<f64>, by_excess: f64, bound: f64) {
        coefficients.push(by_excess);
        self.coefficients.push(coefficients);
        self.bounds.push(bound);
    }
}
