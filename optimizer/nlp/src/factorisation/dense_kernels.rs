//! Vector kernels on column-major storage whose column stride is a multiple of [`LANES`].
//!
//! Each element of a result comes from the same sequence of fused multiply-adds for every vector width, so results do
//! not depend on the machine.

// Vector code gets the instructions of the machine only where it is inlined into the dispatched call.
#![allow(clippy::inline_always)]

use std::ops::Range;

use pulp::Simd;

/// Width of the widest supported vector of f64. Column strides are multiples of it.
pub(super) const LANES: usize = 8;

/// The next multiple of [`LANES`].
pub(super) fn padded(length: usize) -> usize {
    length.div_ceil(LANES) * LANES
}

#[inline(always)]
fn vectors<S: Simd>(values: &[f64]) -> &[S::f64s] {
    S::as_simd_f64s(values).0
}

#[inline(always)]
fn vectors_mut<S: Simd>(values: &mut [f64]) -> &mut [S::f64s] {
    S::as_mut_simd_f64s(values).0
}

/// y -= f a.
#[inline(always)]
pub(super) fn subtract<S: Simd>(simd: S, y: &mut [f64], a: &[f64], f: f64) {
    let f = simd.splat_f64s(-f);
    for (y, a) in vectors_mut::<S>(y).iter_mut().zip(vectors::<S>(a)) {
        *y = simd.mul_add_f64s(*a, f, *y);
    }
}

/// y[from..to] -= f a[from..to]; nothing else changes.
#[inline(always)]
pub(super) fn subtract_range<S: Simd>(simd: S, y: &mut [f64], a: &[f64], f: f64, from: usize, to: usize) {
    let inner = padded(from).min(to);
    let end = (to / LANES * LANES).max(inner);
    for i in (from..inner).chain(end..to) {
        y[i] = a[i].mul_add(-f, y[i]);
    }
    subtract(simd, &mut y[inner..end], &a[inner..end], f);
}

/// y -= sum of f x_k over the terms (k, f), where x_k is column k of x, for the entries [from, to), multiples of
/// [`LANES`].
#[inline(always)]
pub(super) fn subtract_columns_within<S: Simd>(
    simd: S,
    y: &mut [f64],
    x: &[f64],
    stride: usize,
    terms: &[(usize, f64)],
    from: usize,
    to: usize,
) {
    let per_block = LANES / S::F64_LANES;
    let y = vectors_mut::<S>(y);
    let (mut i, end) = (from / LANES * per_block, to / LANES * per_block);
    while i + 4 <= end {
        subtract_columns_tile::<S, 4>(simd, y, x, stride, terms, i);
        i += 4;
    }
    while i + 2 <= end {
        subtract_columns_tile::<S, 2>(simd, y, x, stride, terms, i);
        i += 2;
    }
    if i < end {
        subtract_columns_tile::<S, 1>(simd, y, x, stride, terms, i);
    }
}

/// The same for V vectors from number i on, kept in registers.
#[inline(always)]
fn subtract_columns_tile<S: Simd, const V: usize>(
    simd: S,
    y: &mut [S::f64s],
    x: &[f64],
    stride: usize,
    terms: &[(usize, f64)],
    i: usize,
) {
    let Some(y) = y[i..].first_chunk_mut::<V>() else { return };
    let mut sum = *y;
    for &(k, f) in terms {
        let Some(x) = vectors::<S>(&x[k * stride..][..stride])[i..].first_chunk::<V>() else { return };
        let f = simd.splat_f64s(-f);
        for v in 0..V {
            sum[v] = simd.mul_add_f64s(x[v], f, sum[v]);
        }
    }
    *y = sum;
}

/// Dot product of vectors of padded length, accumulated in [`LANES`] partial sums.
#[inline(always)]
pub(super) fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut sums = [0.0; LANES];
    add_to_lanes(&mut sums, a, b);
    sum_of_lanes(&sums)
}

/// Adds the products of vectors of padded length to [`LANES`] partial sums.
#[inline(always)]
pub(super) fn add_to_lanes(sums: &mut [f64; LANES], a: &[f64], b: &[f64]) {
    for (a, b) in a.as_chunks::<LANES>().0.iter().zip(b.as_chunks::<LANES>().0) {
        for k in 0..LANES {
            sums[k] = a[k].mul_add(b[k], sums[k]);
        }
    }
}

/// The sum of partial sums.
#[inline(always)]
pub(super) fn sum_of_lanes(sums: &[f64; LANES]) -> f64 {
    ((sums[0] + sums[4]) + (sums[1] + sums[5])) + ((sums[2] + sums[6]) + (sums[3] + sums[7]))
}

/// Largest |v_i|, ignoring NaNs.
#[inline(always)]
pub(crate) fn largest_magnitude(values: &[f64]) -> f64 {
    let larger = |a: f64, v: f64| if v.abs() > a { v.abs() } else { a };
    let mut largest = [0.0; LANES];
    let (blocks, rest) = values.as_chunks::<LANES>();
    for block in blocks {
        for k in 0..LANES {
            largest[k] = larger(largest[k], block[k]);
        }
    }
    rest.iter().copied().chain(largest).fold(0.0, larger)
}

/// Largest |v_i| from `first` on and its first position, ignoring NaNs.
#[inline(always)]
pub(super) fn largest_entry(values: &[f64], first: usize) -> (f64, usize) {
    let largest = largest_magnitude(&values[first.min(values.len())..]);
    let at = if largest > 0.0 { values.iter().skip(first).position(|v| v.abs() == largest) } else { None };
    (largest, first + at.unwrap_or(0))
}

/// Whether all values are finite.
#[inline(always)]
pub(crate) fn all_finite(values: &[f64]) -> bool {
    let mut sums = [0.0f64; LANES];
    let (blocks, rest) = values.as_chunks::<LANES>();
    for block in blocks {
        for k in 0..LANES {
            // Zero unless the value is infinite or NaN.
            sums[k] += block[k] * 0.0;
        }
    }
    sums.iter().all(|s| *s == 0.0) && rest.iter().all(|v| v.is_finite())
}

/// S -= X G^T + G X^T over the first `count` columns of X and G and the first `size` columns of S; of S only the
/// lower triangle and the tiles that it touches. `coupled` says by block of [`LANES`] rows whether X is nonzero
/// there. Elsewhere G has few columns, so zero factors are skipped.
#[allow(clippy::too_many_arguments)] // a kernel
#[inline(always)]
pub(super) fn subtract_symmetric_product<S: Simd>(
    simd: S,
    s: &mut [f64],
    x: &[f64],
    g: &[f64],
    coupled: &[bool],
    stride: usize,
    count: usize,
    size: usize,
) {
    let per_block = LANES / S::F64_LANES;
    let mut j = 0;
    while j < size {
        let width = if size - j >= 4 { 4 } else { 1 };
        let own = j / LANES;
        let mut block = own;
        while block < coupled.len() {
            // A run of blocks that are all coupled or all uncoupled.
            let kind = coupled[block];
            let end = (block..coupled.len()).find(|&b| coupled[b] != kind).unwrap_or(coupled.len());
            let (from, to) = (block * per_block, end * per_block);
            match (coupled[own], kind) {
                (true, true) if width == 4 => {
                    product_tiles::<S, 4, true>(simd, &mut s[j * stride..], x, g, stride, count, from, to, j);
                }
                (true, true) => {
                    product_tiles::<S, 1, true>(simd, &mut s[j * stride..], x, g, stride, count, from, to, j);
                }
                (false, true) => subtract_outer(simd, s, x, g, stride, count, from, to, j, width),
                (true, false) => subtract_outer(simd, s, g, x, stride, count, from, to, j, width),
                (false, false) => {}
            }
            block = end;
        }
        j += width;
    }
}

/// Vectors [from, to) of W columns of S -= X G^T, or of S -= X G^T + G X^T for `BOTH`; `s` starts with the first of
/// these columns, number j.
#[allow(clippy::too_many_arguments)] // a kernel
#[inline(always)]
fn product_tiles<S: Simd, const W: usize, const BOTH: bool>(
    simd: S,
    s: &mut [f64],
    x: &[f64],
    g: &[f64],
    stride: usize,
    count: usize,
    from: usize,
    to: usize,
    j: usize,
) {
    let mut i = from;
    while i + 2 <= to {
        product_tile::<S, 2, W, BOTH>(simd, s, x, g, stride, count, i, j);
        i += 2;
    }
    if i < to {
        product_tile::<S, 1, W, BOTH>(simd, s, x, g, stride, count, i, j);
    }
}

/// The same for V vectors from number i on.
#[allow(clippy::too_many_arguments)] // a kernel
#[inline(always)]
fn product_tile<S: Simd, const V: usize, const W: usize, const BOTH: bool>(
    simd: S,
    s: &mut [f64],
    x: &[f64],
    g: &[f64],
    stride: usize,
    count: usize,
    i: usize,
    j: usize,
) {
    let mut sum = [[simd.splat_f64s(0.0); V]; W];
    for (x, g) in x.chunks_exact(stride).zip(g.chunks_exact(stride)).take(count) {
        let rows = (vectors::<S>(x)[i..].first_chunk::<V>(), vectors::<S>(g)[i..].first_chunk::<V>());
        let columns = (x[j..].first_chunk::<W>(), g[j..].first_chunk::<W>());
        let ((Some(xi), Some(gi)), (Some(xj), Some(gj))) = (rows, columns) else { return };
        for c in 0..W {
            let (from_g, from_x) = (simd.splat_f64s(gj[c]), simd.splat_f64s(xj[c]));
            for v in 0..V {
                sum[c][v] = simd.mul_add_f64s(xi[v], from_g, sum[c][v]);
                if BOTH {
                    sum[c][v] = simd.mul_add_f64s(gi[v], from_x, sum[c][v]);
                }
            }
        }
    }
    for (column, sum) in s.chunks_exact_mut(stride).zip(&sum) {
        for (out, sum) in vectors_mut::<S>(column)[i..].iter_mut().zip(sum) {
            *out = simd.sub_f64s(*out, *sum);
        }
    }
}

/// Vectors [from, to) of `width` columns, from column j on, of S -= A B^T.
#[allow(clippy::too_many_arguments)] // a kernel
#[inline(always)]
fn subtract_outer<S: Simd>(
    simd: S,
    s: &mut [f64],
    a: &[f64],
    b: &[f64],
    stride: usize,
    count: usize,
    from: usize,
    to: usize,
    j: usize,
    width: usize,
) {
    for (a, b) in a.chunks_exact(stride).zip(b.chunks_exact(stride)).take(count) {
        let rows = &vectors::<S>(a)[from..to];
        let factors = &b[j..j + width];
        if factors.iter().all(|f| *f == 0.0) {
            continue;
        }
        for (c, f) in factors.iter().enumerate() {
            let f = simd.splat_f64s(-f);
            let column = &mut s[(j + c) * stride..(j + c + 1) * stride];
            for (out, row) in vectors_mut::<S>(column)[from..to].iter_mut().zip(rows) {
                *out = simd.mul_add_f64s(*row, f, *out);
            }
        }
    }
}

/// The columns `range` of S -= L W^T over the first `count` columns of L and W; only the lower triangle and the tiles
/// that it touches. `s` starts with the first of these columns.
#[inline(always)]
pub(super) fn subtract_product<S: Simd>(
    simd: S,
    s: &mut [f64],
    l: &[f64],
    w: &[f64],
    stride: usize,
    count: usize,
    range: Range<usize>,
) {
    let to = stride / S::F64_LANES;
    let mut j = range.start;
    for group in s.chunks_mut(4 * stride) {
        if j >= range.end {
            break;
        }
        let from = j / LANES * (LANES / S::F64_LANES);
        if range.end - j >= 4 {
            product_tiles::<S, 4, false>(simd, group, l, w, stride, count, from, to, j);
        } else {
            for (column, k) in group.chunks_exact_mut(stride).zip(j..range.end) {
                product_tiles::<S, 1, false>(simd, column, l, w, stride, count, from, to, k);
            }
        }
        j += 4;
    }
}
