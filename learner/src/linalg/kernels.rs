//! Inner loops, compiled for several vector instruction sets and dispatched at run time.
//!
//! Sums consist of [`LANES`] interleaved partial sums, and products use fused multiply-add, for every vector width.
//! Equal inputs therefore give equal bits on every machine.

#![allow(clippy::inline_always, reason = "a kernel must be inlined into the function compiled for the vector unit")]

use pulp::{Arch, Simd, WithSimd};

/// Number of interleaved partial sums of an inner product, and of right-hand sides of a block.
pub(super) const LANES: usize = 16;

/// Rows and columns of the tiles of a matrix product, chosen so that their sums fit in registers.
const TILE_ROWS: usize = 4;
const TILE: usize = 8;

/// Defines a function whose body is compiled once for each instruction set. Bodies must use plain loops, because
/// closures are compiled for the baseline instruction set only.
macro_rules! kernels {
    ($($(#[$doc:meta])* $visibility:vis fn $name:ident<'a>($($argument:ident: $type:ty),*) $(-> $result:ty)? $body:block)*) => {
        $($(#[$doc])*
        $visibility fn $name<'a>($($argument: $type),*) $(-> $result)? {
            #[allow(non_camel_case_types)]
            struct DispatchedKernel<'a> { $($argument: $type,)* }
            impl<'a> WithSimd for DispatchedKernel<'a> {
                type Output = kernels!(@output $($result)?);
                #[inline(always)]
                fn with_simd<S: Simd>(self, _: S) -> Self::Output {
                    let Self { $($argument),* } = self;
                    $body
                }
            }
            Arch::new().dispatch(DispatchedKernel { $($argument),* })
        })*
    };
    (@output) => { () };
    (@output $result:ty) => { $result };
}

#[inline(always)]
fn dot_inline(a: &[f64], b: &[f64]) -> f64 {
    let n = a.len().min(b.len());
    let (a, b) = (&a[..n], &b[..n]);
    let mut sums = [0.0_f64; LANES];
    let (a_chunks, b_chunks) = (a.chunks_exact(LANES), b.chunks_exact(LANES));
    let (a_rest, b_rest) = (a_chunks.remainder(), b_chunks.remainder());
    for (x, y) in a_chunks.zip(b_chunks) {
        for k in 0..LANES {
            sums[k] = x[k].mul_add(y[k], sums[k]);
        }
    }
    for k in 0..a_rest.len() {
        sums[k] = a_rest[k].mul_add(b_rest[k], sums[k]);
    }
    let mut width = LANES / 2;
    while width > 0 {
        for k in 0..width {
            sums[k] += sums[k + width];
        }
        width /= 2;
    }
    sums[0]
}

#[inline(always)]
fn add_scaled_inline(y: &mut [f64], a: f64, x: &[f64]) {
    let n = y.len().min(x.len());
    let (y, x) = (&mut y[..n], &x[..n]);
    for i in 0..n {
        y[i] = a.mul_add(x[i], y[i]);
    }
}

/// `T_rk = sum_w A_wr B_wk`.
#[inline(always)]
fn tile_product(a: &[[f64; TILE_ROWS]], b: &[[f64; TILE]]) -> [[f64; TILE]; TILE_ROWS] {
    // Four variables instead of an array of arrays, which the compiler does not keep in registers.
    let (mut t0, mut t1, mut t2, mut t3) = ([0.0_f64; TILE], [0.0_f64; TILE], [0.0_f64; TILE], [0.0_f64; TILE]);
    for (x, y) in a.iter().zip(b) {
        for k in 0..TILE {
            t0[k] = x[0].mul_add(y[k], t0[k]);
        }
        for k in 0..TILE {
            t1[k] = x[1].mul_add(y[k], t1[k]);
        }
        for k in 0..TILE {
            t2[k] = x[2].mul_add(y[k], t2[k]);
        }
        for k in 0..TILE {
            t3[k] = x[3].mul_add(y[k], t3[k]);
        }
    }
    [t0, t1, t2, t3]
}

/// Adds a row of a tile to the rest of a row of a matrix; either may be longer.
#[inline(always)]
fn add_tile_row(rest: &mut [f64], row: &[f64; TILE]) {
    if let Some(whole) = rest.first_chunk_mut::<TILE>() {
        for k in 0..TILE {
            whole[k] += row[k];
        }
    } else {
        for k in 0..rest.len() {
            rest[k] += row[k];
        }
    }
}

kernels! {
    /// Inner product.
    pub(crate) fn dot<'a>(a: &'a [f64], b: &'a [f64]) -> f64 {
        dot_inline(a, b)
    }

    /// `y += a x`.
    pub(crate) fn add_scaled<'a>(y: &'a mut [f64], a: f64, x: &'a [f64]) {
        add_scaled_inline(y, a, x);
    }

    /// `y = A x`, `A` stored by rows.
    pub(crate) fn multiply<'a>(rows: &'a [f64], x: &'a [f64], y: &'a mut [f64]) {
        let n = x.len();
        for i in 0..y.len() {
            y[i] = dot_inline(&rows[i * n..(i + 1) * n], x);
        }
    }

    /// `C_yz += sum_w L_wy weight_w R_wz`, all stored by rows; `C` has `columns` columns.
    pub(crate) fn add_scaled_products<'a>(
        left: &'a [f64], right: &'a [f64], weights: &'a [f64], c: &'a mut [f64], columns: usize
    ) {
        let depth = weights.len();
        if depth == 0 || columns == 0 {
            return;
        }
        let rows = c.len() / columns;
        // Copy both sides into panels, so that the product reads memory contiguously.
        let groups = rows.div_ceil(TILE_ROWS);
        let mut scaled = vec![[0.0_f64; TILE_ROWS]; groups * depth];
        for w in 0..depth {
            for y in 0..rows {
                scaled[y / TILE_ROWS * depth + w][y % TILE_ROWS] = left[w * rows + y] * weights[w];
            }
        }
        let mut panel = vec![[0.0_f64; TILE]; depth];
        for z in (0..columns).step_by(TILE) {
            let wide = TILE.min(columns - z);
            for w in 0..depth {
                panel[w][..wide].copy_from_slice(&right[w * columns + z..w * columns + z + wide]);
            }
            for group in 0..groups {
                let tile = tile_product(&scaled[group * depth..(group + 1) * depth], &panel);
                for r in 0..TILE_ROWS.min(rows - group * TILE_ROWS) {
                    let y = group * TILE_ROWS + r;
                    add_tile_row(&mut c[y * columns + z..(y + 1) * columns], &tile[r]);
                }
            }
        }
    }

    /// `A += sum_k a_k x_k x_k'`, tile by tile, so that the matrix passes through memory once.
    pub(super) fn add_rank_ones<'a>(matrix: &'a mut [f64], changes: &'a [(f64, Vec<f64>)], n: usize) {
        let depth = changes.len();
        if depth == 0 {
            return;
        }
        let mut panels = vec![[0.0_f64; TILE]; n.div_ceil(TILE) * depth];
        for c in 0..depth {
            let x = &changes[c].1;
            for z in (0..n).step_by(TILE) {
                let wide = TILE.min(n - z);
                panels[z / TILE * depth + c][..wide].copy_from_slice(&x[z..z + wide]);
            }
        }
        let mut scaled = vec![[0.0_f64; TILE_ROWS]; depth];
        for y in (0..n).step_by(TILE_ROWS) {
            let high = TILE_ROWS.min(n - y);
            for c in 0..depth {
                let (a, x) = (changes[c].0, &changes[c].1);
                for r in 0..high {
                    scaled[c][r] = a * x[y + r];
                }
            }
            for z in (0..n).step_by(TILE) {
                let tile = tile_product(&scaled, &panels[z / TILE * depth..(z / TILE + 1) * depth]);
                for r in 0..high {
                    add_tile_row(&mut matrix[(y + r) * n + z..(y + r + 1) * n], &tile[r]);
                }
            }
        }
    }

    /// `y = L x`, `L` packed by rows (in the following functions too).
    pub(super) fn lower_multiply<'a>(packed: &'a [f64], x: &'a [f64], y: &'a mut [f64]) {
        let mut start = 0;
        for i in 0..x.len() {
            y[i] = dot_inline(&packed[start..=start + i], &x[..=i]);
            start += i + 1;
        }
    }

    /// `y += L' x`.
    pub(super) fn upper_multiply<'a>(packed: &'a [f64], x: &'a [f64], y: &'a mut [f64]) {
        let mut start = 0;
        for i in 0..x.len() {
            add_scaled_inline(&mut y[..=i], x[i], &packed[start..=start + i]);
            start += i + 1;
        }
    }

    /// Solves `L x = b` in place.
    pub(super) fn forward<'a>(packed: &'a [f64], x: &'a mut [f64]) {
        let mut start = 0;
        for i in 0..x.len() {
            let row = &packed[start..=start + i];
            x[i] = (x[i] - dot_inline(&row[..i], &x[..i])) / row[i];
            start += i + 1;
        }
    }

    /// Solves `L' x = b` in place.
    pub(super) fn backward<'a>(packed: &'a [f64], x: &'a mut [f64]) {
        for i in (0..x.len()).rev() {
            let start = i * (i + 1) / 2;
            let row = &packed[start..=start + i];
            let xi = x[i] / row[i];
            x[i] = xi;
            add_scaled_inline(&mut x[..i], -xi, &row[..i]);
        }
    }

    /// Solves `L X = B` in place.
    pub(super) fn forward_block<'a>(packed: &'a [f64], x: &'a mut [[f64; LANES]]) {
        let mut start = 0;
        for i in 0..x.len() {
            let row = &packed[start..=start + i];
            let (done, current) = x.split_at_mut(i);
            let mut sums = current[0];
            for j in 0..i {
                let l = -row[j];
                let d = &done[j];
                for k in 0..LANES {
                    sums[k] = l.mul_add(d[k], sums[k]);
                }
            }
            for k in 0..LANES {
                current[0][k] = sums[k] / row[i];
            }
            start += i + 1;
        }
    }

    /// Solves `L' X = B` in place.
    pub(super) fn backward_block<'a>(packed: &'a [f64], x: &'a mut [[f64; LANES]]) {
        for i in (0..x.len()).rev() {
            let start = i * (i + 1) / 2;
            let row = &packed[start..=start + i];
            let (done, current) = x.split_at_mut(i);
            for k in 0..LANES {
                current[0][k] /= row[i];
            }
            let xi = current[0];
            for j in 0..i {
                let l = -row[j];
                let d = &mut done[j];
                for k in 0..LANES {
                    d[k] = l.mul_add(xi[k], d[k]);
                }
            }
        }
    }

    /// Inner product of each pair of vectors of two blocks.
    pub(crate) fn block_dots<'a>(a: &'a [[f64; LANES]], b: &'a [[f64; LANES]]) -> [f64; LANES] {
        let mut sums = [0.0_f64; LANES];
        for i in 0..a.len().min(b.len()) {
            for k in 0..LANES {
                sums[k] = a[i][k].mul_add(b[i][k], sums[k]);
            }
        }
        sums
    }

    /// `Y = A X`.
    pub(super) fn multiply_block<'a>(rows: &'a [f64], x: &'a [[f64; LANES]], y: &'a mut [[f64; LANES]]) {
        let n = x.len();
        for i in 0..y.len() {
            let row = &rows[i * n..(i + 1) * n];
            let mut sums = [0.0_f64; LANES];
            for j in 0..n {
                for k in 0..LANES {
                    sums[k] = row[j].mul_add(x[j][k], sums[k]);
                }
            }
            y[i] = sums;
        }
    }

    /// Turns a row of a matrix into the next row of its packed Cholesky factor. Returns the squared pivot.
    pub(super) fn append_row<'a>(packed: &'a [f64], row: &'a mut [f64]) -> f64 {
        let n = row.len() - 1;
        let mut start = 0;
        for i in 0..n {
            let l = &packed[start..=start + i];
            row[i] = (row[i] - dot_inline(&l[..i], &row[..i])) / l[i];
            start += i + 1;
        }
        row[n] - dot_inline(&row[..n], &row[..n])
    }

    /// Lower triangle of `B += L' P`: `B_ij += sum_k L_ki P_kj`, `j <= i <= k`; `P` and `B` stored by rows.
    pub(super) fn add_lower_product<'a>(packed: &'a [f64], p: &'a [f64], b: &'a mut [f64], n: usize) {
        let mut start = 0;
        for k in 0..n {
            let l = &packed[start..=start + k];
            let source = &p[k * n..k * n + n];
            for i in 0..=k {
                add_scaled_inline(&mut b[i * n..=i * n + i], l[i], &source[..=i]);
            }
            start += k + 1;
        }
    }

    /// `A = R R'`, both stored by rows.
    pub(super) fn outer_product<'a>(r: &'a [f64], a: &'a mut [f64], n: usize) {
        for i in 0..n {
            for j in 0..=i {
                let value = dot_inline(&r[i * n..(i + 1) * n], &r[j * n..(j + 1) * n]);
                a[i * n + j] = value;
                a[j * n + i] = value;
            }
        }
    }
}
