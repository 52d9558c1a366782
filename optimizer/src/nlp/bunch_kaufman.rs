//! Bunch-Kaufman factorisation of the leading columns of a symmetric matrix (Golub and Van Loan, section 4.4.4), with the
//! Schur complement left in the rest: P A P^T = L B L^T, B with blocks of order one and two.

// Vector code is compiled for a machine's instructions only where it is inlined into the dispatched call.
#![allow(clippy::inline_always)]

use pulp::Simd;

use super::dense_kernels::{LANES, subtract, subtract_two};
use super::kkt_solver::Inertia;

/// (1 + sqrt 17) / 8.
const ALPHA: f64 = 0.640_388_203_202_208;

/// The columns to eliminate within a matrix of `size` rows, stored with `stride`.
#[derive(Debug, Clone, Copy)]
pub(super) struct Pivots {
    pub first: usize,
    pub end: usize,
    pub size: usize,
    pub stride: usize,
}

/// Eliminates in place (lower triangle). `off_diagonal[j]` becomes the subdiagonal of a block of order two that begins
/// at j, else zero; `order[j]` the row that was moved to j. False when a column vanishes. `work`: two columns.
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
    let Pivots { first, end, size, stride } = pivots;
    off_diagonal.fill(0.0);
    for (j, p) in order.iter_mut().enumerate() {
        *p = j;
    }
    let mut j = first;
    while j < end {
        let Some((row, pair)) = choose(a, pivots, j) else { return false };
        let target = if pair { j + 1 } else { j };
        if row != target {
            exchange(a, pivots, target, row);
            order.swap(target, row);
        }
        let (w1, w2) = work[..2 * stride].split_at_mut(stride);
        if pair {
            let (d1, e, d2) = (a[j * stride + j], a[j * stride + j + 1], a[(j + 1) * stride + j + 1]);
            off_diagonal[j] = e;
            inertia.count_pair(d1, e, d2);
            let (inverse_1, inverse_e, inverse_2) = inverse_pair(d1, e, d2);
            let (left, right) = a.split_at_mut((j + 2) * stride);
            let (l1, l2) = left[j * stride..].split_at_mut(stride);
            w1.copy_from_slice(l1);
            w2.copy_from_slice(l2);
            // Whole vectors are updated below: nothing above the diagonal may leak in.
            l1[..j + 2].fill(0.0);
            l2[..j + 2].fill(0.0);
            for i in j + 2..size {
                l1[i] = inverse_1 * w1[i] + inverse_e * w2[i];
                l2[i] = inverse_e * w1[i] + inverse_2 * w2[i];
            }
            for (c, y) in (j + 2..size).zip(right.chunks_exact_mut(stride)) {
                if w1[c] != 0.0 || w2[c] != 0.0 {
                    let from = c / LANES * LANES;
                    subtract_two(simd, &mut y[from..], &l1[from..], w1[c], &l2[from..], w2[c]);
                }
            }
            l1[j] = d1;
            l2[j + 1] = d2;
            j += 2;
        } else {
            let d = a[j * stride + j];
            inertia.count(d);
            let (left, right) = a.split_at_mut((j + 1) * stride);
            let l = &mut left[j * stride..];
            w1.copy_from_slice(l);
            l[..=j].fill(0.0);
            let inverse = 1.0 / d;
            for v in &mut l[j + 1..size] {
                *v *= inverse;
            }
            for (c, y) in (j + 1..size).zip(right.chunks_exact_mut(stride)) {
                if w1[c] != 0.0 {
                    let from = c / LANES * LANES;
                    subtract(simd, &mut y[from..], &l[from..], w1[c]);
                }
            }
            l[j] = d;
            j += 1;
        }
    }
    true
}

/// Row to bring to the pivot position, and whether the pivot has order two; `None` when column j vanishes.
#[inline(always)]
fn choose(a: &[f64], pivots: Pivots, j: usize) -> Option<(usize, bool)> {
    let Pivots { end, stride, .. } = pivots;
    let column = &a[j * stride..j * stride + end];
    let diagonal = column[j].abs();
    let (mut largest, mut row) = (0.0, j);
    for (i, v) in column.iter().enumerate().skip(j + 1) {
        if v.abs() > largest {
            (largest, row) = (v.abs(), i);
        }
    }
    // Not a number: neither comparison holds.
    if !(diagonal > 0.0 || largest > 0.0) {
        return None;
    }
    if diagonal >= ALPHA * largest {
        return Some((j, false));
    }
    let mut in_row = 0.0f64;
    for i in j..row {
        in_row = in_row.max(a[i * stride + row].abs());
    }
    for v in &a[row * stride + row + 1..row * stride + end] {
        in_row = in_row.max(v.abs());
    }
    if diagonal * in_row >= ALPHA * largest * largest {
        Some((j, false))
    } else if a[row * stride + row].abs() >= ALPHA * in_row {
        Some((row, false))
    } else {
        Some((row, true))
    }
}

/// Exchanges rows and columns p < s, the rows in the finished columns included.
#[inline(always)]
fn exchange(a: &mut [f64], pivots: Pivots, p: usize, s: usize) {
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

/// Inverse of [a e; e d] as (first, off-diagonal, last), scaled by e against overflow.
pub(super) fn inverse_pair(a: f64, e: f64, d: f64) -> (f64, f64, f64) {
    let (ra, rd) = (a / e, d / e);
    let r = 1.0 / (e * (ra * rd - 1.0));
    (rd * r, -r, ra * r)
}
