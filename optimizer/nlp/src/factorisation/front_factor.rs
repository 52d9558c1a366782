//! The numerical factor of one front.

use super::aligned::Aligned;
use super::front::Front;
use super::kkt_solver::Inertia;
use super::null_space::NullSpace;

/// The numerical factor of a front.
#[derive(Debug, Default)]
pub(super) struct FrontFactor {
    /// The numbers that substitution needs.
    pub numbers: Aligned,
    /// The Schur complement where another task factorises the parent; otherwise it is on a stack.
    pub schur: Vec<f64>,
    pub null_space: NullSpace,
    /// Subdiagonal of B and pivot order of the slots of stage 2.
    pub off_diagonal: Vec<f64>,
    pub order: Vec<usize>,
    pub inertia: Inertia,
    pub broke_down: bool,
}

impl FrontFactor {
    pub(super) fn new(front: &Front) -> Self {
        let pivots = front.pivot_slots();
        let null_space = NullSpace {
            variables: (0..front.variables.len()).collect(),
            rows: (0..front.rows.len()).collect(),
            rank: front.rows.len(),
        };
        Self {
            numbers: Aligned::zeros(front.kept.length()),
            null_space,
            off_diagonal: vec![0.0; pivots],
            order: (0..pivots).collect(),
            ..Self::default()
        }
    }
}
