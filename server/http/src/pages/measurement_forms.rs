//! The forms of a lab session for measurement files and filter settings, as typed, and their parsed values.

use super::recording_preview::RecordingPreview;
use crate::refused_fields::{FieldLabels, RefusedFields, TypedForm};
use gait_optimizer::emg::{CHANNELS, EmgSettings, HIGHEST_RATE_HZ};
use gaitwright_service::error::Error;
use gaitwright_service::studies::lab::{EmgReading, JointAngleReading, MeasurementFormat, NewEmg, NewJointAngles};
use gaitwright_service::studies::reference_import::Unit;
use serde::Deserialize;
use std::collections::BTreeMap;
use std::str::FromStr;

/// The form for an EMG recording, as typed.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub(super) struct EmgFields {
    pub(super) walk: u8,
    pub(super) format: MeasurementFormat,
    pub(super) recording: String,
    pub(super) rate_hz: String,
    pub(super) channels: String,
    /// The column of each channel, chosen in the preview.
    #[serde(rename = "column_RF_L")]
    pub(super) column_rf_l: String,
    #[serde(rename = "column_TA_L")]
    pub(super) column_ta_l: String,
    #[serde(rename = "column_BF_L")]
    pub(super) column_bf_l: String,
    #[serde(rename = "column_GAS_L")]
    pub(super) column_gas_l: String,
    #[serde(rename = "column_RF_R")]
    pub(super) column_rf_r: String,
    #[serde(rename = "column_BF_R")]
    pub(super) column_bf_r: String,
    pub(super) heel_strikes_s: String,
    pub(super) heel_strike_column: String,
    pub(super) heel_strike_threshold: String,
    /// Numbers of strides, separated by commas.
    pub(super) rejected_strides: String,
    pub(super) file_name: String,
    /// `preview`, or else an upload.
    pub(super) button: String,
}

impl Default for EmgFields {
    fn default() -> Self {
        let reading = EmgReading::default();
        Self {
            walk: 0,
            format: reading.format,
            recording: String::new(),
            rate_hz: String::new(),
            channels: String::new(),
            column_rf_l: String::new(),
            column_ta_l: String::new(),
            column_bf_l: String::new(),
            column_gas_l: String::new(),
            column_rf_r: String::new(),
            column_bf_r: String::new(),
            rejected_strides: String::new(),
            file_name: String::new(),
            button: String::new(),
            heel_strikes_s: String::new(),
            heel_strike_column: String::new(),
            heel_strike_threshold: reading.heel_strike_threshold.to_string(),
        }
    }
}

impl EmgFields {
    pub(super) fn read(&self) -> Result<NewEmg, Error> {
        let reading = EmgReading {
            format: self.format,
            rate_hz: optional("rate_hz", &self.rate_hz)?,
            channels: self.columns()?,
            rejected_strides: list("rejected_strides", &self.rejected_strides)?,
            file_name: file_name(&self.file_name),
            heel_strikes_s: list("heel_strikes_s", &self.heel_strikes_s)?,
            heel_strike_column: Some(self.heel_strike_column.trim().to_owned()).filter(|name| !name.is_empty()),
            ..EmgReading::default()
        };
        let threshold = optional("heel_strike_threshold", &self.heel_strike_threshold)?;
        let heel_strike_threshold = threshold.unwrap_or(reading.heel_strike_threshold);
        Ok(NewEmg {
            walk: self.walk,
            recording: self.recording.clone(),
            reading: EmgReading { heel_strike_threshold, ..reading },
        })
    }
}

impl TypedForm for EmgFields {
    const LABELS: FieldLabels = &[
        ("walk", "Walk"),
        ("rate_hz", "Sampling rate, Hz"),
        ("recording", "File contents"),
        ("channels", "Channel columns"),
        ("heel_strikes_s", "Right heel strikes, s"),
        ("heel_strike_column", "Heel strike column"),
        ("heel_strike_threshold", "Contact threshold"),
        ("rejected_strides", "Rejected strides"),
        ("file_name", "File name"),
    ];

    fn repair(&mut self, field: &str) -> bool {
        match field {
            "rate_hz" => self.rate_hz.clear(),
            "channels" => self.channels.clear(),
            "heel_strikes_s" => self.heel_strikes_s.clear(),
            "heel_strike_threshold" => self.heel_strike_threshold.clear(),
            "rejected_strides" => self.rejected_strides.clear(),
            _ => return false,
        }
        true
    }
}

impl EmgFields {
    /// The column chosen for each channel.
    fn chosen(&self) -> [(&'static str, &str); 6] {
        let columns = [
            &self.column_rf_l,
            &self.column_ta_l,
            &self.column_bf_l,
            &self.column_gas_l,
            &self.column_rf_r,
            &self.column_bf_r,
        ];
        std::array::from_fn(|place| (CHANNELS[place], columns[place].as_str()))
    }

    /// Whether this column is chosen for this channel, or has its name.
    pub(super) fn is_column(&self, channel: &str, column: &str) -> bool {
        let chosen = self.columns().unwrap_or_default();
        if chosen.is_empty() { channel == column } else { chosen.get(channel).is_some_and(|known| known == column) }
    }

    /// The columns chosen in lists, or else those that are typed.
    fn columns(&self) -> Result<BTreeMap<String, String>, Error> {
        let chosen = self.chosen().into_iter().filter(|(_, column)| !column.is_empty());
        let chosen: BTreeMap<String, String> =
            chosen.map(|(channel, column)| (channel.into(), column.into())).collect();
        if chosen.is_empty() { pairs(&self.channels) } else { Ok(chosen) }
    }

    /// Whether the form asks for a preview only.
    pub(super) fn previews(&self) -> bool {
        self.button == "preview"
    }
}

/// The name of a file, without the folders that some browsers add.
fn file_name(text: &str) -> Option<String> {
    let name = text.rsplit(['/', '\\']).next().unwrap_or_default().trim();
    (!name.is_empty()).then(|| name.to_owned())
}

/// `TA_L=EMG 3, BF_L=EMG 5`.
fn pairs(text: &str) -> Result<BTreeMap<String, String>, Error> {
    let pair = |part: &str| {
        let refused = || Error::invalid("channels", part, "a list of CHANNEL=COLUMN pairs, separated by commas");
        let (channel, column) = part.split_once('=').ok_or_else(refused)?;
        Ok((channel.trim().to_owned(), column.trim().to_owned()))
    };
    text.split(',').filter(|part| !part.trim().is_empty()).map(pair).collect()
}

/// A type of number with its name in errors.
trait NamedNumber: FromStr {
    const NAME: &'static str;
}

impl NamedNumber for f64 {
    const NAME: &'static str = "a number";
}

impl NamedNumber for u32 {
    const NAME: &'static str = "a whole number of at least 0";
}

impl NamedNumber for usize {
    const NAME: &'static str = "a whole number of at least 0";
}

fn list<T: NamedNumber>(field: &str, text: &str) -> Result<Vec<T>, Error> {
    text.split(',').filter(|part| !part.trim().is_empty()).map(|part| number(field, part)).collect()
}

fn number<T: NamedNumber>(field: &str, text: &str) -> Result<T, Error> {
    text.trim().parse().map_err(|_| Error::invalid(field, text, T::NAME))
}

fn optional(field: &str, text: &str) -> Result<Option<f64>, Error> {
    if text.trim().is_empty() { Ok(None) } else { number(field, text).map(Some) }
}

/// The form for joint angles, as typed.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub(super) struct JointAngleFields {
    pub(super) walk: u8,
    pub(super) format: MeasurementFormat,
    pub(super) recording: String,
    pub(super) unit: String,
    pub(super) cutoff_hz: String,
    pub(super) file_name: String,
    /// `preview`, or else an upload.
    pub(super) button: String,
}

impl Default for JointAngleFields {
    fn default() -> Self {
        let JointAngleReading { format, cutoff_hz, .. } = JointAngleReading::default();
        let [recording, unit, file_name, button] = std::array::from_fn(|_| String::new());
        Self { walk: 0, format, recording, unit, cutoff_hz: cutoff_hz.to_string(), file_name, button }
    }
}

impl JointAngleFields {
    /// Whether the form asks for a preview only.
    pub(super) fn previews(&self) -> bool {
        self.button == "preview"
    }

    pub(super) fn read(&self) -> Result<NewJointAngles, Error> {
        let unit = match self.unit.as_str() {
            "" => None,
            "degrees" => Some(Unit::Degrees),
            "radians" => Some(Unit::Radians),
            other => return Err(Error::invalid("unit", other, "degrees, radians or empty")),
        };
        let cutoff_hz = optional("cutoff_hz", &self.cutoff_hz)?.unwrap_or(JointAngleReading::default().cutoff_hz);
        let reading = JointAngleReading { format: self.format, unit, cutoff_hz, file_name: file_name(&self.file_name) };
        Ok(NewJointAngles { walk: self.walk, recording: self.recording.clone(), reading })
    }
}

impl TypedForm for JointAngleFields {
    const LABELS: FieldLabels = &[
        ("walk", "Walk"),
        ("unit", "Angle unit of an OpenSim file"),
        ("cutoff_hz", "Low-pass cut-off, Hz"),
        ("file_name", "File name"),
        ("recording", "File contents"),
    ];

    fn repair(&mut self, field: &str) -> bool {
        match field {
            "unit" => self.unit.clear(),
            "cutoff_hz" => self.cutoff_hz.clear(),
            _ => return false,
        }
        true
    }
}

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
        settings.validate(HIGHEST_RATE_HZ)?;
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
    /// The preview of the EMG recording in the form.
    pub(super) preview: Option<PreviewedEmg>,
    /// The preview of the joint angles in the form.
    pub(super) joint_angle_preview: Option<RecordingPreview>,
}

impl Forms {
    /// The attributes of a refused field of this form. Two forms can have fields of the same name.
    pub(super) fn invalid(&self, form: &str, refused: &RefusedFields, field: &str) -> &'static str {
        if self.open == form { refused.invalid(field) } else { "" }
    }
}

/// A preview of an EMG recording, as the page shows it.
#[derive(Debug)]
pub(super) struct PreviewedEmg {
    pub(super) columns: Vec<String>,
    /// Each channel and its muscle.
    pub(super) channels: [(&'static str, &'static str); 6],
    pub(super) recording: RecordingPreview,
}
