//! Lazy analysis: most fallbacks are never needed, so they are analysed on first use.

use super::kkt_solver::{Inertia, KktSolver, MatrixChange};
use crate::status::NlpError;

type DeferredAnalysis = Box<dyn FnOnce() -> Result<Box<dyn KktSolver>, NlpError> + Send>;

/// A factorisation that is not analysed yet, ready, or whose analysis failed; then every matrix breaks down.
pub(super) enum LazySolver {
    Waiting(DeferredAnalysis),
    Ready(Box<dyn KktSolver>),
    Failed,
}

impl LazySolver {
    pub(super) fn new(analysis: impl FnOnce() -> Result<Box<dyn KktSolver>, NlpError> + Send + 'static) -> Self {
        Self::Waiting(Box::new(analysis))
    }

    fn ready(&self) -> Option<&dyn KktSolver> {
        if let Self::Ready(solver) = self { Some(solver.as_ref()) } else { None }
    }
}

impl KktSolver for LazySolver {
    /// True before the analysis; [`factor`](KktSolver::factor) then breaks down on matrices that do not suit.
    fn suits(&self, values: &[f64]) -> bool {
        self.ready().is_none_or(|solver| solver.suits(values))
    }

    fn factor(&mut self, values: &[f64], change: MatrixChange) -> Option<Inertia> {
        if let Self::Waiting(_) = self
            && let Self::Waiting(analysis) = std::mem::replace(self, Self::Failed)
            && let Ok(solver) = analysis()
        {
            *self = Self::Ready(solver);
        }
        let Self::Ready(solver) = self else { return None };
        if solver.suits(values) { solver.factor(values, change) } else { None }
    }

    fn solve(&mut self, rhs: &mut [f64]) {
        if let Self::Ready(solver) = self {
            solver.solve(rhs);
        }
    }

    fn mark_neglected(&self, neglected: &mut [bool]) {
        if let Some(solver) = self.ready() {
            solver.mark_neglected(neglected);
        }
    }

    fn factor_entries(&self) -> usize {
        self.ready().map_or(0, KktSolver::factor_entries)
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    /// Suits positive values only.
    struct Positive;

    impl KktSolver for Positive {
        fn suits(&self, values: &[f64]) -> bool {
            values.iter().all(|v| *v > 0.0)
        }

        fn factor(&mut self, values: &[f64], _change: MatrixChange) -> Option<Inertia> {
            Some(Inertia { positive: values.len(), ..Inertia::default() })
        }

        fn solve(&mut self, _rhs: &mut [f64]) {}

        fn factor_entries(&self) -> usize {
            1
        }
    }

    #[test]
    fn unsuitable_matrix_breaks_down_before_and_after_analysis() {
        let mut solver = LazySolver::new(|| Ok(Box::new(Positive)));
        assert_eq!(solver.factor_entries(), 0, "not analysed");
        assert_eq!(solver.factor(&[-1.0], MatrixChange::Any), None);
        assert!(!solver.suits(&[-1.0]) && solver.suits(&[1.0]));
        assert_eq!(solver.factor(&[1.0, 2.0], MatrixChange::Any).unwrap().positive, 2);
        assert_eq!((solver.factor(&[-1.0], MatrixChange::Any), solver.factor_entries()), (None, 1));
    }
}
