//! The interface between the service and the certification of gaits.

use gait_optimizer::certificate::{Certificate, certify};
use gait_optimizer::{Gait, ModelError};

/// Certifies a gait on the calling thread.
pub trait Certify: Send + Sync + 'static {
    /// The certificate of a gait. The same gait gives the same certificate, bit for bit.
    ///
    /// # Errors
    /// [`ModelError`] for a malformed gait.
    fn certify(&self, gait: &Gait) -> Result<Certificate, ModelError>;
}

/// Certifies with `gait_optimizer::certificate::certify`.
#[derive(Debug, Clone, Copy, Default)]
pub struct GaitCertifier;

impl Certify for GaitCertifier {
    fn certify(&self, gait: &Gait) -> Result<Certificate, ModelError> {
        certify(gait)
    }
}
