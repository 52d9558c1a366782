//! The inner loops, compiled for the vector units found at run time.
//!
//! Sums run in [`LANES`] interleaved partial sums and every product is fused into its addition, whatever the width of
//! the vectors: equal inputs give equal bits on any machine.

#![allow(clippy::inline_always, reason = "a kernel must be inlined into the function compiled for the vector unit")]

use pulp::{Arch, Simd, WithSimd};

/// Number of interleaved partial sums of an inner product, and of right-hand sides of a block.
pub(super) const LANES: usize = 16;

/// Defines a function whose body is compiled once for every vector unit. Bodies use plain loops: a closure would be
/// compiled apart, for the least of them.
macro_rules! kernels {
    ($($(#[$doc:meta])* $visibility:vis fn $name:ident<'a>($($argument:ident: $type:ty),*) $(-> $result:ty)? $body:block)*) => {
        $($(#[$doc])*
        $visibility fn $name<'a>($($argument: $type),*) $(-> $result)? {
            #[allow(non_camel_case_types)]
            struct Body<'a> { $($argument: $type,)* }
            impl<'a> WithSimd for Body<'a> {
                type Output = kernels!(@output $($result)?);
                #[inline(always)]
                fn with_simd<S: Simd>(self, _: S) -> Self::Output {
                    let Self { $($argument),* } = self;
                    $body
                }
            }
            Arch::new().dispatch(Body { $($argument),* })
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

kernels! {
    /// Inner product.
    pub(crate) fn dot<'a>(a: &'a [f64], b: &'a [f64]) -> f64 {
        dot_inline(a, b)
    }

    /// `y += a x`.
    pub(crate) fn add_scaled<'a>(y: &'a mut [f64], a: f64, x: &'a [f64]) {
        add_scaled_inline(y, a, x);
    }

    /// `y = A x`, `A` given by rows of the length of `x`.
    pub(crate) fn multiply<'a>(rows: &'a [f64], x: &'a [f64], y: &'a mut [f64]) {
        let n = x.len();
        for i in 0..y.len() {
            y[i] = dot_inline(&rows[i * n..(i + 1) * n], x);
        }
    }

    /// `y = A a` and `z = A b`.
    pub(crate) fn multiply_two<'a>(
        rows: &'a [f64], a: &'a [f64], b: &'a [f64], y: &'a mut [f64], z: &'a mut [f64]
    ) {
        let n = a.len();
        for i in 0..y.len() {
            let row = &rows[i * n..(i + 1) * n];
            y[i] = dot_inline(row, a);
            z[i] = dot_inline(row, b);
        }
    }

    /// `A += sum_k a_k x_k x_k'`, row by row, so that each row is read once.
    pub(super) fn add_rank_ones<'a>(rows: &'a mut [f64], changes: &'a [(f64, Vec<f64>)], n: usize) {
        for i in 0..n {
            let row = &mut rows[i * n..(i + 1) * n];
            for c in 0..changes.len() {
                let x = &changes[c].1;
                add_scaled_inline(row, changes[c].0 * x[i], x);
            }
        }
    }

    /// `y = L x`, `L` packed by rows.
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

    /// Inner products, vector by vector, of two blocks.
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

    /// Appends to a packed factor the row of a matrix given by its first entries; the squared pivot.
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

    /// `B += L' P` on and below the diagonal: `B_ij += sum_k L_ki P_kj`, `j <= i <= k`, `P` and `B` by rows.
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

    /// `A = R R'` for a matrix given by rows.
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
