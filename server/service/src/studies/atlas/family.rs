//! Common values of the solves of an atlas.

use gait_optimizer::{GaitProblem, SolveOptions, WarmStart};

pub(super) struct Family {
    /// With the default bounds.
    pub(super) problem: GaitProblem,
    pub(super) options: SolveOptions,
    /// The end of the solve with the default bounds, from which all others start.
    pub(super) root: WarmStart,
}
