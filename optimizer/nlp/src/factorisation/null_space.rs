//! Stage 1 of a front: elimination of equality rows together with as many variables (a null-space method, Nocedal &
//! Wright, *Numerical Optimization*, section 16.2, within each front).
//!
//! The rows are J v + C_e^T s = ..., with s the slots of the front. LU of J^T with partial pivoting selects variables
//! v for which the square part S of J is well conditioned; the other variables become slots. With S^T = L U, X =
//! C_e^T S^-T and the coupling C of the selected variables with the slots, the Schur complement on the slots is
//!
//! ```text
//! A - X G^T - G X^T,   G = C - H X / 2
//! ```
//!
//! and [H S^T; S 0] has as many positive as negative eigenvalues for any H. The diagonal of the eliminated rows, the
//! regularisation delta_c, is many orders of magnitude below S and is neglected. The factorised matrix is the one
//! without it, and so is the one whose residual is measured (`KktSolver::mark_neglected`).

// Vector code gets the instructions of the machine only where it is inlined into the dispatched call.
#![allow(clippy::inline_always)]

use pulp::Simd;

use super::aligned::Aligned;
use super::bunch_kaufman::WORK_COLUMNS;
use super::dense_kernels::{
    LANES, largest_entry, largest_magnitude, subtract, subtract_columns_within, subtract_symmetric_product,
};
use super::front::Front;

/// A row is deferred if its pivot is below this fraction of its largest entry.
const MIN_PIVOT: f64 = 1e-8;
/// Largest negligible diagonal.
pub(super) const MAX_DIAGONAL: f64 = 1e-6;

/// The variable and the row at each position of the LU factors.
#[derive(Debug, Default)]
pub(super) struct NullSpace {
    /// Position -> variable of the front: selected variables, then free ones.
    pub variables: Vec<usize>,
    /// Position -> row of the front: eliminated rows, then deferred ones.
    pub rows: Vec<usize>,
    /// Number of eliminated rows.
    pub rank: usize,
}

/// Workspace of a thread.
#[derive(Debug, Default)]
pub(super) struct Workspace {
    /// The numbers of the current front. All fronts use the same array, so that it stays in the cache.
    pub numbers: Aligned,
    /// Stack of Schur complements whose parents are not factorised yet.
    pub stack: Vec<f64>,
    /// Columns with one row per slot.
    pub columns: Aligned,
    /// Copy of the transposed Jacobian.
    jacobian: Aligned,
    pivot: Aligned,
    terms: Vec<(usize, f64)>,
    /// Position in the null space of each variable.
    position: Vec<usize>,
}

impl Workspace {
    /// A workspace that is large enough for each of the fronts.
    pub(super) fn new(fronts: &[Front]) -> Self {
        let largest = |length: &dyn Fn(&Front) -> usize| fronts.iter().map(length).max().unwrap_or(0);
        Self {
            numbers: Aligned::zeros(largest(&|f| f.length)),
            stack: Vec::with_capacity(highest_stack(fronts)),
            columns: Aligned::zeros(largest(&|f| f.wide * f.rows.len().max(WORK_COLUMNS))),
            jacobian: Aligned::zeros(largest(&|f| f.tall * f.rows.len())),
            pivot: Aligned::zeros(largest(&|f| f.tall)),
            terms: Vec::with_capacity(largest(&|f| f.variables.len())),
            position: vec![0; largest(&|f| f.variables.len())],
        }
    }
}

/// Largest height of the stack when the fronts are factorised one after the other.
fn highest_stack(fronts: &[Front]) -> usize {
    let (mut height, mut highest) = (0, 0);
    for front in fronts {
        height -= front.children.iter().map(|(child, _)| fronts[*child].schur_length()).sum::<usize>();
        height += front.schur_length();
        highest = highest.max(height);
    }
    highest
}

impl Front {
    /// First used slot when `rank` rows are eliminated.
    pub(super) fn first_slot(&self, rank: usize) -> usize {
        self.spare() - 2 * (self.rows.len() - rank)
    }

    /// Slot of the first free variable.
    pub(super) fn first_free(&self, rank: usize) -> usize {
        self.first_other() - (self.variables.len() - rank)
    }
}

/// Eliminates the rows; false when too many have to be deferred. `before` is the factor of a matrix with the same
/// rows, whose L, U and X are reused.
#[inline(always)]
pub(super) fn eliminate<S: Simd>(
    simd: S,
    front: &Front,
    numbers: &mut [f64],
    null_space: &mut NullSpace,
    before: Option<&[f64]>,
    work: &mut Workspace,
) -> bool {
    let (tall, wide) = (front.tall, front.wide);
    let variables = front.variables.len();
    let (hessian, rest) = numbers.split_at_mut(front.jacobian);
    let (lu, rest) = rest.split_at_mut(front.coupling - front.jacobian);
    let (coupling, rest) = rest.split_at_mut(front.row_coupling - front.coupling);
    let (x, rest) = rest.split_at_mut(front.row_diagonal - front.row_coupling);
    let (diagonal, reduced) = rest.split_at_mut(front.reduced - front.row_diagonal);
    if let Some(before) = before {
        let [lu_before, x_before, ..] = front.kept.parts(before);
        lu.copy_from_slice(lu_before);
        front.kept.row_coupling.unpack(x_before, x);
    } else {
        work.jacobian[..lu.len()].copy_from_slice(lu);
        if !factor(simd, front, lu, x, null_space, &mut work.pivot) {
            return false;
        }
        solve_for_slots(simd, front, lu, x, null_space.rank, &mut work.terms);
    }
    let rank = null_space.rank;
    for (c, partners) in front.partners.iter().enumerate() {
        for r in partners.iter().map(|&r| r as usize).filter(|&r| r > c) {
            hessian[r * tall + c] = hessian[c * tall + r];
        }
    }

    // Free variables and deferred rows move to their slots.
    let first_free = front.first_free(rank);
    let first_deferred = front.first_slot(rank);
    for (slot, &row) in (first_deferred..).zip(&null_space.rows[rank..]) {
        for v in 0..variables {
            coupling[v * wide + slot] = work.jacobian[row * tall + v];
        }
        let position = slot - first_deferred + rank;
        let source = &mut x[position * wide..(position + 1) * wide];
        let target = &mut reduced[slot * wide..(slot + 1) * wide];
        for (t, s) in target.iter_mut().zip(&*source).skip(front.first_other()) {
            *t += s;
        }
        target[slot] = diagonal[row];
        for (free, &variable) in (first_free..).zip(&null_space.variables[rank..]) {
            target[free] = work.jacobian[row * tall + variable];
        }
        source.fill(0.0);
    }
    for (slot, &free) in (first_free..).zip(&null_space.variables[rank..]) {
        for v in 0..variables {
            coupling[v * wide + slot] = hessian[free * tall + v];
        }
    }
    for (slot, &free) in (first_free..).zip(&null_space.variables[rank..]) {
        let source = &coupling[free * wide..(free + 1) * wide];
        for (t, s) in reduced[slot * wide..(slot + 1) * wide].iter_mut().zip(source).skip(slot) {
            *t += s;
        }
    }

    for (k, &variable) in null_space.variables.iter().enumerate() {
        work.position[variable] = k;
    }
    let g = &mut work.columns[..wide * rank];
    for (position, &variable) in null_space.variables[..rank].iter().enumerate() {
        let column = &mut g[position * wide..(position + 1) * wide];
        column.copy_from_slice(&coupling[variable * wide..(variable + 1) * wide]);
        work.terms.clear();
        for &partner in &front.partners[variable] {
            let (position, h) = (work.position[partner as usize], hessian[variable * tall + partner as usize]);
            if position < rank && h != 0.0 {
                work.terms.push((position, 0.5 * h));
            }
        }
        for &(from, to) in &front.ranges {
            subtract_columns_within(simd, column, x, wide, &work.terms, from, to);
        }
    }
    subtract_symmetric_product(simd, reduced, x, g, &front.coupled, wide, rank, front.slots());
    true
}

/// J^T = P L U by columns; columns without an acceptable pivot go to the end.
#[inline(always)]
fn factor<S: Simd>(
    simd: S,
    front: &Front,
    lu: &mut [f64],
    x: &mut [f64],
    null_space: &mut NullSpace,
    pivot: &mut [f64],
) -> bool {
    let (tall, wide, variables) = (front.tall, front.wide, front.variables.len());
    let mut count = front.rows.len();
    null_space.variables.clear();
    null_space.variables.extend(0..variables);
    null_space.rows.clear();
    null_space.rows.extend(0..count);
    let mut t = 0;
    while t < count {
        let column = &lu[t * tall..t * tall + variables];
        let (largest, at) = largest_entry(column, t);
        // NaN is not an acceptable pivot.
        let acceptable = largest > MIN_PIVOT * largest_magnitude(column);
        if !acceptable {
            count -= 1;
            if null_space.rows.len() - count > front.most_deferred {
                return false;
            }
            for i in 0..tall {
                lu.swap(t * tall + i, count * tall + i);
            }
            for i in 0..wide {
                x.swap(t * wide + i, count * wide + i);
            }
            null_space.rows.swap(t, count);
            continue;
        }
        if at != t {
            for c in 0..null_space.rows.len() {
                lu.swap(c * tall + t, c * tall + at);
            }
            null_space.variables.swap(t, at);
        }
        let (left, right) = lu.split_at_mut((t + 1) * tall);
        let own = &mut left[t * tall..];
        let inverse = 1.0 / own[t];
        for v in &mut own[t + 1..variables] {
            *v *= inverse;
        }
        // Whole vectors are updated, so entries above the diagonal have to be zero.
        let from = t / LANES * LANES;
        let pivot = &mut pivot[from..tall];
        pivot.copy_from_slice(&own[from..tall]);
        pivot[..=t - from].fill(0.0);
        for column in right.chunks_exact_mut(tall) {
            let u = column[t];
            if u != 0.0 {
                subtract(simd, &mut column[from..], pivot, u);
            }
        }
        t += 1;
    }
    null_space.rank = count;
    true
}

/// X = C_e^T S^-T, including the part of the free variables.
#[inline(always)]
fn solve_for_slots<S: Simd>(
    simd: S,
    front: &Front,
    lu: &[f64],
    x: &mut [f64],
    rank: usize,
    terms: &mut Vec<(usize, f64)>,
) {
    let (tall, wide) = (front.tall, front.wide);
    for t in 0..rank {
        let u = &lu[t * tall..(t + 1) * tall];
        let (done, rest) = x.split_at_mut(t * wide);
        let column = &mut rest[..wide];
        terms.clear();
        terms.extend((0..).zip(&u[..t]).filter(|(_, v)| **v != 0.0).map(|(k, v)| (k, *v)));
        for &(from, to) in &front.ranges {
            subtract_columns_within(simd, column, done, wide, terms, from, to);
        }
        let inverse = 1.0 / u[t];
        for v in column {
            *v *= inverse;
        }
    }
    let (first, free) = (front.first_free(rank), front.variables.len() - rank);
    for t in 0..rank {
        x[t * wide + first..t * wide + first + free].copy_from_slice(&lu[t * tall + rank..t * tall + rank + free]);
    }
    for t in (0..rank).rev() {
        let l = &lu[t * tall..(t + 1) * tall];
        let (left, done) = x.split_at_mut((t + 1) * wide);
        terms.clear();
        terms.extend((0..).zip(&l[t + 1..rank]).filter(|(_, v)| **v != 0.0).map(|(k, v)| (k, *v)));
        for &(from, to) in &front.ranges {
            subtract_columns_within(simd, &mut left[t * wide..], done, wide, terms, from, to);
        }
    }
}
