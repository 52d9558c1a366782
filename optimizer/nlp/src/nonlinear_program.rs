//! The interface of a problem: minimise f(x) subject to bounds on x and on g(x).

/// Structure of a sparse matrix in compressed-column form, row indices ascending and unique within a column.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct SparsityPattern {
    /// Number of rows.
    pub rows: usize,
    /// Number of columns.
    pub columns: usize,
    /// `columns + 1` offsets into `row_indices`.
    pub column_starts: Vec<usize>,
    /// Row of each stored entry.
    pub row_indices: Vec<usize>,
}

impl SparsityPattern {
    /// The pattern of the (row, column) entries of a matrix, given in any order, and for each of them its position in
    /// the stored values. Entries that are given several times share a position.
    ///
    /// A column beyond `columns` gives a pattern that [`solve`](crate::solve()) refuses.
    pub fn from_entries(rows: usize, columns: usize, entries: &[(usize, usize)]) -> (Self, Vec<usize>) {
        let mut order: Vec<usize> = (0..entries.len()).collect();
        order.sort_unstable_by_key(|&e| (entries[e].1, entries[e].0));
        let mut pattern =
            Self { rows, columns, column_starts: Vec::with_capacity(columns + 1), row_indices: Vec::new() };
        let mut positions = vec![0; entries.len()];
        let mut last = None;
        for e in order {
            let (row, column) = entries[e];
            if last != Some((row, column)) {
                while pattern.column_starts.len() <= column {
                    pattern.column_starts.push(pattern.row_indices.len());
                }
                pattern.row_indices.push(row);
                last = Some((row, column));
            }
            positions[e] = pattern.row_indices.len() - 1;
        }
        while pattern.column_starts.len() <= columns {
            pattern.column_starts.push(pattern.row_indices.len());
        }
        (pattern, positions)
    }
}

/// Block structure of a problem, for the elimination order of its KKT matrix.
///
/// Blocks form a forest: an entry of the KKT matrix may only couple a block with itself, an ancestor or a
/// descendant. Children are eliminated before their parents, independently of each other.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct EliminationBlocks {
    /// Parent of each block; `None` for a root. A parent's number is larger than its children's.
    pub parent: Vec<Option<usize>>,
    /// Block of each variable.
    pub block_of_variable: Vec<usize>,
    /// Block of each constraint row.
    pub block_of_row: Vec<usize>,
}

/// minimise f(x) subject to x_L <= x <= x_U and g_L <= g(x) <= g_U (equal bounds: an equality).
///
/// Functions are twice continuously differentiable in the interior of the variable bounds. Infinite bounds are
/// `f64::INFINITY` and `f64::NEG_INFINITY`. A trial point where an evaluation gives NaN or infinity is rejected.
pub trait NonlinearProgram: Sync {
    /// Number of variables n.
    fn variables(&self) -> usize;
    /// Number of rows m of g.
    fn rows(&self) -> usize;
    /// Writes x_L and x_U (length n each).
    fn variable_bounds(&self, lower: &mut [f64], upper: &mut [f64]);
    /// Writes g_L and g_U (length m each).
    fn row_bounds(&self, lower: &mut [f64], upper: &mut [f64]);
    /// Structure of the Jacobian of g (m x n).
    fn jacobian_pattern(&self) -> &SparsityPattern;
    /// Structure of the lower triangle of the Hessian of the Lagrangian (n x n).
    fn hessian_pattern(&self) -> &SparsityPattern;
    /// f(x).
    fn objective(&self, x: &[f64]) -> f64;
    /// Gradient of f (length n, overwritten).
    fn gradient(&self, x: &[f64], gradient: &mut [f64]);
    /// g(x) (length m, overwritten).
    fn constraints(&self, x: &[f64], values: &mut [f64]);
    /// Values of the Jacobian in the order of its pattern (overwritten).
    fn jacobian(&self, x: &[f64], values: &mut [f64]);
    /// Values of sigma * Hess f + sum_i multiplier_i * Hess g_i in the order of its pattern (overwritten).
    fn hessian(&self, x: &[f64], sigma: f64, multipliers: &[f64], values: &mut [f64]);
    /// Block structure, if known.
    fn elimination_blocks(&self) -> Option<&EliminationBlocks> {
        None
    }
}
