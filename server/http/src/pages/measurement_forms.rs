//! The forms of a lab session for measurement files and filter settings, to show a refused one again.

use super::angle_columns_form::ColumnsPage;
use super::emg_form::{EmgFields, EmgStep};
use super::emg_signals::SignalsPreview;
use super::form_numbers::number;
use super::joint_angle_form::{JointAngleFields, JointAngleStep};
use super::recording_preview::RecordingPreview;
use crate::refused_fields::{FieldLabels, RefusedFields, TypedForm};
use gait_optimizer::emg::{EmgSettings, MAX_RATE_HZ};
use gaitwright_service::error::Error;
use serde::Deserialize;

/// The filter settings, as typed.
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub(super) struct FilterFields {
    pub(super) band_low_hz: String,
    pub(super) band_high_hz: String,
    pub(super) envelope_hz: String,
    pub(super) order: String,
}

impl FilterFields {
    fn read(&self) -> Result<EmgSettings, Error> {
        Ok(EmgSettings {
            band_low_hz: number("band_low_hz", &self.band_low_hz)?,
            band_high_hz: number("band_high_hz", &self.band_high_hz)?,
            envelope_hz: number("envelope_hz", &self.envelope_hz)?,
            order: number("order", &self.order)?,
        })
    }
}

impl FilterFields {
    /// The settings, as far as they can be checked without a recording.
    pub(super) fn read_and_check(&self) -> Result<EmgSettings, Error> {
        let settings = self.read()?;
        settings.validate(MAX_RATE_HZ)?;
        Ok(settings)
    }
}

impl TypedForm for FilterFields {
    const LABELS: FieldLabels = &[
        ("band_low_hz", "Band-pass from, Hz"),
        ("band_high_hz", "Band-pass to, Hz"),
        ("envelope_hz", "Low-pass cut-off, Hz"),
        ("order", "Filter order"),
    ];

    /// The widest band, so that the other edge is not refused because of it.
    fn repair(&mut self, field: &str) -> bool {
        match field {
            "band_low_hz" => "1".clone_into(&mut self.band_low_hz),
            "band_high_hz" => "1000".clone_into(&mut self.band_high_hz),
            "envelope_hz" => "6".clone_into(&mut self.envelope_hz),
            "order" => "4".clone_into(&mut self.order),
            _ => return false,
        }
        true
    }
}

impl From<EmgSettings> for FilterFields {
    fn from(settings: EmgSettings) -> Self {
        Self {
            band_low_hz: settings.band_low_hz.to_string(),
            band_high_hz: settings.band_high_hz.to_string(),
            envelope_hz: settings.envelope_hz.to_string(),
            order: settings.order.to_string(),
        }
    }
}

/// The forms as typed, to show a refused one again.
#[derive(Debug, Default)]
pub(super) struct Forms {
    pub(super) emg: EmgFields,
    pub(super) joint_angles: JointAngleFields,
    /// `None` for the settings of the last processing.
    pub(super) filters: Option<FilterFields>,
    /// The refused form: `emg`, `joint_angles` or `filters`.
    pub(super) open: &'static str,
    /// The step of the form for EMG that the page shows; `None`: the first one.
    pub(super) emg_step: Option<EmgPage>,
    /// The columns of the joint angles in the form, if they are chosen.
    pub(super) joint_angle_columns: Option<ColumnsPage>,
    /// The preview of the joint angles in the form.
    pub(super) joint_angle_preview: Option<RecordingPreview>,
}

impl Forms {
    /// The attributes of a refused field of this form. Two forms can have fields of the same name.
    pub(super) fn invalid(&self, form: &str, refused: &RefusedFields, field: &str) -> &'static str {
        if self.open == form { refused.invalid(field) } else { "" }
    }

    /// The step of the form for EMG.
    pub(super) fn step(&self) -> EmgStep {
        self.emg_step.as_ref().map_or(EmgStep::File, |page| page.step)
    }

    /// The step of the form for joint angles.
    pub(super) fn joint_angle_step(&self) -> JointAngleStep {
        match (&self.joint_angle_columns, &self.joint_angle_preview) {
            (_, Some(_)) => JointAngleStep::Result,
            (Some(_), None) => JointAngleStep::Columns,
            (None, None) => JointAngleStep::File,
        }
    }

    /// The entries for EMG of later steps than the one that is shown.
    pub(super) fn kept_emg(&self) -> Vec<(String, &str)> {
        self.emg.kept_from(self.step())
    }
}

/// A step of the form for EMG, as the page shows it.
#[derive(Debug)]
pub(super) struct EmgPage {
    pub(super) step: EmgStep,
    /// Columns, duration and sampling rate of the file, in words.
    pub(super) facts: String,
    pub(super) columns: Vec<String>,
    /// Each channel and its muscle.
    pub(super) channels: [(&'static str, &'static str); 6],
    /// Every column as recorded.
    pub(super) signals: SignalsPreview,
    /// The strides and the result, in the last step.
    pub(super) recording: Option<RecordingPreview>,
}
