//! The seam between the service and the certification of a gait.

use gait_optimizer::certificate::{Certificate, certify};
use gait_optimizer::{Gait, ModelError};

/// Certifies a gait on the calling thread.
pub trait Certify: Send + Sync + 'static {
    /// The certificate of a gait: the same for the same gait, to the last bit.
    ///
    /// # Errors
    /// [`ModelError`] when it is no gait of the walker.
    fn certify(&self, gait: &Gait) -> Result<Certificate, ModelError>;
}

/// The real thing: `gait_optimizer::certificate::certify`.
#[derive(Debug, Clone, Copy, Default)]
pub struct GaitCertifier;

impl Certify for GaitCertifier {
    fn certify(&self, gait: &Gait) -> Result<Certificate, ModelError> {
        certify(gait)
    }
}
