//! Choice of the factorisation, and the way back from a failed one.

use super::formulation::Formulation;
use super::kkt::KktMatrix;
use super::kkt_solver::{Inertia, KktSolver};
use super::multifrontal::Multifrontal;
use super::ordering;
use super::settings::{LinearSolver, NlpSettings};
use super::status::NlpError;
use super::supernodal::Supernodal;

/// Multifrontal only while it costs at most this many times the operations of the supernodal factorisation.
const WORTHWHILE: f64 = 4.0;

/// Up to this order the matrix is one dense front whatever the setting: pivoting over all of it costs nothing.
/// (A diagonal matrix, which has no supernodes, is factorised in fronts of one index.)
const DENSE_ORDER: usize = 120;

/// Chooses by setting and structure: the multifrontal factorisation needs elimination blocks.
pub(super) fn choose(
    form: &Formulation,
    matrix: &KktMatrix,
    settings: &NlpSettings,
) -> Result<Box<dyn KktSolver>, NlpError> {
    let blocks = form.program.elimination_blocks();
    let supernodal = |order| Supernodal::new(&matrix.column_starts, &matrix.row_indices, order);
    let diagonal = matrix.row_indices.len() == matrix.order;
    if diagonal || matrix.order <= DENSE_ORDER {
        let front_of = if diagonal { (0..matrix.order).collect() } else { vec![0; matrix.order] };
        return Ok(Box::new(Multifrontal::new(&matrix.column_starts, &matrix.row_indices, &front_of, 1)?));
    }
    let front_of = match (settings.linear_solver, blocks) {
        (LinearSolver::Auto | LinearSolver::Supernodal, None) => return Ok(Box::new(supernodal(None)?)),
        (LinearSolver::Supernodal, Some(blocks)) => {
            return Ok(Box::new(supernodal(Some(ordering::block_order(form, blocks)))?));
        }
        (LinearSolver::Multifrontal, None) => vec![0; matrix.order],
        (LinearSolver::Auto | LinearSolver::Multifrontal, Some(blocks)) => ordering::block_of_index(blocks),
    };
    let frontal = Multifrontal::new(&matrix.column_starts, &matrix.row_indices, &front_of, settings.threads)?;
    let order = blocks.map(|blocks| ordering::block_order(form, blocks));
    if settings.linear_solver == LinearSolver::Auto {
        let other = supernodal(order)?;
        return if frontal.flops() <= WORTHWHILE * other.flops() {
            Ok(Box::new(WithFallback { first: frontal, second: other, distrusted: false, in_use: false, fallbacks: 0 }))
        } else {
            Ok(Box::new(other))
        };
    }
    Ok(Box::new(frontal))
}

/// The multifrontal factorisation; the supernodal one for a matrix on which it breaks down or gives a bad residual.
struct WithFallback {
    first: Multifrontal,
    second: Supernodal,
    /// The next matrix goes to the second at once.
    distrusted: bool,
    /// The second holds the present factor.
    in_use: bool,
    fallbacks: usize,
}

impl KktSolver for WithFallback {
    fn factor(&mut self, values: &[f64]) -> Option<Inertia> {
        self.in_use = false;
        if !std::mem::take(&mut self.distrusted) {
            let inertia = self.first.factor(values);
            if inertia.is_some() {
                return inertia;
            }
        }
        self.in_use = true;
        self.fallbacks += 1;
        self.second.factor(values)
    }

    fn solve(&mut self, rhs: &mut [f64]) {
        if self.in_use { self.second.solve(rhs) } else { self.first.solve(rhs) }
    }

    fn factor_entries(&self) -> usize {
        if self.fallbacks > 0 {
            self.first.factor_entries().max(self.second.factor_entries())
        } else {
            self.first.factor_entries()
        }
    }

    fn distrust(&mut self) -> bool {
        self.distrusted = !self.in_use;
        self.distrusted
    }

    fn fallbacks(&self) -> usize {
        self.fallbacks
    }
}
