//! The swing-up of a cart-pole of the Sleipnir benchmarks: 5 s in steps of the classical Runge-Kutta method, minimal
//! sum of squared forces.

use interior_point::{EliminationBlocks, NonlinearProgram, SparsityPattern};
use nalgebra::{SMatrix, SVector};
use num_dual::{Dual2SVec64, DualNum, hessian};
use std::f64::consts::PI;

use super::sparse::dissect;

/// s.
const DURATION: f64 = 5.0;
/// kg, kg, m, m/s².
const CART: f64 = 5.0;
const POLE: f64 = 0.5;
const LENGTH: f64 = 0.5;
const GRAVITY: f64 = 9.806;
/// Largest force, N, and the end of the track, m.
const MAX_FORCE: f64 = 20.0;
const TRACK: f64 = 2.0;
/// First and last state: cart (m), pole from hanging down (rad), and their rates.
const FIRST: [f64; 4] = [0.0; 4];
const LAST: [f64; 4] = [1.0, PI, 0.0, 0.0];
/// Variables of a node: the state, then the force until the next node; the last node has no force.
const PER_POINT: usize = 5;

/// A differentiated scalar.
trait Scalar: DualNum<Primitive = f64> + Copy {}
impl<T: DualNum<Primitive = f64> + Copy> Scalar for T {}

/// Time derivative of the state under a force.
fn rates<D: Scalar>(state: [D; 4], force: D) -> [D; 4] {
    let [_, angle, speed, turning] = state;
    let (sin, cos) = (angle.sin(), angle.cos());
    let pull = sin * (turning * turning * LENGTH + cos * GRAVITY) * POLE;
    let acceleration = (force + pull) / (sin * sin * POLE + CART);
    [speed, turning, acceleration, -(sin * GRAVITY + cos * acceleration) / LENGTH]
}

/// The state after one step.
fn stepped<D: Scalar>(state: [D; 4], force: D, step: f64) -> [D; 4] {
    let along = |by: [D; 4], time: f64| std::array::from_fn(|i| state[i] + by[i] * time);
    let a = rates(state, force);
    let b = rates(along(a, 0.5 * step), force);
    let c = rates(along(b, 0.5 * step), force);
    let d = rates(along(c, step), force);
    std::array::from_fn(|i| state[i] + (a[i] + (b[i] + c[i]) * 2.0 + d[i]) * (step / 6.0))
}

/// Value, gradient and Hessian of each component of the state after one step, with respect to state and force.
type Step = [(f64, SVector<f64, PER_POINT>, SMatrix<f64, PER_POINT, PER_POINT>); 4];

pub struct SwingUp {
    intervals: usize,
    jacobian: SparsityPattern,
    hessian: SparsityPattern,
    blocks: EliminationBlocks,
}

impl SwingUp {
    /// Each row is in the block of the node at the end of its step, whose state it determines.
    pub fn new(intervals: usize) -> Self {
        Self::with_rows_in(intervals, |_, end| end)
    }

    /// Each row is in the block that is eliminated first. Leaves then have as many rows as variables and determine
    /// forces by states a few steps later, which is regular but very ill conditioned.
    pub fn with_ill_conditioned_fronts(intervals: usize) -> Self {
        Self::with_rows_in(intervals, usize::min)
    }

    /// `block` gives the block of a row from the blocks of the nodes at the start and the end of its step.
    fn with_rows_in(intervals: usize, block: impl Fn(usize, usize) -> usize) -> Self {
        let variables = PER_POINT * intervals + 4;
        // Each column has a row of the previous step, which ends in this state, then those of the step from here.
        let mut jacobian = SparsityPattern { rows: 4 * intervals, columns: variables, ..SparsityPattern::default() };
        let mut hessian = SparsityPattern { rows: variables, columns: variables, ..SparsityPattern::default() };
        for column in 0..variables {
            let (point, place) = (column / PER_POINT, column % PER_POINT);
            jacobian.column_starts.push(jacobian.row_indices.len());
            hessian.column_starts.push(hessian.row_indices.len());
            if point > 0 && place < 4 {
                jacobian.row_indices.push(4 * (point - 1) + place);
            }
            if point < intervals {
                jacobian.row_indices.extend(4 * point..4 * point + 4);
                hessian.row_indices.extend(column..PER_POINT * (point + 1));
            }
        }
        jacobian.column_starts.push(jacobian.row_indices.len());
        hessian.column_starts.push(hessian.row_indices.len());
        let (parent, of_point) = dissect(intervals + 1, 4);
        let blocks = EliminationBlocks {
            parent,
            block_of_variable: (0..variables).map(|column| of_point[column / PER_POINT]).collect(),
            block_of_row: (0..4 * intervals).map(|row| block(of_point[row / 4], of_point[row / 4 + 1])).collect(),
        };
        Self { intervals, jacobian, hessian, blocks }
    }

    fn step_s(&self) -> f64 {
        DURATION / self.intervals as f64
    }

    /// Linear interpolation of both positions from the first state to the last, with zero rates and forces.
    pub fn start(&self) -> Vec<f64> {
        let mut x = vec![0.0; self.variables()];
        for (point, values) in x.chunks_mut(PER_POINT).enumerate() {
            let share = point as f64 / self.intervals as f64;
            for place in 0..2 {
                values[place] = FIRST[place] + share * (LAST[place] - FIRST[place]);
            }
        }
        x
    }

    fn state(x: &[f64], point: usize) -> [f64; 4] {
        std::array::from_fn(|i| x[PER_POINT * point + i])
    }

    fn derivatives(&self, x: &[f64], interval: usize) -> Step {
        let at = SVector::<f64, PER_POINT>::from_fn(|i, _| x[PER_POINT * interval + i]);
        let step =
            |v: SVector<Dual2SVec64<PER_POINT>, PER_POINT>| stepped([v[0], v[1], v[2], v[3]], v[4], self.step_s());
        hessian(step, &at)
    }
}

impl NonlinearProgram for SwingUp {
    fn variables(&self) -> usize {
        self.jacobian.columns
    }
    fn rows(&self) -> usize {
        self.jacobian.rows
    }
    fn variable_bounds(&self, lower: &mut [f64], upper: &mut [f64]) {
        for (point, (lower, upper)) in lower.chunks_mut(PER_POINT).zip(upper.chunks_mut(PER_POINT)).enumerate() {
            lower.fill(f64::NEG_INFINITY);
            upper.fill(f64::INFINITY);
            (lower[0], upper[0]) = (0.0, TRACK);
            if let (Some(low), Some(high)) = (lower.get_mut(4), upper.get_mut(4)) {
                (*low, *high) = (-MAX_FORCE, MAX_FORCE);
            }
            for (at, state) in [(0, FIRST), (self.intervals, LAST)] {
                if point == at {
                    lower[..4].copy_from_slice(&state);
                    upper[..4].copy_from_slice(&state);
                }
            }
        }
    }
    fn row_bounds(&self, lower: &mut [f64], upper: &mut [f64]) {
        lower.fill(0.0);
        upper.fill(0.0);
    }
    fn jacobian_pattern(&self) -> &SparsityPattern {
        &self.jacobian
    }
    fn hessian_pattern(&self) -> &SparsityPattern {
        &self.hessian
    }
    fn objective(&self, x: &[f64]) -> f64 {
        x.iter().skip(4).step_by(PER_POINT).map(|force| force * force).sum()
    }
    fn gradient(&self, x: &[f64], gradient: &mut [f64]) {
        gradient.fill(0.0);
        for (gradient, force) in gradient.iter_mut().zip(x).skip(4).step_by(PER_POINT) {
            *gradient = 2.0 * force;
        }
    }
    fn constraints(&self, x: &[f64], values: &mut [f64]) {
        for (interval, values) in values.chunks_mut(4).enumerate() {
            let (from, to) = (Self::state(x, interval), Self::state(x, interval + 1));
            let reached = stepped(from, x[PER_POINT * interval + 4], self.step_s());
            values.copy_from_slice(&std::array::from_fn::<f64, 4, _>(|i| to[i] - reached[i]));
        }
    }
    fn jacobian(&self, x: &[f64], values: &mut [f64]) {
        for interval in 0..self.intervals {
            let step = self.derivatives(x, interval);
            for place in 0..PER_POINT {
                let column = PER_POINT * interval + place;
                let end = self.jacobian.column_starts[column + 1];
                for (value, (_, gradient, _)) in values[end - 4..end].iter_mut().zip(&step) {
                    *value = -gradient[place];
                }
            }
            for place in 0..4 {
                values[self.jacobian.column_starts[PER_POINT * (interval + 1) + place]] = 1.0;
            }
        }
    }
    fn hessian(&self, x: &[f64], sigma: f64, multipliers: &[f64], values: &mut [f64]) {
        let mut at = 0;
        for interval in 0..self.intervals {
            let step = self.derivatives(x, interval);
            for column in 0..PER_POINT {
                for row in column..PER_POINT {
                    let weights = step.iter().zip(&multipliers[4 * interval..]);
                    values[at] = -weights.map(|((_, _, second), weight)| weight * second[(row, column)]).sum::<f64>();
                    at += 1;
                }
            }
            values[at - 1] += 2.0 * sigma;
        }
    }
    fn elimination_blocks(&self) -> Option<&EliminationBlocks> {
        Some(&self.blocks)
    }
}
