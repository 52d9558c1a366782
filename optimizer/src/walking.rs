//! The hybrid system: the cycle of eight domains, contacts, outputs, Bezier curves, impacts and the phase variable.

pub mod bezier;
mod clearance;
pub mod domain;
pub mod impact;
pub mod phase;
mod progress;
pub mod stick_figure;

pub use bezier::{BEZIER_COEFFICIENTS, BEZIER_DEGREE, basis};
pub(crate) use clearance::clearance_profile;
pub use clearance::kept_clearance_m;
pub use domain::{CYCLE, ContactRow, Domain, DomainKind};
pub use impact::{Impact, impact, kinetic_energy};
pub use phase::phase_gradient;
pub use progress::{Progress, progress, progress_error_m};
