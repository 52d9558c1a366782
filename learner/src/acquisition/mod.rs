//! Ways to choose the next action.

pub(crate) mod eubo;
pub(crate) mod line;
