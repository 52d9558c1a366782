//! Columns of a matrix of which only some blocks of [`LANES`] rows are in use, packed: what solves read of a front comes
//! from memory, so they read nothing that is always zero.

// Vector code is compiled for a machine's instructions only where it is inlined into the dispatched call.
#![allow(clippy::inline_always)]

use pulp::Simd;

use super::dense_kernels::{LANES, add_to_lanes, subtract, sum_of_lanes};

/// Which blocks of rows of which columns are in use.
#[derive(Debug, Default)]
pub(super) struct BlockColumns {
    /// Column stride of the matrix.
    stride: usize,
    /// Where the blocks of each column begin in `blocks`; one more at the end.
    starts: Vec<usize>,
    /// Blocks of rows, column by column.
    blocks: Vec<usize>,
}

impl BlockColumns {
    /// Blocks that hold the given offsets of a matrix with that many columns.
    pub(super) fn new(columns: usize, stride: usize, offsets: impl Iterator<Item = usize>) -> Self {
        let per_column = stride / LANES;
        let mut used = vec![false; columns * per_column];
        for offset in offsets {
            used[offset / LANES] = true;
        }
        let mut result = Self { stride, starts: vec![0], blocks: Vec::new() };
        for column in 0..columns {
            let own = &used[column * per_column..(column + 1) * per_column];
            result.blocks.extend((0..per_column).filter(|&block| own[block]));
            result.starts.push(result.blocks.len());
        }
        result
    }

    /// Length of the packed columns.
    pub(super) fn length(&self) -> usize {
        self.blocks.len() * LANES
    }

    /// Copies the blocks of the matrix.
    #[inline(always)]
    pub(super) fn pack(&self, matrix: &[f64], packed: &mut [f64]) {
        let mut targets = packed.as_chunks_mut::<LANES>().0.iter_mut();
        for (column, range) in matrix.chunks_exact(self.stride.max(1)).zip(self.starts.windows(2)) {
            let sources = column.as_chunks::<LANES>().0;
            for (&block, target) in self.blocks[range[0]..range[1]].iter().zip(&mut targets) {
                *target = sources[block];
            }
        }
    }

    /// Copies them back.
    #[inline(always)]
    pub(super) fn unpack(&self, packed: &[f64], matrix: &mut [f64]) {
        let mut sources = packed.as_chunks::<LANES>().0.iter();
        for (column, range) in matrix.chunks_exact_mut(self.stride.max(1)).zip(self.starts.windows(2)) {
            let targets = column.as_chunks_mut::<LANES>().0;
            for (&block, source) in self.blocks[range[0]..range[1]].iter().zip(&mut sources) {
                targets[block] = *source;
            }
        }
    }

    /// y -= sum of f x_k over the terms (k, f), x_k being columns.
    #[inline(always)]
    pub(super) fn subtract<S: Simd>(&self, simd: S, y: &mut [f64], packed: &[f64], terms: &[(usize, f64)]) {
        for &(column, factor) in terms {
            for k in self.starts[column]..self.starts[column + 1] {
                let own = &mut y[self.blocks[k] * LANES..][..LANES];
                subtract(simd, own, &packed[k * LANES..][..LANES], factor);
            }
        }
    }

    /// Dot product of a column with x.
    #[inline(always)]
    pub(super) fn dot(&self, packed: &[f64], column: usize, x: &[f64]) -> f64 {
        let mut sums = [0.0; LANES];
        for k in self.starts[column]..self.starts[column + 1] {
            add_to_lanes(&mut sums, &packed[k * LANES..][..LANES], &x[self.blocks[k] * LANES..][..LANES]);
        }
        sum_of_lanes(&sums)
    }
}
