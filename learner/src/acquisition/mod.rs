//! Ways to choose the next action.

pub(crate) mod line;
