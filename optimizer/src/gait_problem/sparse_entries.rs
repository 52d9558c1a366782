//! Sparse derivatives: the same traversal first records the sparsity structure and later writes the values.

use interior_point::SparsityPattern;

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
        let (pattern, positions) = SparsityPattern::from_entries(rows, columns, entries);
        let slots = positions.into_iter().map(|position| u32::try_from(position).unwrap_or(u32::MAX)).collect();
        Self { pattern, slots }
    }
}
