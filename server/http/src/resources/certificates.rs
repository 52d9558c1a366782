//! Certificates of gaits.

use gait_optimizer::certificate;
use serde::Serialize;
use serde_json::Value;
use utoipa::ToSchema;

/// A certificate: the result of checking a gait independently of the optimiser.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct Certificate {
    /// Version of this layout and of its checks.
    format_version: u32,
    /// The gait that was checked; null if it is malformed.
    certified: Option<CertifiedGait>,
    /// Whether every checked value is within its limit, the walker does not fall, and the gait is stable.
    passed: bool,
    /// Reasons if it failed; otherwise empty.
    failures: Vec<String>,
    /// Every quantity with its worst value and its limit.
    checks: Vec<CertificateCheck>,
    /// How the simulation ended early; null if it did not.
    fall: Option<String>,
    /// The stride-to-stride map. Null if the simulation ended early.
    return_map: Option<ReturnMap>,
    /// The stride-to-stride map with a free hip velocity (zero dynamics). Null if the simulation ended early, or if the
    /// map could not be computed.
    free_hip_return_map: Option<ReturnMap>,
    /// Largest pushes from which the walker recovers. Null if the gait is not stable.
    pushes: Option<Pushes>,
}

impl From<certificate::Certificate> for Certificate {
    fn from(certificate: certificate::Certificate) -> Self {
        let certificate::Certificate {
            format_version,
            certified,
            passed,
            failures,
            checks,
            fall,
            return_map,
            free_hip_return_map,
            pushes,
        } = certificate;
        Self {
            format_version,
            certified: certified.map(Into::into),
            passed,
            failures,
            checks: checks.into_iter().map(Into::into).collect(),
            fall,
            return_map: return_map.map(Into::into),
            free_hip_return_map: free_hip_return_map.map(Into::into),
            pushes: pushes.map(Into::into),
        }
    }
}

/// Identity of the gait that a certificate is about, computed from the gait.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct CertifiedGait {
    /// SHA-256 of the gait as compact JSON, hexadecimal.
    gait_sha256: String,
    /// Version of the optimiser that made the certificate.
    optimizer_version: String,
    /// The subject.
    subject: CertifiedSubject,
    /// Name of the device. `differences` shows whether its values are those of the built-in device.
    device: String,
    /// Whether the muscle constraints were checked.
    muscles: bool,
    /// Values of the device and of the settings that differ from AMPRO3 and the default settings.
    differences: Vec<CertifiedDifference>,
    /// Mechanical cost of transport, from absolute joint powers; dimensionless. It is computed from the gait, and so is that
    /// of its trial.
    cost_of_transport: f64,
}

impl From<certificate::CertifiedGait> for CertifiedGait {
    fn from(gait: certificate::CertifiedGait) -> Self {
        let certificate::CertifiedGait {
            gait_sha256,
            optimizer_version,
            subject,
            device,
            muscles,
            differences,
            cost_of_transport,
        } = gait;
        Self {
            gait_sha256,
            optimizer_version,
            subject: subject.into(),
            device,
            muscles,
            differences: differences.into_iter().map(Into::into).collect(),
            cost_of_transport,
        }
    }
}

/// Height and mass of a certified walker.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct CertifiedSubject {
    /// Body height, m.
    height_m: f64,
    /// Body mass, kg.
    body_mass_kg: f64,
}

impl From<gait_optimizer::Subject> for CertifiedSubject {
    fn from(subject: gait_optimizer::Subject) -> Self {
        let gait_optimizer::Subject { height_m, body_mass_kg } = subject;
        Self { height_m, body_mass_kg }
    }
}

/// A value that differs from the built-in problem.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct CertifiedDifference {
    /// Path of the value in the gait document, such as `settings.limits.friction` or `device.knee_torque_limit_n_m`.
    name: String,
    /// Value of the gait; null if it is not set.
    value: Value,
    /// Value of the built-in problem; null if it is not set.
    built_in: Value,
}

impl From<certificate::Difference> for CertifiedDifference {
    fn from(difference: certificate::Difference) -> Self {
        let certificate::Difference { name, value, built_in } = difference;
        Self { name, value, built_in }
    }
}

/// The worst value of a quantity.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct CertificateCheck {
    /// Name of the measured quantity.
    name: String,
    /// Unit of the value and the limit; empty if dimensionless.
    unit: String,
    /// Worst value; null if it could not be determined, which counts as failed.
    value: Option<f64>,
    /// Largest allowed value. Null if the value is only reported.
    limit: Option<f64>,
    /// Domain and time of the worst value.
    place: String,
}

impl From<certificate::Check> for CertificateCheck {
    fn from(check: certificate::Check) -> Self {
        let certificate::Check { name, unit, value, limit, place } = check;
        Self { name, unit, value, limit, place }
    }
}

/// Largest differences between the gait's initial state and the fixed point of the closed loop.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct FixedPointDistance {
    /// In the height of the hip, m.
    height_m: f64,
    /// In an angle, rad.
    angle_rad: f64,
    /// In a velocity of the hip, m/s.
    velocity_m_s: f64,
    /// In an angular velocity, rad/s.
    angular_velocity_rad_s: f64,
}

impl From<certificate::FixedPointDistance> for FixedPointDistance {
    fn from(distance: certificate::FixedPointDistance) -> Self {
        let certificate::FixedPointDistance { height_m, angle_rad, velocity_m_s, angular_velocity_rad_s } = distance;
        Self { height_m, angle_rad, velocity_m_s, angular_velocity_rad_s }
    }
}

/// Stability of a gait, from the stride-to-stride map.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct ReturnMap {
    /// Largest change in a component of the state (m, rad, m/s or rad/s) over one stride that starts at the gait's initial
    /// state.
    gait_residual: f64,
    /// The same for a stride from the nearby fixed point of the closed loop.
    fixed_point_residual: f64,
    /// Distance between the gait's initial state and the fixed point.
    fixed_point_distance: FixedPointDistance,
    /// Multipliers from variational equations and saltation matrices, largest first.
    multipliers: Vec<FloquetMultiplier>,
    /// Largest modulus of the multipliers.
    largest: f64,
    /// Largest modulus of the multipliers, from finite differences of simulated domains.
    largest_by_differences: f64,
    /// Resolution of the finite differences: the change of `largest_by_differences` by the last extrapolation.
    differences_resolve: f64,
    /// Fraction of a proportional change of all velocities that remains after one stride.
    speed_kept: f64,
    /// Change in other coordinates that a proportional change of all velocities causes within one stride, relative to its size.
    speed_leak: f64,
}

impl From<certificate::ReturnMap> for ReturnMap {
    fn from(map: certificate::ReturnMap) -> Self {
        let certificate::ReturnMap {
            gait_residual,
            fixed_point_residual,
            fixed_point_distance,
            multipliers,
            largest,
            largest_by_differences,
            differences_resolve,
            speed_kept,
            speed_leak,
        } = map;
        Self {
            gait_residual,
            fixed_point_residual,
            fixed_point_distance: fixed_point_distance.into(),
            multipliers: multipliers.into_iter().map(Into::into).collect(),
            largest,
            largest_by_differences,
            differences_resolve,
            speed_kept,
            speed_leak,
        }
    }
}

/// A Floquet multiplier: an eigenvalue of the linearised stride-to-stride map.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct FloquetMultiplier {
    /// Real part.
    real: f64,
    /// Imaginary part.
    imaginary: f64,
}

impl From<certificate::FloquetMultiplier> for FloquetMultiplier {
    fn from(multiplier: certificate::FloquetMultiplier) -> Self {
        let certificate::FloquetMultiplier { real, imaginary } = multiplier;
        Self { real, imaginary }
    }
}

/// Largest changes in the hip's forward velocity from which the walker recovers, m/s.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct Pushes {
    /// Forwards, m/s.
    forwards_m_s: f64,
    /// Backwards, m/s.
    backwards_m_s: f64,
}

impl From<certificate::Pushes> for Pushes {
    fn from(pushes: certificate::Pushes) -> Self {
        let certificate::Pushes { forwards_m_s, backwards_m_s } = pushes;
        Self { forwards_m_s, backwards_m_s }
    }
}
