//! Sparse derivatives: the same traversal first records the sparsity structure and later writes the values.

use crate::nlp::SparsityPattern;

/// Receives entries (row, column, value) of a sparse matrix in a fixed order of calls.
pub struct Entries<'a> {
    scale: &'a [f64],
    sink: Sink<'a>,
}

enum Sink<'a> {
    Structure(&'a mut Vec<(usize, usize)>),
    Values { slots: &'a [u32], values: &'a mut [f64], cursor: usize },
}

impl<'a> Entries<'a> {
    /// Records the positions of entries.
    pub fn structure(scale: &'a [f64], entries: &'a mut Vec<(usize, usize)>) -> Self {
        Self { scale, sink: Sink::Structure(entries) }
    }

    /// Adds to `values`, which starts at zero.
    pub fn values(scale: &'a [f64], slots: &'a [u32], values: &'a mut [f64]) -> Self {
        values.fill(0.0);
        Self { scale, sink: Sink::Values { slots, values, cursor: 0 } }
    }

    /// d(row)/d(variable) in physical units of the variable.
    #[inline]
    pub fn jacobian(&mut self, row: usize, variable: usize, derivative: f64) {
        self.put(row, variable, derivative * self.scale[variable]);
    }

    /// Second derivative with respect to two variables in physical units. Each pair of different variables is written
    /// once, in either order.
    #[inline]
    pub fn hessian(&mut self, a: usize, b: usize, derivative: f64) {
        let value = derivative * self.scale[a] * self.scale[b];
        if a >= b { self.put(a, b, value) } else { self.put(b, a, value) }
    }

    #[inline]
    fn put(&mut self, row: usize, column: usize, value: f64) {
        match &mut self.sink {
            Sink::Structure(entries) => entries.push((row, column)),
            Sink::Values { slots, values, cursor } => {
                values[slots[*cursor] as usize] += value;
                *cursor += 1;
            }
        }
    }
}

/// A compressed structure and, for each entry in traversal order, the slot that it adds to.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Compressed {
    /// Compressed structure.
    pub pattern: SparsityPattern,
    /// Slot of each entry of the traversal.
    pub slots: Vec<u32>,
}

impl Compressed {
    /// Compresses recorded entries to columns with increasing unique rows.
    pub fn new(rows: usize, columns: usize, entries: &[(usize, usize)]) -> Self {
        let mut order: Vec<u32> = (0..u32::try_from(entries.len()).unwrap_or(u32::MAX)).collect();
        order.sort_unstable_by_key(|&e| {
            let (row, column) = entries[e as usize];
            (column, row)
        });
        let mut pattern = SparsityPattern {
            rows,
            columns,
            column_starts: Vec::with_capacity(columns + 1),
            row_indices: Vec::with_capacity(entries.len()),
        };
        let mut slots = vec![0; entries.len()];
        let mut last = None;
        for &e in &order {
            let (row, column) = entries[e as usize];
            if last != Some((row, column)) {
                while pattern.column_starts.len() <= column {
                    pattern.column_starts.push(pattern.row_indices.len());
                }
                pattern.row_indices.push(row);
                last = Some((row, column));
            }
            slots[e as usize] = u32::try_from(pattern.row_indices.len() - 1).unwrap_or(u32::MAX);
        }
        while pattern.column_starts.len() <= columns {
            pattern.column_starts.push(pattern.row_indices.len());
        }
        Self { pattern, slots }
    }
}
