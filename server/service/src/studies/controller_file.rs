//! Controller files. Only a walkable gait has one, so there is none for a gait that was reported as unsafe.

use super::walkable::{Certified, WalkableGait};
use crate::error::Error;
use gait_optimizer::Gait;
use gait_optimizer::export::ControllerFile;

impl WalkableGait {
    /// The controller file of this gait, which states whether its certificate passed. `gait` is [`Self::trajectory`].
    ///
    /// # Errors
    /// [`Error::Invalid`] for a rate out of range.
    pub fn controller_file(&self, gait: &Gait, rate_hz: f64) -> Result<String, Error> {
        let certificate_passed = Some(self.certified() == Certified::Passed);
        pretty(&ControllerFile { certificate_passed, ..ControllerFile::new(gait, rate_hz)? })
    }

    /// The controller file of this gait for a blinded walk, without anything that names the gait.
    ///
    /// # Errors
    /// [`Error::Invalid`] for a rate out of range.
    pub fn blinded_controller_file(&self, gait: &Gait, rate_hz: f64) -> Result<String, Error> {
        pretty(&ControllerFile::new(gait, rate_hz)?)
    }
}

fn pretty(file: &ControllerFile) -> Result<String, Error> {
    serde_json::to_string_pretty(file).map_err(|e| Error::Internal(e.to_string()))
}
