//! Choice of the factorisation, and its fallbacks.

use std::sync::Arc;

use super::delayed_pivots::DelayedPivots;
use super::front::{PivotKind, RoomForDeferred};
use super::kkt_matrix::KktMatrix;
use super::kkt_solver::{Inertia, KktSolver, MatrixChange};
use super::lazy_solver::LazySolver;
use super::multifrontal::Multifrontal;
use super::ordering;
#[cfg(feature = "supernodal")]
use super::supernodal::Supernodal;
use crate::formulation::{Formulation, RowForm};
use crate::settings::{LinearSolver, NlpSettings};
use crate::status::NlpError;

/// The multifrontal factorisation may take this many times the operations of the supernodal one.
#[cfg(feature = "supernodal")]
const WORTHWHILE: f64 = 4.0;

/// Up to this order the matrix is one dense front whatever the setting, because pivoting over all of it is cheap. (A
/// diagonal matrix has no supernodes and is factorised in fronts of one index.)
const DENSE_ORDER: usize = 120;

/// Chooses the factorisation by setting and structure.
pub(crate) fn choose(
    form: &Formulation,
    matrix: &KktMatrix,
    settings: &NlpSettings,
) -> Result<Box<dyn KktSolver>, NlpError> {
    let multifrontal = |front_of: &[usize], kinds: &[PivotKind], threads| {
        let room = RoomForDeferred::Padding;
        Multifrontal::new(&matrix.column_starts, &matrix.row_indices, front_of, kinds, room, threads)
    };
    let alike = vec![PivotKind::Other; matrix.order];
    let diagonal = matrix.row_indices.len() == matrix.order;
    if diagonal || matrix.order <= DENSE_ORDER {
        let front_of = if diagonal { (0..matrix.order).collect() } else { vec![0; matrix.order] };
        return Ok(Box::new(multifrontal(&front_of, &alike, 1)?));
    }
    let Some(blocks) = form.program.elimination_blocks() else {
        if settings.linear_solver == LinearSolver::Multifrontal {
            return Ok(Box::new(multifrontal(&vec![0; matrix.order], &alike, settings.threads)?));
        }
        return without_blocks(matrix, settings);
    };
    let front_of = ordering::block_of_index_raised(form, blocks);
    let trusted = delayed(matrix, front_of.clone());
    if settings.linear_solver == LinearSolver::DelayedPivots {
        return Ok(trusted);
    }
    #[cfg(feature = "supernodal")]
    let other = Supernodal::new(&matrix.column_starts, &matrix.row_indices, Some(ordering::block_order(form, blocks)))?;
    if settings.linear_solver == LinearSolver::Supernodal {
        #[cfg(feature = "supernodal")]
        return Ok(Box::new(other));
        #[cfg(not(feature = "supernodal"))]
        return Err(not_built(matrix.order));
    }
    let variables = std::iter::repeat_n(PivotKind::Variable, form.n);
    let rows = form.rows.iter().map(|row| match row {
        RowForm::Equality(_) => PivotKind::Equality,
        RowForm::Inequality(_) | RowForm::Free => PivotKind::Other,
    });
    let kinds: Vec<PivotKind> = variables.chain(rows).collect();
    let first_kinds = if settings.constants.two_stage_fronts { &kinds } else { &alike };
    let two_stages = multifrontal(&front_of, first_kinds, settings.threads)?;
    #[cfg(feature = "supernodal")]
    if settings.linear_solver == LinearSolver::Auto && two_stages.flops() > WORTHWHILE * other.flops() {
        return Ok(with_trusted(settings, other, trusted));
    }
    let pattern = Arc::new((matrix.column_starts.clone(), matrix.row_indices.clone(), front_of));
    let lazily = |kinds: Vec<PivotKind>| -> Box<dyn KktSolver> {
        let (pattern, threads, room) = (pattern.clone(), settings.threads, RoomForDeferred::Full);
        Box::new(LazySolver::new(move || {
            let (starts, indices, front_of) = &*pattern;
            Ok(Box::new(Multifrontal::new(starts, indices, front_of, &kinds, room, threads)?))
        }))
    };
    let mut methods: Vec<Box<dyn KktSolver>> = vec![Box::new(two_stages)];
    if settings.constants.roomy_fronts {
        methods.extend([lazily(kinds), lazily(alike)]);
    }
    if settings.linear_solver == LinearSolver::Auto {
        methods.push(trusted);
    }
    Ok(Box::new(Ladder::new(methods, settings.constants.doubts)))
}

fn delayed(matrix: &KktMatrix, front_of: Vec<usize>) -> Box<dyn KktSolver> {
    let (starts, indices) = (matrix.column_starts.clone(), matrix.row_indices.clone());
    Box::new(LazySolver::new(move || Ok(Box::new(DelayedPivots::new(&starts, &indices, &front_of)))))
}

/// Without elimination blocks: the supernodal factorisation in minimum-degree order.
#[cfg(feature = "supernodal")]
fn without_blocks(matrix: &KktMatrix, settings: &NlpSettings) -> Result<Box<dyn KktSolver>, NlpError> {
    let minimum_degree = Supernodal::new(&matrix.column_starts, &matrix.row_indices, None)?;
    let front_of = minimum_degree.supernode_of_index();
    Ok(with_trusted(settings, minimum_degree, delayed(matrix, front_of)))
}

#[cfg(not(feature = "supernodal"))]
fn without_blocks(matrix: &KktMatrix, _: &NlpSettings) -> Result<Box<dyn KktSolver>, NlpError> {
    Err(not_built(matrix.order))
}

#[cfg(not(feature = "supernodal"))]
fn not_built(order: usize) -> NlpError {
    NlpError::Analysis { order, reason: "this build of interior-point lacks the feature `supernodal`".to_owned() }
}

/// By setting: the supernodal factorisation, the trusted one, or (auto) the supernodal one with the trusted one as
/// fallback.
#[cfg(feature = "supernodal")]
fn with_trusted(settings: &NlpSettings, supernodal: Supernodal, trusted: Box<dyn KktSolver>) -> Box<dyn KktSolver> {
    match settings.linear_solver {
        LinearSolver::Supernodal => Box::new(supernodal),
        LinearSolver::DelayedPivots => trusted,
        LinearSolver::Auto | LinearSolver::Multifrontal => {
            Box::new(Ladder::new(vec![Box::new(supernodal), trusted], settings.constants.doubts))
        }
    }
}

/// Several methods, the fastest first, the most trusted last. A matrix on which one method breaks down goes to the
/// next one; a matrix that it solves inaccurately goes to the last one.
struct Ladder {
    methods: Vec<Box<dyn KktSolver>>,
    /// Methods that have factorised the last matrix or one that differs from it on the diagonal only.
    up_to_date: Vec<bool>,
    /// First method that the next factorisation tries.
    first: usize,
    /// Method that holds the current factor.
    in_use: usize,
    fallbacks: usize,
    /// Number of consecutive distrusted matrices.
    doubts: usize,
    /// After this many the next [`TRUSTED_ONLY`] go to the most trusted method directly.
    most_doubts: usize,
    /// Number of following matrices that go to the most trusted method directly.
    trusted_only: usize,
}

/// See `most_doubts`.
const TRUSTED_ONLY: usize = 20;

impl Ladder {
    fn new(methods: Vec<Box<dyn KktSolver>>, most_doubts: usize) -> Self {
        Self {
            up_to_date: vec![false; methods.len()],
            methods,
            first: 0,
            in_use: 0,
            fallbacks: 0,
            doubts: 0,
            most_doubts,
            trusted_only: 0,
        }
    }
}

impl KktSolver for Ladder {
    fn factor(&mut self, values: &[f64], change: MatrixChange) -> Option<Inertia> {
        // A distrusted matrix stays distrusted while only its diagonal changes.
        if change == MatrixChange::Any {
            self.up_to_date.fill(false);
            if self.trusted_only == 0 {
                self.doubts = if self.first > 0 { self.doubts + 1 } else { 0 };
                if self.doubts == self.most_doubts && self.doubts > 0 {
                    (self.doubts, self.trusted_only) = (0, TRUSTED_ONLY);
                }
            }
            self.first = if self.trusted_only > 0 { self.methods.len() - 1 } else { 0 };
            self.trusted_only = self.trusted_only.saturating_sub(1);
        }
        for (k, method) in self.methods.iter_mut().enumerate().skip(self.first) {
            if !method.suits(values) {
                continue;
            }
            self.in_use = k;
            // A method that was skipped has no factorisation to update, so it must factorise everything.
            let change = if std::mem::replace(&mut self.up_to_date[k], true) {
                MatrixChange::Diagonal
            } else {
                MatrixChange::Any
            };
            if let Some(inertia) = method.factor(values, change) {
                return Some(inertia);
            }
            self.fallbacks += 1;
        }
        None
    }

    fn solve(&mut self, rhs: &mut [f64]) {
        if let Some(method) = self.methods.get_mut(self.in_use) {
            method.solve(rhs);
        }
    }

    fn mark_neglected(&self, neglected: &mut [bool]) {
        if let Some(method) = self.methods.get(self.in_use) {
            method.mark_neglected(neglected);
        }
    }

    fn factor_entries(&self) -> usize {
        self.methods.get(self.in_use).map_or(0, |method| method.factor_entries())
    }

    fn reject_factorisation(&mut self) -> bool {
        if self.in_use + 1 >= self.methods.len() {
            return false;
        }
        self.first = self.methods.len() - 1;
        self.fallbacks += 1;
        true
    }

    fn fallbacks(&self) -> usize {
        self.fallbacks
    }
}
