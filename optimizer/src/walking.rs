//! The hybrid system: the cycle of eight domains, contacts, outputs, Bezier curves, impacts and the phase variable.

pub mod bezier;
pub mod domain;
mod foot_clearance;
pub mod impact;
pub mod phase_variable;

pub use bezier::{BEZIER_COEFFICIENTS, BEZIER_DEGREE, basis};
pub use domain::{CYCLE, ContactRow, Domain, DomainKind};
pub(crate) use foot_clearance::clearance_profile;
pub use impact::{Impact, impact, kinetic_energy};
pub use phase_variable::phase_gradient;
