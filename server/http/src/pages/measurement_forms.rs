//! The forms of a lab session for measurement files and filter settings, as typed, and their parsed values.

use gait_optimizer::emg::EmgSettings;
use gaitwright_service::error::Error;
use gaitwright_service::studies::lab::{EmgReading, MeasurementFormat, MotionReading, NewEmg, NewMotion};
use gaitwright_service::studies::reference_import::Unit;
use serde::Deserialize;
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
    pub(super) heel_strikes_s: String,
    pub(super) heel_strike_column: String,
    pub(super) heel_strike_threshold: String,
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
            channels: pairs(&self.channels)?,
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

/// `TA_L=EMG 3, BF_L=EMG 5`.
fn pairs(text: &str) -> Result<std::collections::BTreeMap<String, String>, Error> {
    let pair = |part: &str| {
        let refused = || Error::invalid("channels", part, "a list of CHANNEL=COLUMN pairs, separated by commas");
        let (channel, column) = part.split_once('=').ok_or_else(refused)?;
        Ok((channel.trim().to_owned(), column.trim().to_owned()))
    };
    text.split(',').filter(|part| !part.trim().is_empty()).map(pair).collect()
}

fn list(field: &str, text: &str) -> Result<Vec<f64>, Error> {
    text.split(',').filter(|part| !part.trim().is_empty()).map(|part| number(field, part)).collect()
}

fn number<T: FromStr>(field: &str, text: &str) -> Result<T, Error> {
    text.trim().parse().map_err(|_| Error::invalid(field, text, "a number"))
}

fn optional(field: &str, text: &str) -> Result<Option<f64>, Error> {
    if text.trim().is_empty() { Ok(None) } else { number(field, text).map(Some) }
}

/// The form for joint angles, as typed.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub(super) struct MotionFields {
    pub(super) walk: u8,
    pub(super) format: MeasurementFormat,
    pub(super) recording: String,
    pub(super) unit: String,
    pub(super) cutoff_hz: String,
}

impl Default for MotionFields {
    fn default() -> Self {
        let MotionReading { format, cutoff_hz, .. } = MotionReading::default();
        let (recording, unit) = (String::new(), String::new());
        Self { walk: 0, format, recording, unit, cutoff_hz: cutoff_hz.to_string() }
    }
}

impl MotionFields {
    pub(super) fn read(&self) -> Result<NewMotion, Error> {
        let unit = match self.unit.as_str() {
            "" => None,
            "degrees" => Some(Unit::Degrees),
            "radians" => Some(Unit::Radians),
            other => return Err(Error::invalid("unit", other, "degrees, radians or empty")),
        };
        let cutoff_hz = optional("cutoff_hz", &self.cutoff_hz)?.unwrap_or(MotionReading::default().cutoff_hz);
        let reading = MotionReading { format: self.format, unit, cutoff_hz };
        Ok(NewMotion { walk: self.walk, recording: self.recording.clone(), reading })
    }
}

/// The filter settings, as typed.
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub(super) struct Settings {
    pub(super) band_low_hz: String,
    pub(super) band_high_hz: String,
    pub(super) envelope_hz: String,
    pub(super) order: String,
}

impl Settings {
    pub(super) fn read(&self) -> Result<EmgSettings, Error> {
        Ok(EmgSettings {
            band_low_hz: number("band_low_hz", &self.band_low_hz)?,
            band_high_hz: number("band_high_hz", &self.band_high_hz)?,
            envelope_hz: number("envelope_hz", &self.envelope_hz)?,
            order: number("order", &self.order)?,
        })
    }
}

impl From<EmgSettings> for Settings {
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
    pub(super) motion: MotionFields,
    /// `None` for the settings of the last processing.
    pub(super) filters: Option<Settings>,
    /// The refused form: `emg`, `motion` or `filters`.
    pub(super) open: &'static str,
}
