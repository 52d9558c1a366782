//! Zero-phase digital filters.

mod butterworth;
mod zero_phase;

pub(crate) use butterworth::{band_pass, low_pass};
pub(crate) use zero_phase::{extension, filter};
