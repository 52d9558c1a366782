//! The certificate of a gait: an independent check of the constraints, of the closed loop and of stability.
//!
//! It uses the finished gait (Bezier coefficients, phase limits, hip velocities, nodes) and the physics of
//! [`crate::body`], [`crate::muscle`] and [`crate::walking`], and shares no code with the gait problem:
//!
//! 1. Residuals of C1 to C12 at the nodes and on a grid ten times finer (`residuals`).
//! 2. The closed loop of the hybrid system under feedback linearisation with the virtual constraints of the gait:
//!    [`STRIDES`] strides, and contacts, friction and torques over the periodic stride (`closed_loop`).
//! 3. Multipliers of the stride-to-stride map, by variational equations and by finite differences ([`ReturnMap`]), with a
//!    regulated and with a free hip velocity.
//! 4. The largest pushes from which the walker recovers ([`Pushes`]).
//!
//! The limits are those of the gait itself. [`CertifiedGait`] names the gait and every value that differs from the built-in
//! problem.
//!
//! Step 1 checks the muscles. The closed loop has joint torques as inputs, like the device and the gait problem.

mod checked_quantity;
mod closed_loop;
mod contact_kinematics;
mod differences_from_defaults;
mod dormand_prince;
mod feedback_linearization;
mod findings;
mod finite_differences;
mod guard;
mod hybrid_walker;
mod identity;
mod limit_excess;
mod limits;
mod muscle_residuals;
mod poincare_section;
mod push;
mod reset;
mod residuals;
mod return_map;
mod torques;
mod virtual_constraints;

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod simulation_tests;

pub use checked_quantity::Check;
pub use closed_loop::STRIDES;
pub use differences_from_defaults::Difference;
pub use hybrid_walker::Fall;
pub use identity::CertifiedGait;
pub use push::{MAX_PUSH_M_S, Pushes, RECOVERY_STRIDES};
pub use return_map::{FixedPointDistance, FloquetMultiplier, ReturnMap};

use crate::body::WalkerModel;
use crate::gait::Gait;
use crate::model_error::ModelError;
use feedback_linearization::join;
use hybrid_walker::HybridWalker;
use serde::{Deserialize, Serialize};

/// Version of the layout and of the checks of [`Certificate`].
pub const FORMAT_VERSION: u32 = 7;

/// The result of certifying a gait.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Certificate {
    /// Version of this layout and of its checks.
    pub format_version: u32,
    /// The gait that was checked. `None` if it is malformed.
    pub certified: Option<CertifiedGait>,
    /// Whether every check is within its limit, the walker does not fall, and the gait is stable.
    pub passed: bool,
    /// The reasons for a failed certificate, as text; empty if it passed.
    pub failures: Vec<String>,
    /// Each quantity with its worst value and its limit.
    pub checks: Vec<Check>,
    /// The reason for an early end of the simulation: a fall, or a singular motion. There is no return map then.
    pub fall: Option<String>,
    /// The stride-to-stride map with a regulated hip velocity.
    pub return_map: Option<ReturnMap>,
    /// The stride-to-stride map with a free hip velocity. Its largest multiplier is that of the hybrid zero dynamics,
    /// because the controller removes deviations in all other directions within a step. It has no limit. `None` if this
    /// walker falls.
    pub free_hip_return_map: Option<ReturnMap>,
    /// Pushes from which the walker recovers, for a stable gait.
    pub pushes: Option<Pushes>,
}

impl Certificate {
    /// A failed certificate with this reason, for a gait that cannot be checked.
    pub fn failed_because(reason: &str) -> Self {
        Self { failures: vec![reason.to_owned()], ..Self::empty(Vec::new()) }
    }

    /// The reasons for a failure, in which the names of checks are in plain words.
    pub fn failures_in_words(&self) -> Vec<String> {
        let in_words = |failure: &String| {
            let named = |check: &&Check| failure.strip_prefix(&check.name).is_some_and(|rest| rest.starts_with(": "));
            let found = self.checks.iter().find(named);
            found.map_or_else(|| failure.clone(), |check| failure.replacen(&check.name, &check.name_in_words(), 1))
        };
        self.failures.iter().map(in_words).collect()
    }

    fn empty(checks: Vec<Check>) -> Self {
        Self {
            format_version: FORMAT_VERSION,
            certified: None,
            passed: false,
            failures: Vec::new(),
            checks,
            fall: None,
            return_map: None,
            free_hip_return_map: None,
            pushes: None,
        }
    }
}

/// Certifies a gait. Equal gaits give equal certificates. The check takes some seconds.
///
/// # Errors
/// [`ModelError`] if the gait is malformed.
pub fn certify(gait: &Gait) -> Result<Certificate, ModelError> {
    gait.validate()?;
    let model = WalkerModel::new(&gait.subject, &gait.device)?;
    let mut certificate = Certificate::empty(residuals::residuals(&model, gait));
    certificate.certified = Some(CertifiedGait::of(gait)?);
    if let Err(fall) = simulate(&model, gait, &mut certificate) {
        certificate.fall = Some(fall.to_string());
    }
    certificate.failures = failures(&certificate);
    certificate.passed = certificate.failures.is_empty();
    Ok(certificate)
}

/// Adds the results of the closed loop to the certificate, until the simulation ends early.
fn simulate(model: &WalkerModel, gait: &Gait, certificate: &mut Certificate) -> Result<(), Fall> {
    let walker = HybridWalker::new(model, gait);
    let start = join(&gait.domains[0].q[0], &gait.domains[0].qd[0]);
    let (periodic, map) = return_map::return_map(&walker, &start)?;
    let stable = map.is_stable();
    certificate.return_map = Some(map);
    // A fall with a free hip velocity does not count against a gait that is stable with a regulated one.
    let free = return_map::return_map(&walker.with_free_hip_velocity(), &periodic);
    certificate.free_hip_return_map = free.ok().map(|(_, map)| map);
    certificate.checks.extend(closed_loop::periodic_stride(&walker, gait, &periodic)?);
    certificate.checks.extend(closed_loop::orbit(&walker, &start)?);
    if stable {
        certificate.pushes = Some(push::pushes(&walker, &periodic)?);
    }
    Ok(())
}

/// The reasons for a failed certificate, as text.
fn failures(certificate: &Certificate) -> Vec<String> {
    let mut failures: Vec<String> = certificate
        .checks
        .iter()
        .filter(|check| !check.passed())
        .map(|c| format!("{}: {} ({}), limit {}", c.name, c.value_in_words(), c.place, c.limit_in_words()))
        .collect();
    if let Some(fall) = &certificate.fall {
        failures.push(fall.clone());
    }
    if let Some(map) = certificate.return_map.as_ref().filter(|map| !map.is_stable()) {
        failures.push(format!(
            "the gait is unstable: its largest multiplier is {:.4}, which must be less than 1",
            map.largest
        ));
    }
    for map in [&certificate.return_map, &certificate.free_hip_return_map].into_iter().flatten() {
        if !map.methods_agree() {
            failures.push(format!(
                "two computations of the largest multiplier disagree: {:.6e} by variational equations and {:.6e} by finite differences (resolution \
                 {:.1e})",
                map.largest, map.largest_by_differences, map.differences_resolve
            ));
        }
    }
    failures
}
