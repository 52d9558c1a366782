//! How to read an EMG recording: channels, heel strikes, and the strides to leave out.

use super::file_format::{MeasurementFormat, WHAT, check_file_name};
use crate::error::Error;
use gait_optimizer::emg::{CHANNELS, CycleActivity, EmgRecording, Envelope};
use serde::{Deserialize, Serialize};
use serde_json::json;
use std::collections::BTreeMap;
use utoipa::ToSchema;

/// How to read an EMG recording.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, ToSchema)]
#[serde(deny_unknown_fields, default)]
pub struct EmgReading {
    /// File format.
    pub format: MeasurementFormat,
    /// Sampling rate of a CSV file without a `time_s` column, Hz.
    #[schema(minimum = 100, maximum = 20000)]
    pub rate_hz: Option<f64>,
    /// Column of each channel (RF_L, TA_L, BF_L, GAS_L, RF_R, BF_R). By default the columns have the names of the
    /// channels.
    pub channels: BTreeMap<String, String>,
    /// Times of right heel strikes, s, on the time axis of the file. If empty, they are detected in `heel_strike_column`.
    pub heel_strikes_s: Vec<f64>,
    /// Column of a switch under the right heel, or of the vertical force under the right foot.
    pub heel_strike_column: Option<String>,
    /// Value of `heel_strike_column`, in the unit of the column, above which the foot is on the ground.
    pub heel_strike_threshold: f64,
    /// Numbers of strides to leave out, from 1, in the order of the heel strikes.
    pub rejected_strides: Vec<u32>,
    /// Name of the file, as it is shown.
    #[schema(max_length = 200)]
    pub file_name: Option<String>,
}

impl Default for EmgReading {
    fn default() -> Self {
        Self {
            format: MeasurementFormat::default(),
            rate_hz: None,
            channels: BTreeMap::new(),
            heel_strikes_s: Vec::new(),
            heel_strike_column: None,
            heel_strike_threshold: 0.5,
            rejected_strides: Vec::new(),
            file_name: None,
        }
    }
}

impl EmgReading {
    /// Reads channels and heel strikes. `what` names the file in errors.
    ///
    /// # Errors
    /// [`Error::Invalid`] with line and column, or the field.
    pub fn read(&self, what: &str, text: &str) -> Result<(EmgRecording, Vec<f64>), Error> {
        if let Some(unknown) = self.channels.keys().find(|name| !CHANNELS.contains(&name.as_str())) {
            return Err(Error::invalid(
                "reading.channels",
                unknown.as_str(),
                &format!("one of {}", CHANNELS.join(", ")),
            ));
        }
        let whole = self.whole(what, text)?;
        let same = CHANNELS.map(|name| (name, name));
        let named = self.channels.iter().map(|(channel, column)| (channel.as_str(), column.as_str()));
        let recording = if self.channels.is_empty() { whole.select(what, same)? } else { whole.select(what, named)? };
        let strikes = self.strikes(what, &whole)?;
        Ok((recording, strikes))
    }

    /// Every column of the file.
    pub(super) fn whole(&self, what: &str, text: &str) -> Result<EmgRecording, Error> {
        Ok(match (self.format, self.rate_hz) {
            (MeasurementFormat::Csv, rate_hz) => EmgRecording::from_csv(what, text, rate_hz)?,
            (MeasurementFormat::Opensim, None) => EmgRecording::from_opensim(what, text)?,
            (MeasurementFormat::Opensim, Some(rate_hz)) => {
                return Err(Error::invalid(
                    "reading.rate_hz",
                    rate_hz,
                    "omitted, because an OpenSim file has its own time axis",
                ));
            }
        })
    }

    /// The right heel strikes, s.
    pub(super) fn strikes(&self, what: &str, whole: &EmgRecording) -> Result<Vec<f64>, Error> {
        Ok(match (&self.heel_strike_column, &self.heel_strikes_s[..]) {
            (Some(column), []) => whole.strikes_of_column(what, column, self.heel_strike_threshold)?,
            (None, given @ [_, _, ..]) => {
                whole.check_strikes(what, given)?;
                given.to_vec()
            }
            (_, given) => {
                let allowed = "at least two heel-strike times, or none if a heel strike column is given";
                return Err(Error::invalid("reading.heel_strikes_s", json!(given), allowed));
            }
        })
    }

    /// Checks that a file has EMG signals and can be cut into strides, for any filter settings.
    pub(super) fn check(&self, text: &str) -> Result<(), Error> {
        check_file_name(self.file_name.as_deref())?;
        let (recording, strikes) = self.read(WHAT, text)?;
        let strides = self.kept_strides(&strikes)?;
        recording.check_channels()?;
        for (channel, values) in recording.channels {
            let raw = Envelope { channel, start_s: recording.start_s, rate_hz: recording.rate_hz, values };
            CycleActivity::of_strides(&raw, &strides)?;
        }
        Ok(())
    }
}
