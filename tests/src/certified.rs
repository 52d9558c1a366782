//! What a certification leaves, without one.

use gait_optimizer::certificate::{Certificate, FORMAT_VERSION};
use gait_optimizer::{Gait, ModelError};
use gaitwright_service::workers::Certify;
use std::time::Duration;

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

/// A certifier that takes its time, and passes the gaits that it is told to.
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
