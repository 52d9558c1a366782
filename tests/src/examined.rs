//! What an examination leaves, without one.

use gait_optimizer::certificate::{Certificate, FORMAT_VERSION};

/// A certificate that passed, or one of a walker that falls.
pub fn certificate(passed: bool) -> Certificate {
    let fall = (!passed).then(|| "the simulated walker falls".to_owned());
    Certificate {
        format_version: FORMAT_VERSION,
        passed,
        objections: fall.iter().cloned().collect(),
        checks: Vec::new(),
        fall,
        return_map: None,
        free_hip_return_map: None,
        pushes: None,
    }
}
