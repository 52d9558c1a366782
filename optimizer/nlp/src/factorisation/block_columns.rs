//! Packed columns of a matrix in which only some blocks of [`LANES`] rows are used. Substitution is bound by memory
//! bandwidth, so blocks that are always zero are not stored.

// Vector code gets the instructions of the machine only where it is inlined into the dispatched call.
#![allow(clippy::inline_always)]

use pulp::Simd;

use super::dense_kernels::{LANES, add_to_lanes, subtract, sum_of_lanes};

/// The used blocks of rows of each column.
#[derive(Debug, Default)]
pub(super) struct BlockColumns {
    /// Column stride of the matrix.
    stride: usize,
    /// Start of each column in `blocks`, and the end of the last one.
    starts: Vec<usize>,
    /// Blocks of rows, column by column.
    blocks: Vec<usize>,
}

impl BlockColumns {
    /// The blocks that contain the given offsets of a column-major matrix.
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

    /// Copies the used blocks out of the matrix.
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

    /// Copies the used blocks back into the matrix.
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

    /// y -= sum of f x_k over the terms (k, f), where x_k is column k.
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
