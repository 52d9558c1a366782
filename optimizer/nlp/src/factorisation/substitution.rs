//! Forward and backward substitution over the fronts of a factorisation.
//!
//! Forward, each front combines its right-hand sides with the contributions of its children and passes the part of
//! its border to its parent. Backward, each front passes the values of their borders to its children. Independent
//! subtrees run on several threads; sums run over the children in a fixed order, so the result is bit for bit that of
//! a single thread.

// Vector code gets the instructions of the machine only where it is inlined into the dispatched call.
#![allow(clippy::inline_always)]

use std::sync::Mutex;

use pulp::{Arch, Simd, WithSimd};

use super::aligned::Aligned;
use super::bunch_kaufman::inverse_pair;
use super::dense_kernels::{LANES, dot, padded, subtract_range};
use super::front::Front;
use super::front_factor::FrontFactor;
use super::null_space::NullSpace;
use super::schedule::SubtreeTask;
use super::thread_pool::lock;

/// Values at a front: intermediate after the forward substitution, the solution after the backward one.
#[derive(Debug)]
struct Values {
    /// By variable.
    variables: Aligned,
    /// By row; after the forward substitution v0, by position in the null space.
    rows: Aligned,
    /// By slot. The border is passed to the parent after the forward substitution and comes from the parent before the
    /// backward one.
    slots: Aligned,
}

/// Work vectors of a thread, large enough for every front.
#[derive(Debug)]
pub(super) struct SubstitutionWorkspace {
    /// One value per pivot slot, in pivot order.
    ordered: Aligned,
    /// One value per position of the null space.
    positions: Aligned,
    products: Aligned,
    terms: Vec<(usize, f64)>,
}

impl SubstitutionWorkspace {
    pub(super) fn new(fronts: &[Front]) -> Self {
        let largest = |length: &dyn Fn(&Front) -> usize| fronts.iter().map(length).max().unwrap_or(0);
        let (slots, positions) = (largest(&|f| f.wide), largest(&|f| f.tall));
        Self {
            ordered: Aligned::zeros(slots),
            positions: Aligned::zeros(positions),
            products: Aligned::zeros(positions),
            terms: Vec::with_capacity(positions),
        }
    }
}

/// Values at the fronts.
pub(super) struct Substitution {
    values: Vec<Mutex<Values>>,
}

impl Substitution {
    pub(super) fn new(fronts: &[Front]) -> Self {
        let values = |front: &Front| Values {
            variables: Aligned::zeros(front.tall),
            rows: Aligned::zeros(front.tall),
            slots: Aligned::zeros(front.wide),
        };
        Self { values: fronts.iter().map(|front| Mutex::new(values(front))).collect() }
    }

    /// Forward substitution over a task whose children are done.
    pub(super) fn forward(
        &self,
        architecture: Arch,
        fronts: &[Front],
        factors: &[Mutex<FrontFactor>],
        task: &SubtreeTask,
        rhs: &[f64],
        space: &mut SubstitutionWorkspace,
    ) {
        architecture.dispatch(Forward { fronts, factors, task, values: &self.values, rhs, space });
    }

    /// Backward substitution over a task whose parent is done.
    pub(super) fn backward(
        &self,
        architecture: Arch,
        fronts: &[Front],
        factors: &[Mutex<FrontFactor>],
        task: &SubtreeTask,
        space: &mut SubstitutionWorkspace,
    ) {
        architecture.dispatch(Backward { fronts, factors, task, values: &self.values, space });
    }

    /// Writes the solution.
    pub(super) fn read(&self, fronts: &[Front], x: &mut [f64]) {
        for (front, values) in fronts.iter().zip(&self.values) {
            let values = lock(values);
            let mut scatter = |indices: &[usize], from: &[f64]| {
                for (&i, value) in indices.iter().zip(from) {
                    x[i] = *value;
                }
            };
            scatter(&front.variables, &values.variables);
            scatter(&front.rows, &values.rows);
            scatter(&front.others, &values.slots[front.first_other()..]);
        }
    }
}

/// Forward substitution over a task.
struct Forward<'a> {
    fronts: &'a [Front],
    factors: &'a [Mutex<FrontFactor>],
    task: &'a SubtreeTask,
    values: &'a [Mutex<Values>],
    rhs: &'a [f64],
    space: &'a mut SubstitutionWorkspace,
}

impl WithSimd for Forward<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { fronts, factors, task, values, rhs, space } = self;
        for f in task.start..task.end {
            let own = &mut *lock(&values[f]);
            collect(fronts, f, rhs, values, own);
            eliminate(simd, &fronts[f], &lock(&factors[f]), rhs, own, space);
        }
    }
}

/// Backward substitution over a task.
struct Backward<'a> {
    fronts: &'a [Front],
    factors: &'a [Mutex<FrontFactor>],
    task: &'a SubtreeTask,
    values: &'a [Mutex<Values>],
    space: &'a mut SubstitutionWorkspace,
}

impl WithSimd for Backward<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { fronts, factors, task, values, space } = self;
        for f in (task.start..task.end).rev() {
            let own = &mut *lock(&values[f]);
            substitute(simd, &fronts[f], &lock(&factors[f]), own, space);
            distribute(fronts, f, own, values);
        }
    }
}

/// Right-hand sides of the variables and of the other pivots, with the contributions of the children.
#[inline(always)]
fn collect(fronts: &[Front], f: usize, rhs: &[f64], values: &[Mutex<Values>], own: &mut Values) {
    let front = &fronts[f];
    for (value, &i) in own.variables.iter_mut().zip(&front.variables) {
        *value = rhs[i];
    }
    own.slots.fill(0.0);
    for (value, &i) in own.slots[front.first_other()..].iter_mut().zip(&front.others) {
        *value = rhs[i];
    }
    for (child, map) in &front.children {
        let child_values = lock(&values[*child]);
        let border = &child_values.slots[fronts[*child].pivot_slots()..];
        let (to_variables, to_slots) = border.split_at(map.variables.len());
        for (value, &variable) in to_variables.iter().zip(&map.variables) {
            own.variables[variable as usize] += value;
        }
        for (value, &slot) in to_slots.iter().zip(&map.slots) {
            own.slots[slot as usize] += value;
        }
    }
}

/// Passes the values of their borders to the children.
#[inline(always)]
fn distribute(fronts: &[Front], f: usize, own: &Values, values: &[Mutex<Values>]) {
    for (child, map) in &fronts[f].children {
        let mut child_values = lock(&values[*child]);
        let border = &mut child_values.slots[fronts[*child].pivot_slots()..];
        let (from_variables, from_slots) = border.split_at_mut(map.variables.len());
        for (value, &variable) in from_variables.iter_mut().zip(&map.variables) {
            *value = own.variables[variable as usize];
        }
        for (value, &slot) in from_slots.iter_mut().zip(&map.slots) {
            *value = own.slots[slot as usize];
        }
    }
}

/// Forward: with right-hand sides c of the rows, g of the variables, b of the slots,
/// v0 = S^-1 c, h = g - H v0, and b - C^T v0 - X h goes through stage 2 and on to the border.
#[inline(always)]
fn eliminate<S: Simd>(
    simd: S,
    front: &Front,
    factor: &FrontFactor,
    rhs: &[f64],
    own: &mut Values,
    space: &mut SubstitutionWorkspace,
) {
    let (tall, wide) = (front.tall, front.wide);
    let [lu, row_coupling, coupling, hessian, reduced] = front.kept.parts(&factor.numbers);
    let slots = &mut *own.slots;
    let NullSpace { variables, rows, rank } = &factor.null_space;
    let rank = *rank;
    if rank > 0 {
        let (v0, h) = (&mut *own.rows, &mut space.positions[..tall]);
        h.fill(0.0);
        for e in 0..rank {
            let column = &lu[e * tall..(e + 1) * tall];
            let end = padded(e);
            h[e] = (rhs[front.rows[rows[e]]] - dot(&column[..end], &h[..end])) / column[e];
        }
        // This solve reads only positions above e of a cleared vector, which it has written itself.
        v0.fill(0.0);
        for e in (0..rank).rev() {
            let from = (e + 1) / LANES * LANES;
            v0[e] = h[e] - dot(&lu[e * tall + from..(e + 1) * tall], &v0[from..]);
        }
        // Hessian products use the order of the variables, not of the null space.
        space.terms.clear();
        space.terms.extend(variables[..rank].iter().copied().zip(v0.iter().copied()));
        let product = &mut space.products[..tall];
        product.fill(0.0);
        front.kept.hessian.subtract(simd, product, hessian, &space.terms);
        front.kept.coupling.subtract(simd, slots, coupling, &space.terms);
        space.terms.clear();
        for (e, &variable) in variables[..rank].iter().enumerate() {
            own.variables[variable] += product[variable];
            space.terms.push((e, own.variables[variable]));
        }
        front.kept.row_coupling.subtract(simd, slots, row_coupling, &space.terms);
    }
    let first = front.first_slot(rank);
    let pivots = front.pivot_slots();
    for (slot, &row) in slots[first..].iter_mut().zip(&rows[rank..]) {
        *slot += rhs[front.rows[row]];
    }
    for (slot, &variable) in slots[front.first_free(rank)..].iter_mut().zip(&variables[rank..]) {
        *slot += own.variables[variable];
    }
    let ordered = &mut space.ordered[..pivots];
    for (value, &slot) in ordered.iter_mut().zip(&factor.order) {
        *value = slots[slot];
    }
    slots[first..pivots].copy_from_slice(&ordered[first..]);
    for j in first..pivots {
        let begin = if factor.off_diagonal[j] == 0.0 { j + 1 } else { j + 2 };
        let value = slots[j];
        subtract_range(simd, slots, &reduced[j * wide..(j + 1) * wide], value, begin, wide);
    }
    let mut j = first;
    while j < pivots {
        let (e, d) = (factor.off_diagonal[j], reduced[j * wide + j]);
        if e == 0.0 {
            slots[j] /= d;
            j += 1;
        } else {
            let (a, c, b) = inverse_pair(d, e, reduced[(j + 1) * wide + j + 1]);
            let (u, v) = (slots[j], slots[j + 1]);
            slots[j] = a * u + c * v;
            slots[j + 1] = c * u + b * v;
            j += 2;
        }
    }
}

/// Backward: stage 2, then v = v0 - X^T s and S^T y = h - C s - H (v - v0) with s the values of the slots.
#[inline(always)]
fn substitute<S: Simd>(
    simd: S,
    front: &Front,
    factor: &FrontFactor,
    own: &mut Values,
    space: &mut SubstitutionWorkspace,
) {
    let (tall, wide) = (front.tall, front.wide);
    let [lu, row_coupling, coupling, hessian, reduced] = front.kept.parts(&factor.numbers);
    let NullSpace { variables, rows, rank } = &factor.null_space;
    let rank = *rank;
    let first = front.first_slot(rank);
    let pivots = front.pivot_slots();
    let slots = &mut *own.slots;
    let ordered = &mut space.ordered[..pivots];
    ordered[first..].copy_from_slice(&slots[first..pivots]);
    slots[..pivots].fill(0.0);
    for j in (first..pivots).rev() {
        let begin = if factor.off_diagonal[j] == 0.0 { j + 1 } else { j + 2 };
        let column = &reduced[j * wide..(j + 1) * wide];
        // Slots before `begin` are still zero, or subtracted again below.
        let from = begin / LANES * LANES;
        let mut sum = dot(&column[from..], &slots[from..]);
        for k in from..begin {
            sum -= column[k] * slots[k];
        }
        slots[j] = ordered[j] - sum;
    }
    ordered[first..].copy_from_slice(&slots[first..pivots]);
    for (value, &slot) in ordered.iter().zip(&factor.order).skip(first) {
        slots[slot] = *value;
    }
    if rank == 0 {
        return;
    }
    let (lambda, product) = (&mut space.positions[..tall], &mut space.products[..tall]);
    lambda.fill(0.0);
    space.terms.clear();
    for (e, &variable) in variables[..rank].iter().enumerate() {
        let change = -front.kept.row_coupling.dot(row_coupling, e, slots);
        lambda[e] = own.variables[variable] - front.kept.coupling.dot(coupling, variable, slots);
        space.terms.push((variable, change));
        own.variables[variable] = own.rows[e] + change;
    }
    for (&variable, slot) in variables[rank..].iter().zip(&slots[front.first_free(rank)..]) {
        own.variables[variable] = *slot;
    }
    product.fill(0.0);
    front.kept.hessian.subtract(simd, product, hessian, &space.terms);
    for e in 0..rank {
        lambda[e] += product[variables[e]];
    }
    for e in 0..rank {
        let value = lambda[e];
        subtract_range(simd, lambda, &lu[e * tall..(e + 1) * tall], value, e + 1, rank);
    }
    for e in (0..rank).rev() {
        lambda[e] /= lu[e * tall + e];
        let value = lambda[e];
        subtract_range(simd, lambda, &lu[e * tall..(e + 1) * tall], value, 0, e);
    }
    for (&row, value) in rows[..rank].iter().zip(&*lambda) {
        own.rows[row] = *value;
    }
    for (&row, slot) in rows[rank..].iter().zip(&slots[first..]) {
        own.rows[row] = *slot;
    }
}
