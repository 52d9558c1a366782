//! Identity of the gait that a certificate is about: which gait of which walker.

use super::differences_from_defaults::{Difference, differences};
use crate::body::WalkerModel;
use crate::cost_of_transport::cost_of_transport;
use crate::gait::Gait;
use crate::model_error::ModelError;
use crate::subject::Subject;
use serde::{Deserialize, Serialize};

/// The gait that a certificate is about. Everything here is computed from the gait.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CertifiedGait {
    /// SHA-256 of the gait as compact JSON, hexadecimal.
    pub gait_sha256: String,
    /// Version of the optimiser that made the certificate.
    pub optimizer_version: String,
    /// The subject.
    pub subject: Subject,
    /// Name of the device. Only [`Self::differences`] tells whether its values are those of the built-in device.
    pub device: String,
    /// Whether the muscle constraints C5 to C12 were checked.
    pub muscles: bool,
    /// Values of the device and of the settings that differ from AMPRO3 and the default settings.
    pub differences: Vec<Difference>,
    /// Mechanical cost of transport, from absolute joint powers; dimensionless.
    pub cost_of_transport: f64,
}

impl CertifiedGait {
    /// Identity of a gait, as its certificate states it, without certifying it.
    ///
    /// # Errors
    /// [`ModelError`] if the gait is malformed.
    pub fn of(gait: &Gait) -> Result<Self, ModelError> {
        gait.validate()?;
        let total_mass_kg = WalkerModel::new(&gait.subject, &gait.device)?.total_mass;
        Ok(Self {
            gait_sha256: gait.sha256()?,
            optimizer_version: env!("CARGO_PKG_VERSION").to_owned(),
            subject: gait.subject,
            device: gait.device.name.clone(),
            muscles: gait.muscles,
            differences: differences(gait)?,
            cost_of_transport: cost_of_transport(gait, total_mass_kg),
        })
    }
}

impl CertifiedGait {
    /// Subject, device and variant as text.
    pub fn walker_in_words(&self) -> String {
        let Subject { height_m, body_mass_kg } = self.subject;
        let muscles = if self.muscles { "with muscles" } else { "without muscles" };
        format!("subject: {height_m} m, {body_mass_kg} kg; device: {}; {muscles}", self.device)
    }
}
