//! Bunch-Kaufman factorisation of the leading columns of a symmetric matrix (Golub and Van Loan, section 4.4.4), with
//! the Schur complement left in the rest: P A P^T = L B L^T, B with blocks of order one and two.
//!
//! The factorisation is left-looking within a panel of columns; the columns after a panel are updated by one matrix
//! product at its end.

// Vector code gets the instructions of the machine only where it is inlined into the dispatched call.
#![allow(clippy::inline_always)]

use pulp::Simd;

use super::dense_kernels::{LANES, largest_entry, subtract_columns_within, subtract_product};
use super::kkt_solver::Inertia;

/// Pivot threshold (1 + sqrt 17) / 8.
const ALPHA: f64 = 0.640_388_203_202_208;
/// Columns of a panel; one more where the panel ends with a pivot of order two.
const PANEL: usize = 32;

/// The range of pivot columns of a matrix with `size` rows and column stride `stride`.
#[derive(Debug, Clone, Copy)]
pub(super) struct Pivots {
    pub first: usize,
    pub end: usize,
    pub size: usize,
    pub stride: usize,
}

/// Columns of work space that [`eliminate`] needs.
pub(super) const WORK_COLUMNS: usize = PANEL + 2;

/// Eliminates the pivot columns in place (lower triangle). `off_diagonal[j]` becomes the subdiagonal of a pivot of
/// order two that starts at j, otherwise zero; `order[j]` becomes the row that was moved to j. Returns false when a
/// column is zero. `work` has [`WORK_COLUMNS`] columns.
#[inline(always)]
pub(super) fn eliminate<S: Simd>(
    simd: S,
    a: &mut [f64],
    pivots: Pivots,
    off_diagonal: &mut [f64],
    order: &mut [usize],
    inertia: &mut Inertia,
    work: &mut [f64],
) -> bool {
    off_diagonal.fill(0.0);
    for (j, p) in order.iter_mut().enumerate() {
        *p = j;
    }
    let mut j = pivots.first;
    while j < pivots.end {
        let Some(next) = eliminate_panel(simd, a, pivots, j, off_diagonal, order, inertia, work) else { return false };
        let (panel, rest) = a.split_at_mut(next * pivots.stride);
        subtract_product(simd, rest, &panel[j * pivots.stride..], work, pivots.stride, next - j, next..pivots.size);
        j = next;
    }
    true
}

/// Eliminates the panel that starts at column `start` without updating the columns after it. `work` becomes W = L B
/// of the panel. Returns the first column after the panel, `None` when a column is zero.
#[allow(clippy::too_many_arguments)] // a kernel
#[inline(always)]
fn eliminate_panel<S: Simd>(
    simd: S,
    a: &mut [f64],
    pivots: Pivots,
    start: usize,
    off_diagonal: &mut [f64],
    order: &mut [usize],
    inertia: &mut Inertia,
    work: &mut [f64],
) -> Option<usize> {
    let Pivots { end, size, stride, .. } = pivots;
    // The columns of L have zeros down to their diagonals until the panel ends, because whole vectors are updated.
    let mut diagonals = [0.0; PANEL + 1];
    let mut j = start;
    while j < end && j < start + PANEL {
        let (done, own) = work.split_at_mut((j - start) * stride);
        let (w1, w2) = own[..2 * stride].split_at_mut(stride);
        w1[j..].copy_from_slice(&a[j * stride + j..(j + 1) * stride]);
        bring_up_to_date(simd, a, pivots, start, j, j, done, w1);
        let (largest, row) = largest_entry(&w1[..end], j + 1);
        let diagonal = w1[j].abs();
        // With NaN neither comparison holds.
        if !(diagonal > 0.0 || largest > 0.0) {
            return None;
        }
        let mut pair = false;
        let mut pivot = j;
        if diagonal < ALPHA * largest || diagonal.is_nan() {
            for i in j..row {
                w2[i] = a[i * stride + row];
            }
            w2[row..].copy_from_slice(&a[row * stride + row..(row + 1) * stride]);
            bring_up_to_date(simd, a, pivots, start, j, row, done, w2);
            let in_row = largest_entry(&w2[..row], j).0.max(largest_entry(&w2[..end], row + 1).0);
            if diagonal * in_row < ALPHA * largest * largest {
                pivot = row;
                pair = w2[row].abs() < ALPHA * in_row;
                if !pair {
                    w1.copy_from_slice(w2);
                }
            }
        }
        let target = if pair { j + 1 } else { j };
        if pivot > target {
            exchange(a, pivots, target, pivot);
            order.swap(target, pivot);
            for w in work.chunks_exact_mut(stride).take(target + 1 - start) {
                w.swap(target, pivot);
            }
        }
        let (w1, w2) = work[(j - start) * stride..][..2 * stride].split_at(stride);
        let (l1, l2) = a[j * stride..].split_at_mut(stride);
        if pair {
            let (d1, e, d2) = (w1[j], w1[j + 1], w2[j + 1]);
            off_diagonal[j] = e;
            inertia.count_pair(d1, e, d2);
            let (inverse_1, inverse_e, inverse_2) = inverse_pair(d1, e, d2);
            l1[..j + 2].fill(0.0);
            l2[..j + 2].fill(0.0);
            for i in j + 2..size {
                l1[i] = inverse_1 * w1[i] + inverse_e * w2[i];
                l2[i] = inverse_e * w1[i] + inverse_2 * w2[i];
            }
            (diagonals[j - start], diagonals[j + 1 - start]) = (d1, d2);
            j += 2;
        } else {
            let d = w1[j];
            inertia.count(d);
            let inverse = 1.0 / d;
            l1[..=j].fill(0.0);
            for (l, w) in l1[j + 1..size].iter_mut().zip(&w1[j + 1..size]) {
                *l = w * inverse;
            }
            diagonals[j - start] = d;
            j += 1;
        }
    }
    for (column, d) in (start..j).zip(diagonals) {
        a[column * stride + column] = d;
    }
    Some(j)
}

/// Updates the column w, whose diagonal is in row `row`, by the panel's finished columns up to `j`.
#[allow(clippy::too_many_arguments)] // a kernel
#[inline(always)]
fn bring_up_to_date<S: Simd>(
    simd: S,
    a: &[f64],
    pivots: Pivots,
    start: usize,
    j: usize,
    row: usize,
    done: &[f64],
    w: &mut [f64],
) {
    let Pivots { stride, .. } = pivots;
    let mut terms = [(0, 0.0); PANEL + 1];
    let count = j - start;
    for (k, (term, column)) in terms.iter_mut().zip(done.chunks_exact(stride)).enumerate() {
        *term = (k, column[row]);
    }
    let from = j / LANES * LANES;
    // Rows before j are unused; they only have to be finite.
    w[from..j].fill(0.0);
    subtract_columns_within(simd, w, &a[start * stride..], stride, &terms[..count], from, stride);
}

/// Exchanges rows and columns p < s symmetrically, including the rows of the finished columns.
#[inline(always)]
pub(super) fn exchange(a: &mut [f64], pivots: Pivots, p: usize, s: usize) {
    let Pivots { first, size, stride, .. } = pivots;
    for c in first..p {
        a.swap(c * stride + p, c * stride + s);
    }
    a.swap(p * stride + p, s * stride + s);
    for i in p + 1..s {
        a.swap(p * stride + i, i * stride + s);
    }
    for i in s + 1..size {
        a.swap(p * stride + i, s * stride + i);
    }
}

/// Inverse of [a e; e d] as (first diagonal, off-diagonal, second diagonal), scaled by e to avoid overflow.
pub(super) fn inverse_pair(a: f64, e: f64, d: f64) -> (f64, f64, f64) {
    let (ra, rd) = (a / e, d / e);
    let r = 1.0 / (e * (ra * rd - 1.0));
    (rd * r, -r, ra * r)
}
