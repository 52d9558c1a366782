//! The certificate of a gait: what the gait problem promised, checked without its code.
//!
//! From the gait as it is handed out (Bezier coefficients, phase limits, hip velocities, nodes) and the physics of
//! [`crate::body`], [`crate::muscle`] and [`crate::walking`] alone:
//!
//! 1. the residuals of C1-C12 at the nodes and on a grid ten times finer (`residuals`);
//! 2. the closed loop of the full hybrid system under feedback linearisation with the gait's own virtual constraints:
//!    [`STRIDES`] strides, and contacts, friction and torques over a periodic stride (`closed_loop`);
//! 3. the multipliers of the stride-to-stride map, by variational equations and by differences ([`ReturnMap`]), with the
//!    hip velocity brought back by the controller and with the hip velocity left alone;
//! 4. the largest pushes that are recovered ([`Pushes`]).
//!
//! Muscles are checked in 1; the closed loop drives the joints by torques, as the device and the gait problem do.

mod check;
mod closed_loop;
mod contact;
mod control;
mod domain_differences;
mod dormand_prince;
mod guard;
mod hybrid_walker;
mod limits;
mod muscle_residuals;
mod push;
mod reset;
mod residuals;
mod return_map;
mod torques;
mod virtual_constraints;

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod simulation_tests;

pub use check::Check;
pub use closed_loop::STRIDES;
pub use hybrid_walker::Fall;
pub use push::{LARGEST_PUSH_M_S, Pushes, RECOVERY_STRIDES};
pub use return_map::{Multiplier, ReturnMap};

use crate::body::WalkerModel;
use crate::gait::Gait;
use crate::subject::ModelError;
use control::join;
use hybrid_walker::HybridWalker;
use serde::{Deserialize, Serialize};

/// Version of [`Certificate`]'s layout and of what it checks.
pub const FORMAT_VERSION: u32 = 6;

/// What was found.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Certificate {
    /// Version of this layout and of its checks.
    pub format_version: u32,
    /// Whether every check is within its limit, the walker does not fall, and the gait is stable.
    pub passed: bool,
    /// Why not, in words; empty when passed.
    pub objections: Vec<String>,
    /// Every quantity with its worst value and its limit.
    pub checks: Vec<Check>,
    /// How the simulation ended early, where it did: the walker fell, or no motion follows from the controller's demands; then
    /// there is no return map.
    pub fall: Option<String>,
    /// The stride-to-stride map.
    pub return_map: Option<ReturnMap>,
    /// The same with a hip velocity that nobody brings back: the hybrid zero dynamics, what contacts, impacts and SS1 alone
    /// make of a change of speed. Its largest multiplier is theirs: all other directions are the controller's, and end
    /// within a step. Reported without a judgement of stability; none when such a walker falls.
    pub free_hip_return_map: Option<ReturnMap>,
    /// Pushes that are recovered; only of a stable gait.
    pub pushes: Option<Pushes>,
}

impl Certificate {
    /// The certificate of what cannot be certified: it failed, for this reason.
    pub fn failed_because(reason: &str) -> Self {
        Self { objections: vec![reason.to_owned()], ..Self::empty(Vec::new()) }
    }

    fn empty(checks: Vec<Check>) -> Self {
        Self {
            format_version: FORMAT_VERSION,
            passed: false,
            objections: Vec::new(),
            checks,
            fall: None,
            return_map: None,
            free_hip_return_map: None,
            pushes: None,
        }
    }
}

/// Certifies a gait. Deterministic; takes some seconds.
///
/// # Errors
/// [`ModelError`] when the gait is not well-formed.
pub fn certify(gait: &Gait) -> Result<Certificate, ModelError> {
    gait.validate()?;
    let model = WalkerModel::new(&gait.subject, &gait.device)?;
    let mut certificate = Certificate::empty(residuals::residuals(&model, gait));
    if let Err(fall) = simulate(&model, gait, &mut certificate) {
        certificate.fall = Some(fall.to_string());
    }
    certificate.objections = objections(&certificate);
    certificate.passed = certificate.objections.is_empty();
    Ok(certificate)
}

/// Everything that needs the closed loop, as far as it gets.
fn simulate(model: &WalkerModel, gait: &Gait, certificate: &mut Certificate) -> Result<(), Fall> {
    let walker = HybridWalker::new(model, gait);
    let start = join(&gait.domains[0].q[0], &gait.domains[0].qd[0]);
    let (periodic, map) = return_map::return_map(&walker, &start)?;
    let stable = map.is_stable();
    certificate.return_map = Some(map);
    // A walker that needs its hip velocity brought back is no worse for falling without.
    let free = return_map::return_map(&walker.with_free_hip_velocity(), &periodic);
    certificate.free_hip_return_map = free.ok().map(|(_, map)| map);
    certificate.checks.extend(closed_loop::periodic_stride(&walker, gait, &periodic)?);
    certificate.checks.extend(closed_loop::orbit(&walker, &start)?);
    if stable {
        certificate.pushes = Some(push::pushes(&walker, &periodic)?);
    }
    Ok(())
}

/// Why a certificate does not pass, in words.
fn objections(certificate: &Certificate) -> Vec<String> {
    let mut objections: Vec<String> = certificate
        .checks
        .iter()
        .filter(|check| !check.passed())
        .map(|c| format!("{}: {} ({}), allowed {}", c.name, c.value_in_words(), c.place, c.limit_in_words()))
        .collect();
    if let Some(fall) = &certificate.fall {
        objections.push(fall.clone());
    }
    if let Some(map) = certificate.return_map.as_ref().filter(|map| !map.is_stable()) {
        objections.push(format!("the gait is unstable: its largest multiplier is {:.4}", map.largest));
    }
    for map in [&certificate.return_map, &certificate.free_hip_return_map].into_iter().flatten() {
        if !map.methods_agree() {
            objections.push(format!(
                "a largest multiplier is {:.6e} by variational equations and {:.6e} by differences, which resolve {:.1e}",
                map.largest, map.largest_by_differences, map.differences_resolve
            ));
        }
    }
    objections
}
