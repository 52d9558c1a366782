//! The definition of a gait problem: subject, device, bounds, variant, settings and reference gait.

use super::program_data::GaitProgram;
use crate::device::Device;
use crate::model_error::ModelError;
use crate::reference::ReferenceGait;
use crate::settings::GaitSettings;
use crate::subject::Subject;
use crate::tuned_bounds::TunedBounds;
use serde::{Deserialize, Serialize};

/// The data of a gait problem.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GaitProblem {
    /// The subject.
    pub subject: Subject,
    /// The device on the right leg.
    pub device: Device,
    /// The tuned bounds.
    pub bounds: TunedBounds,
    /// Whether the problem has muscles (C1 to C12) or not (C1 to C4).
    pub muscles: bool,
    /// Other settings of the problem.
    pub settings: GaitSettings,
    /// The reference gait, for Gait RMSE and for initial guesses.
    pub reference: ReferenceGait,
}

impl GaitProblem {
    /// A problem with the built-in device and reference gait, default bounds and default settings.
    ///
    /// # Errors
    /// [`ModelError`] with the field that is out of range.
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

    pub(crate) fn program(&self, muscles: bool) -> Result<GaitProgram, ModelError> {
        GaitProgram::new(&self.subject, &self.device, &self.bounds, muscles, &self.settings, &self.reference)
    }
}
