//! Multifrontal LBL^T with threshold pivoting and delayed pivots: slower than the other factorisations, with a reliable
//! inertia.
//!
//! The static fronts of [`super::multifrontal`] eliminate every pivot in the front that the structure assigns. Where
//! the pivot block is ill conditioned, the entries of L grow, rounding errors grow with their squares, and the
//! inertia may be wrong although refined solutions have small residuals. Here a pivot is accepted only if no entry of
//! its column of L exceeds 1 / [`THRESHOLD`], the border included (Duff & Reid, *The multifrontal solution of
//! indefinite sparse symmetric linear equations*, ACM TOMS 9, 1983; test for pivots of order two as in their section
//! 4). A candidate without an acceptable pivot is delayed to the parent front. The matrix is equilibrated
//! symmetrically by powers of two first.
//!
//! It runs on one thread with plain loops and allocates on first use, because it is a fallback.

use super::bunch_kaufman::{Pivots, exchange, inverse_pair};
use super::dense_kernels::all_finite;
use super::kkt_solver::{Inertia, KktSolver, MatrixChange};
use super::symbolic_analysis::postordered;

/// Threshold: smallest accepted ratio of a pivot to the largest entry of its column (the default of MA57).
const THRESHOLD: f64 = 0.01;
/// Sweeps of the equilibration; after three the largest entry of every row is near 1.
const SCALING_SWEEPS: usize = 3;

/// Structure of a front.
#[derive(Debug, Default)]
struct PlainFront {
    /// The indices assigned to this front.
    own: Vec<usize>,
    /// Later indices that it couples with.
    border: Vec<usize>,
    /// (position in the matrix values, row, column).
    entries: Vec<(usize, usize, usize)>,
    children: Vec<usize>,
}

/// Numerical factor of a front.
#[derive(Debug, Default)]
struct DelayedFactor {
    /// Eliminated indices in pivot order, then delayed ones, then (from `candidates` on) the border.
    indices: Vec<usize>,
    eliminated: usize,
    candidates: usize,
    /// Lower triangle by columns: L and the diagonal of B, then the Schur complement.
    numbers: Vec<f64>,
    /// Subdiagonal of B where a pivot of order two starts, otherwise zero.
    off_diagonal: Vec<f64>,
}

/// Analysis, factor and workspace.
pub(super) struct DelayedPivots {
    column_starts: Vec<usize>,
    row_indices: Vec<usize>,
    fronts: Vec<PlainFront>,
    factors: Vec<DelayedFactor>,
    scale: Vec<f64>,
    largest: Vec<f64>,
    /// Position of an index in the current front.
    place: Vec<usize>,
    /// Columns of the current pivot before the division by it.
    work: Vec<f64>,
}

impl DelayedPivots {
    /// Analyses the pattern of a lower triangle; `front_of` is the front of each index.
    pub(super) fn new(column_starts: &[usize], row_indices: &[usize], front_of: &[usize]) -> Self {
        let order = column_starts.len() - 1;
        let members = postordered(column_starts, row_indices, front_of);
        let (mut front_of, mut rank) = (vec![0; order], vec![0; order]);
        for (next, (f, i)) in members.iter().enumerate().flat_map(|(f, m)| m.iter().map(move |&i| (f, i))).enumerate() {
            (front_of[i], rank[i]) = (f, next);
        }
        let mut fronts: Vec<PlainFront> =
            members.into_iter().map(|own| PlainFront { own, ..PlainFront::default() }).collect();
        for j in 0..order {
            for q in column_starts[j]..column_starts[j + 1] {
                let i = row_indices[q];
                let (first, last) = if rank[i] < rank[j] { (i, j) } else { (j, i) };
                let front = &mut fronts[front_of[first]];
                front.entries.push((q, i, j));
                if front_of[last] != front_of[first] {
                    front.border.push(last);
                }
            }
        }
        for f in 0..fronts.len() {
            let mut border = std::mem::take(&mut fronts[f].border);
            border.sort_unstable_by_key(|&i| rank[i]);
            border.dedup();
            if let Some(&first) = border.first() {
                let parent = front_of[first];
                fronts[parent].children.push(f);
                let passed_on: Vec<usize> = border.iter().copied().filter(|&i| front_of[i] != parent).collect();
                fronts[parent].border.extend(passed_on);
            }
            fronts[f].border = border;
        }
        Self {
            column_starts: column_starts.to_vec(),
            row_indices: row_indices.to_vec(),
            factors: fronts.iter().map(|_| DelayedFactor::default()).collect(),
            fronts,
            scale: vec![1.0; order],
            largest: vec![0.0; order],
            place: vec![0; order],
            work: Vec::new(),
        }
    }

    /// Powers of two that bring the largest entry of every row near 1.
    fn find_scale(&mut self, values: &[f64]) {
        self.scale.fill(1.0);
        for _ in 0..SCALING_SWEEPS {
            self.largest.fill(0.0);
            for j in 0..self.scale.len() {
                for q in self.column_starts[j]..self.column_starts[j + 1] {
                    let i = self.row_indices[q];
                    let size = (values[q] * self.scale[i] * self.scale[j]).abs();
                    self.largest[i] = self.largest[i].max(size);
                    self.largest[j] = self.largest[j].max(size);
                }
            }
            for (scale, largest) in self.scale.iter_mut().zip(&self.largest) {
                if *largest > 0.0 {
                    *scale *= (-0.5 * largest.log2()).round().exp2();
                }
            }
        }
    }

    /// Assembles front `f`: its indices, those delayed by its children, its border, and its matrix.
    fn assemble(&mut self, f: usize, values: &[f64], own: &mut DelayedFactor) {
        let front = &self.fronts[f];
        own.indices.clear();
        own.indices.extend(&front.own);
        for child in front.children.iter().map(|&child| &self.factors[child]) {
            own.indices.extend(&child.indices[child.eliminated..child.candidates]);
        }
        own.candidates = own.indices.len();
        own.indices.extend(&front.border);
        for (place, &i) in own.indices.iter().enumerate() {
            self.place[i] = place;
        }
        let (size, place) = (own.indices.len(), &self.place);
        own.numbers.clear();
        own.numbers.resize(size * size, 0.0);
        let at = |i: usize, j: usize| place[i].min(place[j]) * size + place[i].max(place[j]);
        for &(q, i, j) in &front.entries {
            own.numbers[at(i, j)] += values[q] * self.scale[i] * self.scale[j];
        }
        for child in front.children.iter().map(|&child| &self.factors[child]) {
            let length = child.indices.len();
            for c in child.eliminated..length {
                for r in c..length {
                    own.numbers[at(child.indices[r], child.indices[c])] += child.numbers[c * length + r];
                }
            }
        }
    }
}

/// An accepted pivot, by position.
enum Pivot {
    One(usize),
    Two(usize, usize),
}

impl DelayedFactor {
    fn size(&self) -> usize {
        self.indices.len()
    }

    fn entry(&self, a: usize, b: usize) -> f64 {
        self.numbers[a.min(b) * self.size() + a.max(b)]
    }

    /// Largest off-diagonal entries of column j, position `without` excluded: among the candidates from `first` on
    /// (with its position), and among all.
    fn largest_in(&self, j: usize, first: usize, without: usize) -> ((f64, usize), f64) {
        let (mut among, mut all) = ((0.0, j), 0.0);
        for i in (first..self.size()).filter(|&i| i != j && i != without) {
            let entry = self.entry(i, j).abs();
            if i < self.candidates && entry > among.0 {
                among = (entry, i);
            }
            all = f64::max(all, entry);
        }
        (among, all)
    }

    /// The first acceptable pivot from `first` on.
    fn find(&self, first: usize) -> Option<Pivot> {
        (first..self.candidates).find_map(|j| {
            let ((among, r), all) = self.largest_in(j, first, j);
            let d = self.entry(j, j);
            if d != 0.0 && d.abs() >= THRESHOLD * all {
                return Some(Pivot::One(j));
            }
            if among == 0.0 {
                return None;
            }
            let (e, b) = (self.entry(r, j), self.entry(r, r));
            let (_, beside_j) = self.largest_in(j, first, r);
            let (_, beside_r) = self.largest_in(r, first, j);
            let (u, v, w) = inverse_pair(d, e, b);
            let multipliers = (u.abs() * beside_j + v.abs() * beside_r).max(v.abs() * beside_j + w.abs() * beside_r);
            (multipliers <= 1.0 / THRESHOLD).then_some(Pivot::Two(j, r))
        })
    }

    fn exchange(&mut self, a: usize, b: usize) {
        if a == b {
            return;
        }
        let size = self.size();
        exchange(&mut self.numbers, Pivots { first: 0, end: size, size, stride: size }, a.min(b), a.max(b));
        self.indices.swap(a, b);
    }

    /// Eliminates candidates until none is acceptable; false when a root front keeps one or a number is not finite.
    fn eliminate(&mut self, inertia: &mut Inertia, work: &mut Vec<f64>) -> bool {
        let size = self.size();
        self.off_diagonal.clear();
        let mut k = 0;
        while let Some(pivot) = self.find(k) {
            match pivot {
                Pivot::One(j) => {
                    self.exchange(k, j);
                    self.off_diagonal.push(0.0);
                    let (column, rest) = self.numbers[k * size..].split_at_mut(size);
                    work.clear();
                    work.extend_from_slice(column);
                    inertia.count(column[k]);
                    let inverse = 1.0 / column[k];
                    for c in k + 1..size {
                        column[c] *= inverse;
                        subtract_multiple(&mut rest[(c - k - 1) * size..], work, column[c], c..size);
                    }
                    k += 1;
                }
                Pivot::Two(j, r) => {
                    // The second index may be at the position that the first one takes.
                    self.exchange(k, j);
                    self.exchange(k + 1, if r == k { j } else { r });
                    let (first, rest) = self.numbers[k * size..].split_at_mut(size);
                    let (second, rest) = rest.split_at_mut(size);
                    work.clear();
                    work.extend_from_slice(first);
                    work.extend_from_slice(second);
                    let (d, e, b) = (first[k], first[k + 1], second[k + 1]);
                    inertia.count_pair(d, e, b);
                    self.off_diagonal.extend([e, 0.0]);
                    let (u, v, w) = inverse_pair(d, e, b);
                    first[k + 1] = 0.0;
                    let (before_first, before_second) = work.split_at(size);
                    for c in k + 2..size {
                        first[c] = u * before_first[c] + v * before_second[c];
                        second[c] = v * before_first[c] + w * before_second[c];
                        let target = &mut rest[(c - k - 2) * size..];
                        subtract_multiple(target, before_first, first[c], c..size);
                        subtract_multiple(target, before_second, second[c], c..size);
                    }
                    k += 2;
                }
            }
        }
        self.eliminated = k;
        // Without a border a remaining candidate has no acceptable pivot only if its column is zero.
        (k == self.candidates || self.candidates < size) && all_finite(&self.numbers)
    }
}

fn subtract_multiple(target: &mut [f64], source: &[f64], factor: f64, range: std::ops::Range<usize>) {
    if factor != 0.0 {
        for (t, s) in target[range.clone()].iter_mut().zip(&source[range]) {
            *t -= factor * s;
        }
    }
}

impl KktSolver for DelayedPivots {
    fn factor(&mut self, values: &[f64], _change: MatrixChange) -> Option<Inertia> {
        if !all_finite(values) {
            return None;
        }
        self.find_scale(values);
        let mut inertia = Inertia::default();
        for f in 0..self.fronts.len() {
            let mut own = std::mem::take(&mut self.factors[f]);
            self.assemble(f, values, &mut own);
            let done = own.eliminate(&mut inertia, &mut self.work);
            self.factors[f] = own;
            if !done {
                return None;
            }
        }
        Some(inertia)
    }

    fn solve(&mut self, x: &mut [f64]) {
        for (x, scale) in x.iter_mut().zip(&self.scale) {
            *x *= scale;
        }
        for factor in &self.factors {
            factor.substitute_forward(x);
        }
        for factor in self.factors.iter().rev() {
            factor.substitute_backward(x);
        }
        for (x, scale) in x.iter_mut().zip(&self.scale) {
            *x *= scale;
        }
    }

    fn factor_entries(&self) -> usize {
        self.factors.iter().map(|factor| factor.numbers.len()).sum()
    }
}

impl DelayedFactor {
    /// L and B.
    fn substitute_forward(&self, x: &mut [f64]) {
        let size = self.size();
        let mut k = 0;
        while k < self.eliminated {
            let width = if self.off_diagonal[k] == 0.0 { 1 } else { 2 };
            for j in k..k + width {
                let value = x[self.indices[j]];
                for (&i, l) in self.indices[k + width..].iter().zip(&self.numbers[j * size + k + width..(j + 1) * size])
                {
                    x[i] -= l * value;
                }
            }
            let (i, d) = (self.indices[k], self.numbers[k * size + k]);
            if width == 1 {
                x[i] /= d;
            } else {
                let j = self.indices[k + 1];
                let (u, v, w) = inverse_pair(d, self.off_diagonal[k], self.numbers[(k + 1) * size + k + 1]);
                (x[i], x[j]) = (u * x[i] + v * x[j], v * x[i] + w * x[j]);
            }
            k += width;
        }
    }

    /// L^T.
    fn substitute_backward(&self, x: &mut [f64]) {
        let size = self.size();
        for k in (0..self.eliminated).rev() {
            // The subdiagonal of a block of order two is zero in L.
            let column = &self.numbers[k * size + k + 1..(k + 1) * size];
            let sum: f64 = self.indices[k + 1..].iter().zip(column).map(|(&i, l)| x[i] * l).sum();
            x[self.indices[k]] -= sum;
        }
    }
}
