//! A factorisation that is analysed when it is first needed: fallbacks mostly are not.

use super::kkt_solver::{Change, Inertia, KktSolver};
use crate::nlp::status::NlpError;

type Analysis = Box<dyn FnOnce() -> Result<Box<dyn KktSolver>, NlpError> + Send>;

/// Not analysed yet; ready; or a failed analysis, after which every matrix breaks down.
pub(super) enum LazySolver {
    Waiting(Analysis),
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
    /// Before the analysis nobody knows; [`factor`](KktSolver::factor) breaks down then where it is not.
    fn suits(&self, values: &[f64]) -> bool {
        self.ready().is_none_or(|solver| solver.suits(values))
    }

    fn factor(&mut self, values: &[f64], change: Change) -> Option<Inertia> {
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

    /// Takes positive values only.
    struct Positive;

    impl KktSolver for Positive {
        fn suits(&self, values: &[f64]) -> bool {
            values.iter().all(|v| *v > 0.0)
        }

        fn factor(&mut self, values: &[f64], _change: Change) -> Option<Inertia> {
            Some(Inertia { positive: values.len(), ..Inertia::default() })
        }

        fn solve(&mut self, _rhs: &mut [f64]) {}

        fn factor_entries(&self) -> usize {
            1
        }
    }

    #[test]
    fn nlp_what_a_method_is_not_meant_for_it_does_not_get_before_and_after_its_analysis() {
        let mut solver = LazySolver::new(|| Ok(Box::new(Positive)));
        assert_eq!(solver.factor_entries(), 0, "not analysed");
        assert_eq!(solver.factor(&[-1.0], Change::Any), None);
        assert!(!solver.suits(&[-1.0]) && solver.suits(&[1.0]));
        assert_eq!(solver.factor(&[1.0, 2.0], Change::Any).unwrap().positive, 2);
        assert_eq!((solver.factor(&[-1.0], Change::Any), solver.factor_entries()), (None, 1));
    }
}
