//! The rate of the controllers.

/// Period of the controllers, s.
pub(super) const CONTROL_PERIOD_S: f64 = 1e-3;
