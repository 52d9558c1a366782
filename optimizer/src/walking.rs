//! The hybrid system: the cycle of eight domains, contacts, outputs, Bezier curves, impacts and the phase variable.

pub mod bernstein_basis;
mod clearance_profile;
pub mod domain_cycle;
mod hip_velocity;
pub mod impact;
pub mod phase_variable;

pub use bernstein_basis::{BEZIER_COEFFICIENTS, BEZIER_DEGREE, basis};
pub(crate) use clearance_profile::clearance_profile;
pub use domain_cycle::{CYCLE, ContactRow, Domain, DomainKind};
pub use impact::{Impact, impact, kinetic_energy};
pub use phase_variable::phase_gradient;
