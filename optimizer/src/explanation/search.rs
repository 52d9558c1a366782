//! The state of a search for conflicts and relaxations.

use super::solves::Solves;
use crate::gait_problem::GaitProblem;

/// The search for conflicts and relaxations.
pub(super) struct Search<'a> {
    pub(super) problem: &'a GaitProblem,
    pub(super) solves: Solves<'a>,
    /// Bounds, the most suspected ones first.
    pub(super) order: Vec<usize>,
}
