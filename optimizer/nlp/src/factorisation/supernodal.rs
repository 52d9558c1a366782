//! Supernodal sparse LBL^T with Bunch-Kaufman pivoting inside supernodes (faer, sequential).

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::perm::{Perm, PermRef};
use faer::sparse::linalg::SupernodalThreshold;
use faer::sparse::linalg::cholesky::supernodal::SupernodalIntranodeLbltRef;
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, IntranodeLbltRef, SymbolicCholesky, SymbolicCholeskyRaw, SymmetricOrdering,
    factorize_symbolic_cholesky,
};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMat};
use faer::{Conj, MatMut, Par, Side};

use super::kkt_solver::{Inertia, KktSolver, MatrixChange};
use crate::status::NlpError;

/// Analysis, factor and workspace.
pub(super) struct Supernodal {
    pattern: SymbolicSparseColMat<usize>,
    symbolic: SymbolicCholesky<usize>,
    factor: Vec<f64>,
    subdiagonal: Vec<f64>,
    forward: Vec<usize>,
    inverse: Vec<usize>,
    factor_memory: MemBuffer,
    solve_memory: MemBuffer,
}

impl Supernodal {
    /// Analyses the pattern of a lower triangle; `order` is the elimination order (position -> index), by default AMD.
    pub(super) fn new(
        column_starts: &[usize],
        row_indices: &[usize],
        order: Option<Vec<usize>>,
    ) -> Result<Self, NlpError> {
        let size = column_starts.len() - 1;
        let pattern = SymbolicSparseColMat::new_checked(size, size, column_starts.to_vec(), None, row_indices.to_vec());
        let permutation = order.map(|forward| {
            let mut inverse = vec![0; size];
            for (position, &index) in forward.iter().enumerate() {
                inverse[index] = position;
            }
            Perm::new_checked(forward.into_boxed_slice(), inverse.into_boxed_slice(), size)
        });
        let ordering = permutation.as_ref().map_or(SymmetricOrdering::Amd, |p| SymmetricOrdering::Custom(p.as_ref()));
        let symbolic = factorize_symbolic_cholesky(
            pattern.as_ref(),
            Side::Lower,
            ordering,
            CholeskySymbolicParams {
                supernodal_flop_ratio_threshold: SupernodalThreshold::FORCE_SUPERNODAL,
                ..CholeskySymbolicParams::default()
            },
        )
        .map_err(|error| NlpError::Analysis { order: size, reason: format!("{error:?}") })?;
        if !matches!(symbolic.raw(), SymbolicCholeskyRaw::Supernodal(_)) {
            return Err(NlpError::Analysis {
                order: size,
                reason: "the matrix is too small for supernodes".to_owned(),
            });
        }
        let memory = |request| {
            MemBuffer::try_new(request)
                .map_err(|_| NlpError::Analysis { order: size, reason: "not enough memory".to_owned() })
        };
        let factor_memory =
            memory(symbolic.factorize_numeric_intranode_lblt_scratch::<f64>(Par::Seq, faer::Spec::default()))?;
        let solve_memory = memory(symbolic.solve_in_place_scratch::<f64>(1, Par::Seq))?;
        Ok(Self {
            factor: vec![0.0; symbolic.len_val()],
            subdiagonal: vec![0.0; size],
            forward: (0..size).collect(),
            inverse: (0..size).collect(),
            pattern,
            symbolic,
            factor_memory,
            solve_memory,
        })
    }
}

impl Supernodal {
    /// Supernode of each index of the matrix.
    pub(super) fn supernode_of_index(&self) -> Vec<usize> {
        let size = self.subdiagonal.len();
        let mut of = vec![0; size];
        let SymbolicCholeskyRaw::Supernodal(symbolic) = self.symbolic.raw() else { return of };
        let forward = self.symbolic.perm().map(|permutation| permutation.arrays().0);
        for s in 0..symbolic.n_supernodes() {
            for position in symbolic.supernode_begin()[s]..symbolic.supernode_end()[s] {
                of[forward.map_or(position, |forward| forward[position])] = s;
            }
        }
        of
    }

    /// Multiplications and additions of a factorisation.
    pub(super) fn flops(&self) -> f64 {
        let SymbolicCholeskyRaw::Supernodal(symbolic) = self.symbolic.raw() else { return f64::INFINITY };
        let of = |s: usize| -> f64 {
            let width = symbolic.supernode_end()[s] - symbolic.supernode_begin()[s];
            let height = symbolic.supernode(s).pattern().len() + width;
            (0..width).map(|k| ((height - k) as f64).powi(2)).sum()
        };
        (0..symbolic.n_supernodes()).map(of).sum()
    }
}

impl KktSolver for Supernodal {
    fn factor(&mut self, values: &[f64], _change: MatrixChange) -> Option<Inertia> {
        if values.iter().any(|v| !v.is_finite()) {
            return None;
        }
        let size = self.subdiagonal.len();
        let matrix = SparseColMatRef::new(self.pattern.as_ref(), values);
        // The kernel writes the subdiagonal of pivots of order two only.
        self.subdiagonal.fill(0.0);
        self.symbolic.factorize_numeric_intranode_lblt(
            &mut self.factor,
            &mut self.subdiagonal,
            &mut self.forward,
            &mut self.inverse,
            matrix,
            Side::Lower,
            Par::Seq,
            MemStack::new(&mut self.factor_memory),
            faer::Spec::default(),
        );
        let SymbolicCholeskyRaw::Supernodal(symbolic) = self.symbolic.raw() else { return None };
        if self.factor.iter().any(|v| !v.is_finite()) {
            return None;
        }
        let permutation = PermRef::new_checked(&self.forward, &self.inverse, size);
        let factor = SupernodalIntranodeLbltRef::new(symbolic, &self.factor, &self.subdiagonal, permutation);
        let mut inertia = Inertia::default();
        for s in 0..symbolic.n_supernodes() {
            let node = factor.supernode(s);
            let (diagonal, start) = (node.val(), symbolic.supernode_begin()[s]);
            let mut j = 0;
            while j < diagonal.ncols() {
                let e = self.subdiagonal[start + j];
                if e != 0.0 && j + 1 < diagonal.ncols() {
                    inertia.count_pair(diagonal[(j, j)], e, diagonal[(j + 1, j + 1)]);
                    j += 2;
                } else {
                    inertia.count(diagonal[(j, j)]);
                    j += 1;
                }
            }
        }
        Some(inertia)
    }

    fn solve(&mut self, rhs: &mut [f64]) {
        let size = self.subdiagonal.len();
        let permutation = PermRef::new_checked(&self.forward, &self.inverse, size);
        let factor = IntranodeLbltRef::new(&self.symbolic, &self.factor, &self.subdiagonal, permutation);
        factor.solve_in_place_with_conj(
            Conj::No,
            MatMut::from_column_major_slice_mut(rhs, size, 1),
            Par::Seq,
            MemStack::new(&mut self.solve_memory),
        );
    }

    fn factor_entries(&self) -> usize {
        self.factor.len()
    }
}
