//! The certificate on the page of a gait, and the button that certifies it.

use crate::AppState;
use crate::accessible::Id;
use crate::authorization::Authorized;
use crate::bound_units::with_angles_in_degrees;
use crate::format;
use crate::page_error::PageError;
use axum::extract::State;
use axum::response::Redirect;
use gait_optimizer::certificate::{Certificate, Check, Difference, RECOVERY_STRIDES};
use gait_optimizer::number_format::with_unit;
use gaitwright_service::access::Run;
use gaitwright_service::job::JobState;
use gaitwright_service::studies::certificate_request;
use gaitwright_store::{TrialId, commit};

/// A certificate as the page shows it.
pub(super) struct InWords {
    /// Whether every check is within its limit and the gait is stable.
    pub(super) passed: bool,
    /// Why it failed.
    pub(super) failures: Vec<String>,
    /// Figures of the closed loop: label and value.
    pub(super) values: Vec<(&'static str, String)>,
    /// Every check.
    pub(super) checks: Vec<FormattedCheck>,
}

impl InWords {
    pub(super) fn new(certificate: Certificate) -> Self {
        let mut values = Vec::new();
        if let Some(certified) = &certificate.certified {
            values.push(("Gait (SHA-256)", certified.gait_sha256.clone()));
            values.push(("Subject and device", certified.walker_in_words()));
            let differences: Vec<String> = certified.differences.iter().map(Difference::in_words).collect();
            let words = if differences.is_empty() { "none".to_owned() } else { differences.join("; ") };
            values.push(("Differences from the built-in device and the default settings", words));
            let cost = format::number(certified.cost_of_transport);
            values.push(("Cost of transport", cost));
        }
        if let Some(map) = &certificate.return_map {
            values.push(("Largest Poincaré multiplier", format::number(map.largest)));
            let (found, resolved) =
                (format::number(map.largest_by_differences), format::number(map.differences_resolve));
            values.push((
                "Largest Poincaré multiplier from finite differences (resolution)",
                format!("{found} ({resolved})"),
            ));
            values.push(("Share of a change in speed that remains after one stride", format::number(map.speed_kept)));
            values
                .push(("Share of a change in speed that spreads to other coordinates", format::number(map.speed_leak)));
            let distance = map.fixed_point_distance;
            values.push((
                "Largest deviations of the gait from the periodic motion",
                format!(
                    "{} in the height of the hip, {} in an angle, {} in a velocity of the hip, {} in an angular velocity",
                    with_unit(format::number(1e3 * distance.height_m), "mm"),
                    with_angles_in_degrees(distance.angle_rad, "rad"),
                    with_unit(format::number(distance.velocity_m_s), "m/s"),
                    with_angles_in_degrees(distance.angular_velocity_rad_s, "rad/s"),
                ),
            ));
        }
        if let Some(free) = &certificate.free_hip_return_map {
            let words = format!("{:.3} (finite differences: {:.3})", free.largest, free.largest_by_differences);
            values.push(("Multiplier of the zero dynamics (free hip velocity)", words));
        }
        if let Some(pushes) = certificate.pushes {
            let words = format!(
                "{:.2} m/s forwards, {:.2} m/s backwards, within {RECOVERY_STRIDES} strides",
                pushes.forwards_m_s, pushes.backwards_m_s
            );
            values.push(("Pushes at the hip from which the walker recovers", words));
        }
        let failures = certificate.failures_in_words();
        let checks = certificate.checks.into_iter().map(FormattedCheck::new).collect();
        Self { passed: certificate.passed, failures, values, checks }
    }
}

/// A check with formatted values.
pub(super) struct FormattedCheck {
    pub(super) name: String,
    pub(super) value: String,
    pub(super) limit: String,
    pub(super) place: String,
}

impl FormattedCheck {
    fn new(check: Check) -> Self {
        let in_unit = |value: Option<f64>, otherwise: &str| {
            value.map_or_else(|| otherwise.to_owned(), |value| with_angles_in_degrees(value, &check.unit))
        };
        Self {
            value: in_unit(check.value, "not determined"),
            limit: in_unit(check.limit, "no limit; reported only"),
            name: check.name_in_words(),
            place: check.place,
        }
    }
}

/// The job that makes the certificate of a gait.
pub(super) enum CertificateJob {
    /// There is none.
    None,
    /// It is queued or running.
    Pending,
    /// It was cancelled.
    Cancelled,
    /// It failed, for this reason.
    Failed(String),
}

impl CertificateJob {
    pub(super) fn of(job: Option<(JobState, Option<String>)>) -> Self {
        match job {
            None | Some((JobState::Done, _)) => Self::None,
            Some((JobState::Queued | JobState::Running, _)) => Self::Pending,
            Some((JobState::Cancelled, _)) => Self::Cancelled,
            Some((JobState::Failed, reason)) => Self::Failed(reason.unwrap_or_default()),
        }
    }

    pub(super) fn is_pending(&self) -> bool {
        matches!(self, Self::Pending)
    }
}

/// `POST /trials/{id}/certify`.
pub(super) async fn post(
    authorized: Authorized<Run>,
    State(app): State<AppState>,
    Id(id, _): Id<TrialId, Run>,
) -> Result<Redirect, PageError> {
    let mut writer = app.write().await?;
    certificate_request::ask(&mut writer, &app.scheduler, &authorized.caller.actor, id).await?;
    commit(writer).await?;
    app.scheduler.changed();
    Ok(Redirect::to(&format!("/trials/{id}#certificate")))
}
