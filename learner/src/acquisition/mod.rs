//! Ways to choose the next action.

pub(crate) mod avoidance;
pub(crate) mod eubo;
pub(crate) mod information;
pub(crate) mod line;
pub(crate) mod thompson;
