//! Certificates for tests, made without certifying a gait.

use gait_optimizer::certificate::{Certificate, FORMAT_VERSION};
use gait_optimizer::{Gait, ModelError};
use gaitwright_service::workers::Certify;
use std::time::Duration;

/// A passed certificate, or a failed one of a walker that falls.
pub fn certificate(passed: bool) -> Certificate {
    let fall = (!passed).then(|| "the simulated walker falls".to_owned());
    Certificate {
        format_version: FORMAT_VERSION,
        certified: None,
        passed,
        failures: fall.iter().cloned().collect(),
        checks: Vec::new(),
        fall,
        return_map: None,
        free_hip_return_map: None,
        pushes: None,
    }
}

/// A slow certifier, which passes the gaits that it is told to pass.
pub struct Verdicts<P> {
    /// How long a certification takes.
    pub pause: Duration,
    /// Which gaits pass.
    pub passes: P,
}

impl<P: Fn(&Gait) -> bool + Send + Sync + 'static> Certify for Verdicts<P> {
    fn certify(&self, gait: &Gait) -> Result<Certificate, ModelError> {
        std::thread::sleep(self.pause);
        Ok(certificate((self.passes)(gait)))
    }
}
