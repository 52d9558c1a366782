//! Jobs from the same version of the program, the only ones that a worker runs.

use super::message::SolveOrder;
use crate::workers::dispatch::Assignment;

/// Version of the program. Another version may give different bits.
pub(super) const PROGRAM: &str = env!("CARGO_PKG_VERSION");

impl SolveOrder {
    /// The order of a solve from this version.
    pub(super) fn from_this_version(assignment: Assignment) -> Self {
        Self { program: PROGRAM.to_owned(), assignment }
    }

    /// Whether service and worker have the same version.
    pub(super) fn is_of_this_version(&self) -> bool {
        self.program == PROGRAM
    }
}
