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
    fn factor(&mut self, values: &[f64], change: Change) -> Option<Inertia> {
        if let Self::Waiting(_) = self
            && let Self::Waiting(analysis) = std::mem::replace(self, Self::Failed)
            && let Ok(solver) = analysis()
        {
            *self = Self::Ready(solver);
        }
        if let Self::Ready(solver) = self { solver.factor(values, change) } else { None }
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
