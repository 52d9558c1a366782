//! The interface of a factorisation of the KKT matrix.

/// Numbers of positive, negative and (numerically) zero eigenvalues.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct Inertia {
    pub positive: usize,
    pub negative: usize,
    pub zero: usize,
}

impl Inertia {
    /// Counts a pivot of order one.
    pub(crate) fn count(&mut self, d: f64) {
        if d > 0.0 {
            self.positive += 1;
        } else if d < 0.0 {
            self.negative += 1;
        } else {
            self.zero += 1;
        }
    }

    /// Counts a symmetric pivot [a e; e b] of order two.
    pub(crate) fn count_pair(&mut self, a: f64, e: f64, b: f64) {
        // Divided by e^2 so that the product of two tiny diagonals cannot underflow.
        let determinant = (a / e) * (b / e) - 1.0;
        if determinant < 0.0 {
            self.positive += 1;
            self.negative += 1;
        } else if determinant == 0.0 {
            self.zero += 1;
            self.count(a + b);
        } else if a > 0.0 {
            self.positive += 2;
        } else {
            self.negative += 2;
        }
    }
}

/// Difference between a matrix and the one factorised before it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum MatrixChange {
    Any,
    /// Only on the diagonal: another regularisation.
    Diagonal,
}

/// A symmetric indefinite factorisation, analysed once for a fixed pattern. The caller checks the residual of a
/// solution.
pub(crate) trait KktSolver: Send {
    /// Whether the method is applicable to a matrix with these values.
    fn suits(&self, _values: &[f64]) -> bool {
        true
    }
    /// Factorises the matrix with these values, in the order of the analysed pattern; `None` on breakdown. Parts of the
    /// previous factorisation may be reused as far as `change` allows; this does not affect the result.
    fn factor(&mut self, values: &[f64], change: MatrixChange) -> Option<Inertia>;
    /// Overwrites `rhs` with the solution of the last factorised system.
    fn solve(&mut self, rhs: &mut [f64]);
    /// Marks the indices of rows whose diagonal the last factorisation neglected.
    fn mark_neglected(&self, _neglected: &mut [bool]) {}
    /// Stored entries of the factor.
    fn factor_entries(&self) -> usize;
    /// Reports that the last factorisation was inaccurate. True if the next factorisation of the same matrix uses
    /// another method.
    fn reject_factorisation(&mut self) -> bool {
        false
    }
    /// Number of changes to another method.
    fn fallbacks(&self) -> usize {
        0
    }
}
