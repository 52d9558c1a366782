//! The form for joint angles of a walk in the lab, as typed.

use super::angle_columns_form::AngleColumnFields;
use super::form_numbers::{file_name, optional};
use crate::refused_fields::{FieldLabels, TypedForm};
use gaitwright_service::error::Error;
use gaitwright_service::studies::lab::{JointAngleReading, MeasurementFormat, NewJointAngles};
use gaitwright_service::studies::reference_import::Unit;
use serde::Deserialize;

/// A step of the form.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum JointAngleStep {
    /// Which file.
    File,
    /// Which column has which angle, unless the names of the columns tell it.
    Columns,
    /// The limit cycles.
    Result,
}

impl JointAngleStep {
    pub(super) const ALL: [(Self, &'static str); 3] =
        [(Self::File, "File"), (Self::Columns, "Columns"), (Self::Result, "Result")];
}

/// The form for joint angles, as typed.
#[derive(Debug, Clone, Deserialize)]
#[serde(default)]
pub(super) struct JointAngleFields {
    pub(super) walk: u8,
    pub(super) format: MeasurementFormat,
    pub(super) recording: String,
    pub(super) unit: String,
    pub(super) cutoff_hz: String,
    pub(super) file_name: String,
    /// `preview` or `columns`, or else an upload.
    pub(super) button: String,
    #[serde(flatten)]
    pub(super) columns: AngleColumnFields,
}

impl Default for JointAngleFields {
    fn default() -> Self {
        let JointAngleReading { format, cutoff_hz, .. } = JointAngleReading::default();
        let [recording, unit, file_name, button] = std::array::from_fn(|_| String::new());
        let columns = AngleColumnFields::default();
        Self { walk: 0, format, recording, unit, cutoff_hz: cutoff_hz.to_string(), file_name, button, columns }
    }
}

impl JointAngleFields {
    /// Whether the form asks for the upload.
    pub(super) fn uploads(&self) -> bool {
        !["preview", "columns"].contains(&self.button.as_str())
    }

    pub(super) fn read(&self) -> Result<NewJointAngles, Error> {
        let unit = match self.unit.as_str() {
            "" => None,
            "degrees" => Some(Unit::Degrees),
            "radians" => Some(Unit::Radians),
            other => return Err(Error::invalid("unit", other, "degrees, radians or empty")),
        };
        let cutoff_hz = optional("cutoff_hz", &self.cutoff_hz)?.unwrap_or(JointAngleReading::default().cutoff_hz);
        let (columns, file_name) = (self.columns.read()?, file_name(&self.file_name));
        let reading = JointAngleReading { format: self.format, unit, columns, cutoff_hz, file_name };
        Ok(NewJointAngles { walk: self.walk, recording: self.recording.clone(), reading })
    }
}

impl TypedForm for JointAngleFields {
    const LABELS: FieldLabels = &[
        ("walk", "Walk"),
        ("unit", "Unit of the angles"),
        ("cutoff_hz", "Low-pass cut-off, Hz"),
        ("columns", "Columns of the angles"),
        ("file_name", "File name"),
        ("recording", "File contents"),
    ];

    fn repair(&mut self, field: &str) -> bool {
        match field {
            "unit" => self.unit.clear(),
            "columns" => self.columns = AngleColumnFields::default(),
            "cutoff_hz" => self.cutoff_hz.clear(),
            _ => return false,
        }
        true
    }
}
