//! What the interior point asks of a factorisation of its KKT matrix.

/// Numbers of positive, negative and (numerically) zero eigenvalues.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(in crate::nlp) struct Inertia {
    pub positive: usize,
    pub negative: usize,
    pub zero: usize,
}

impl Inertia {
    /// Counts a pivot of order one.
    pub(in crate::nlp) fn count(&mut self, d: f64) {
        if d > 0.0 {
            self.positive += 1;
        } else if d < 0.0 {
            self.negative += 1;
        } else {
            self.zero += 1;
        }
    }

    /// Counts a symmetric pivot [a e; e b] of order two.
    pub(in crate::nlp) fn count_pair(&mut self, a: f64, e: f64, b: f64) {
        // Divided by e^2: the product of two tiny diagonals must not underflow.
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

/// How a matrix differs from the one factorised before it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::nlp) enum Change {
    Any,
    /// On the diagonal only: another regularisation.
    Diagonal,
}

/// A symmetric indefinite factorisation, analysed once for a fixed pattern. The residual of a solution is the
/// caller's business.
pub(in crate::nlp) trait KktSolver: Send {
    /// Whether the method is meant for a matrix with these values.
    fn suits(&self, _values: &[f64]) -> bool {
        true
    }
    /// Factorises the matrix with these values (order of the analysed pattern); `None` when it broke down.
    /// What `change` allows may be kept of the last one; the result is the same.
    fn factor(&mut self, values: &[f64], change: Change) -> Option<Inertia>;
    /// Overwrites `rhs` by the solution with the last factorisation.
    fn solve(&mut self, rhs: &mut [f64]);
    /// Marks the rows (indices of the matrix) whose diagonal the last factorisation took for zero.
    fn mark_neglected(&self, _neglected: &mut [bool]) {}
    /// Stored entries of the factor.
    fn factor_entries(&self) -> usize;
    /// The last solution's residual was bad. True when the same matrix, factorised again, will be treated by another
    /// method.
    fn distrust(&mut self) -> bool {
        false
    }
    /// Times another method was used.
    fn fallbacks(&self) -> usize {
        0
    }
}
