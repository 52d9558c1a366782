//! `gaitwright certify`: certifies a gait independently of the optimiser.

use super::gait_file::read_gait;
use super::output::data;
use clap::Args;
use gait_optimizer::certificate::{Certificate, RECOVERY_STRIDES, STRIDES, certify};
use gaitwright_compute::Pool;
use gaitwright_service::error::Error;
use std::path::PathBuf;

#[derive(Debug, Args)]
pub(super) struct Certify {
    /// File written by `solve --out`, or a gait downloaded from the service.
    #[arg(value_name = "GAIT.json")]
    gait: PathBuf,
    /// Print the certificate as one JSON object.
    #[arg(long)]
    json: bool,
}

impl Certify {
    /// Certifies the gait. A failed certificate is a result, not an error.
    pub(super) async fn run(self) -> Result<(), Error> {
        let gait = read_gait(&self.gait)?;
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
    lines.extend(certificate.failures.iter().map(|failure| format!("  failure: {failure}")));
    for check in &certificate.checks {
        let (value, limit) = (check.value_in_words(), check.limit_in_words());
        lines.push(format!("  {}: {value} (allowed: {limit}; {})", check.name, check.place));
    }
    if let Some(map) = &certificate.return_map {
        lines.push(format!(
            "  largest multiplier {:.4e} (finite differences: {:.4e}, resolution {:.0e}): {}; of a change in speed, {:.1e} remains after one stride and {:.1e} spreads to other coordinates",
            map.largest,
            map.largest_by_differences,
            map.differences_resolve,
            if map.is_stable() { "stable" } else { "unstable" },
            map.speed_kept,
            map.speed_leak
        ));
        lines.push(format!(
            "  distance of the gait from the periodic motion {:.1e} rad, rad/s; simulated for {STRIDES} strides",
            map.fixed_point_distance
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
            "  pushes recovered within {RECOVERY_STRIDES} strides: {:.2} m/s forwards, {:.2} m/s backwards",
            pushes.forwards_m_s, pushes.backwards_m_s
        ));
    }
    lines.join("\n")
}
