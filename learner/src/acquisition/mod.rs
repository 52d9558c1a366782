//! Acquisition rules: the ways to choose the next action.

pub(crate) mod avoidance;
mod candidates;
mod duel;
pub(crate) mod eubo;
mod eubo_bounds;
pub(crate) mod information_gain;
pub(crate) mod line_cospar;
pub(crate) mod line_points;
pub(crate) mod thompson;
