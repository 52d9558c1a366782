//! One gait problem.

use crate::bounds::TunedBounds;
use crate::device::Device;
use crate::gait_problem::GaitProgramme;
use crate::reference::ReferenceGait;
use crate::settings::GaitSettings;
use crate::subject::{ModelError, Subject};
use serde::{Deserialize, Serialize};

/// One gait problem.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GaitProblem {
    /// Who walks.
    pub subject: Subject,
    /// With which prosthesis (right leg).
    pub device: Device,
    /// Tuned bounds a1..a8.
    pub bounds: TunedBounds,
    /// With muscles (C1-C12) or without (C1-C4).
    pub muscles: bool,
    /// Other settings of the problem.
    pub settings: GaitSettings,
    /// Reference for Gait RMSE and for the cold start.
    pub reference: ReferenceGait,
}

impl GaitProblem {
    /// A problem with the built-in device and reference, default bounds and settings.
    ///
    /// # Errors
    /// [`ModelError`] naming what is out of range.
    pub fn new(subject: Subject, muscles: bool) -> Result<Self, ModelError> {
        subject.validate()?;
        Ok(Self {
            subject,
            device: Device::ampro3()?,
            bounds: TunedBounds::default(),
            muscles,
            settings: GaitSettings::default(),
            reference: ReferenceGait::builtin()?,
        })
    }

    pub(crate) fn programme(&self, muscles: bool) -> Result<GaitProgramme, ModelError> {
        GaitProgramme::new(&self.subject, &self.device, &self.bounds, muscles, &self.settings, &self.reference)
    }
}
