//! `gaitwright certify`: certifies a gait independently of the optimiser.

use super::gait_file::{GaitFile, check_stated_values, read_gait_file};
use super::output::data;
use super::problem_files::reference_of;
use clap::Args;
use gait_optimizer::certificate::{Certificate, RECOVERY_STRIDES, STRIDES, certify};
use gaitwright_compute::Pool;
use gaitwright_service::error::Error;
use std::path::PathBuf;

#[derive(Debug, Args)]
pub(super) struct CertifyCommand {
    /// File written by `solve --out`, or a gait downloaded from the service.
    #[arg(value_name = "GAIT.json")]
    gait: PathBuf,
    /// Reference gait used in the solve: a name or file, as for `solve --reference` (default: falisse-2019). Needed to
    /// check the Gait RMSE that a file written by `solve --out` states.
    #[arg(long, value_name = "NAME or FILE")]
    reference: Option<PathBuf>,
    /// Print the certificate as one JSON object.
    #[arg(long)]
    json: bool,
}

impl CertifyCommand {
    /// Certifies the gait. A failed certificate is a result, not an error.
    pub(super) async fn run(self) -> Result<(), Error> {
        let GaitFile { gait, report } = read_gait_file(&self.gait)?;
        let reference = reference_of(self.reference.as_deref())?;
        if let Some(report) = report {
            check_stated_values(&gait, &report, &reference)
                .map_err(|reason| Error::Malformed(format!("Cannot certify {}: {reason}", self.gait.display())))?;
        }
        let certificate = Pool::new(1).run(move |_| certify(&gait)).await??;
        if self.json {
            let text = serde_json::to_string_pretty(&certificate).map_err(|e| Error::Internal(e.to_string()))?;
            data(&text)
        } else {
            data(&for_people(&certificate))
        }
    }
}

/// The certificate as text.
pub(super) fn for_people(certificate: &Certificate) -> String {
    let mut lines = vec![format!("certificate: {}", if certificate.passed { "passed" } else { "failed" })];
    if let Some(certified) = &certificate.certified {
        lines.push(format!("  gait {}, {}", certified.gait_sha256, certified.walker_in_words()));
        lines.extend(
            certified
                .differences
                .iter()
                .map(|difference| format!("  differs from the built-in problem: {}", difference.in_words())),
        );
        lines.push(format!("  cost of transport {:.4}", certified.cost_of_transport));
    }
    lines.extend(certificate.failures_in_words().iter().map(|failure| format!("  failure: {failure}")));
    for check in &certificate.checks {
        let (value, limit) = (check.value_in_words(), check.limit_in_words());
        let allowed = if check.limit.is_some() { format!("allowed: {limit}") } else { limit };
        lines.push(format!("  {}: {value} ({allowed}; {})", check.name_in_words(), check.place));
    }
    if let Some(map) = &certificate.return_map {
        lines.push(format!(
            "  largest multiplier {:.4e} (finite differences: {:.4e}, resolution {:.0e}): {}",
            map.largest,
            map.largest_by_differences,
            map.differences_resolve,
            if map.is_stable() { "stable" } else { "unstable" }
        ));
        lines.push(format!(
            "  change in speed: share that remains after one stride {:.1e}, share that spreads to other coordinates {:.1e}",
            map.speed_kept, map.speed_leak
        ));
        lines.push(format!(
            "  largest deviations of the gait from the periodic motion: {:.1e} m, {:.1e} rad, {:.1e} m/s, {:.1e} rad/s; {STRIDES} strides simulated",
            map.fixed_point_distance.height_m,
            map.fixed_point_distance.angle_rad,
            map.fixed_point_distance.velocity_m_s,
            map.fixed_point_distance.angular_velocity_rad_s
        ));
    }
    if let Some(map) = &certificate.free_hip_return_map {
        lines.push(format!(
            "  zero dynamics (free hip velocity): multiplier {:.4} (finite differences: {:.4})",
            map.largest, map.largest_by_differences
        ));
    }
    if let Some(pushes) = certificate.pushes {
        lines.push(format!(
            "  pushes from which the walker recovers within {RECOVERY_STRIDES} strides: {:.2} m/s forwards, {:.2} m/s backwards",
            pushes.forwards_m_s, pushes.backwards_m_s
        ));
    }
    lines.join("\n")
}
