//! How to read an EMG recording: channels, heel strikes, and the strides to leave out.

use super::file_format::{MeasurementFormat, WHAT, check_file_name};
use super::foot_strikes::FootStrikes;
use crate::error::{Error, FieldError};
use gait_optimizer::ModelError;
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
    /// Times of left heel strikes, s. The cycle of the left leg begins with them. If neither these times nor
    /// `left_heel_strike_column` are given, the left foot is taken to strike half a stride after the right one.
    pub left_heel_strikes_s: Vec<f64>,
    /// Column of a switch under the left heel, or of the vertical force under the left foot.
    pub left_heel_strike_column: Option<String>,
    /// Value of the columns of heel strikes, in their unit, above which a foot is on the ground.
    pub heel_strike_threshold: f64,
    /// Numbers of the strides to leave out, counted from 1 in the order of the right heel strikes. Strides of the left leg
    /// that overlap with them are left out too.
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
            left_heel_strikes_s: Vec::new(),
            left_heel_strike_column: None,
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
    pub fn read(&self, what: &str, text: &str) -> Result<(EmgRecording, FootStrikes), Error> {
        self.check_names()?;
        let whole = self.whole(what, text)?;
        Ok((self.selected(what, &whole)?, self.strikes(what, &whole)?))
    }

    /// Checks the names of the channels.
    fn check_names(&self) -> Result<(), Error> {
        match self.channels.keys().find(|name| !CHANNELS.contains(&name.as_str())) {
            None => Ok(()),
            Some(unknown) => {
                let allowed = format!("one of {}", CHANNELS.join(", "));
                Err(Error::invalid("reading.channels", unknown.as_str(), &allowed))
            }
        }
    }

    /// The columns of the channels.
    fn selected(&self, what: &str, whole: &EmgRecording) -> Result<EmgRecording, ModelError> {
        if self.channels.is_empty() {
            return whole.select(what, CHANNELS.map(|name| (name, name)));
        }
        whole.select(what, self.channels.iter().map(|(channel, column)| (channel.as_str(), column.as_str())))
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

    /// The heel strikes of both feet.
    pub(super) fn strikes(&self, what: &str, whole: &EmgRecording) -> Result<FootStrikes, Error> {
        let right_s = match (&self.heel_strike_column, &self.heel_strikes_s[..]) {
            (Some(column), []) => whole.strikes_of_column(what, column, self.heel_strike_threshold)?,
            (None, given @ [_, _, ..]) => {
                whole.check_strikes(what, given)?;
                given.to_vec()
            }
            (_, given) => {
                let allowed = "at least two heel-strike times, or none if a heel strike column is given";
                return Err(Error::invalid("reading.heel_strikes_s", json!(given), allowed));
            }
        };
        Ok(FootStrikes { right_s, left_s: self.left_strikes(what, whole)? })
    }

    /// The left heel strikes, s; `None`: not recorded.
    fn left_strikes(&self, what: &str, whole: &EmgRecording) -> Result<Option<Vec<f64>>, Error> {
        let of_field = |field: &'static str| move |error| Error::from(FieldError::from(error).renamed(what, field));
        match (&self.left_heel_strike_column, &self.left_heel_strikes_s[..]) {
            (None, []) => Ok(None),
            (Some(column), []) if self.heel_strike_column.as_ref() == Some(column) => {
                let field = "reading.left_heel_strike_column";
                Err(Error::invalid(field, column.as_str(), "another column than that of the right heel strikes"))
            }
            (Some(column), []) => {
                let strikes = whole.strikes_of_column(what, column, self.heel_strike_threshold);
                strikes.map(Some).map_err(of_field("reading.left_heel_strike_column"))
            }
            (None, given @ [_, _, ..]) => {
                let checked = whole.check_strikes(what, given);
                // A time outside the recording is named as a right heel strike.
                checked.map_err(|error| match FieldError::from(error) {
                    fault if fault.field == "heel_strikes_s" => {
                        Error::from(fault.renamed("heel_strikes_s", "reading.left_heel_strikes_s"))
                    }
                    fault => fault.renamed(what, "reading.left_heel_strikes_s").into(),
                })?;
                Ok(Some(given.to_vec()))
            }
            (_, given) => {
                let allowed = "at least two heel-strike times, or none if a column of left heel strikes is given";
                Err(Error::invalid("reading.left_heel_strikes_s", json!(given), allowed))
            }
        }
    }

    /// Checks that a file has EMG signals and can be cut into strides, for any filter settings.
    pub(super) fn check(&self, text: &str) -> Result<(), Error> {
        self.faults(text).into_iter().next().map_or(Ok(()), Err)
    }

    /// Everything that speaks against a file, as far as one fault does not hide another one.
    pub(super) fn faults(&self, text: &str) -> Vec<Error> {
        let mut faults: Vec<Error> = check_file_name(self.file_name.as_deref()).err().into_iter().collect();
        let whole = self.whole(WHAT, text).or_else(|error| {
            let is_of_rate = matches!(&error, Error::Invalid(fault) if fault.field.ends_with("rate_hz"));
            faults.push(error);
            // Without the wrong rate, the rest of a file with a time column can be checked.
            if is_of_rate { Self { rate_hz: None, ..self.clone() }.whole(WHAT, text).map_err(drop) } else { Err(()) }
        });
        let Ok(whole) = whole else { return faults };
        let selected = self.check_names().and_then(|()| {
            let of_channels = |error| FieldError::from(error).renamed(WHAT, "reading.channels").into();
            self.selected(WHAT, &whole).map_err(of_channels)
        });
        let strikes = self.strikes(WHAT, &whole).map_err(|error| match error {
            Error::Invalid(fault) if !fault.field.contains("left_") => {
                let of_column = self.heel_strike_column.is_some();
                let field = if of_column { "reading.heel_strike_column" } else { "reading.heel_strikes_s" };
                fault.renamed(WHAT, field).into()
            }
            other => other,
        });
        let checked = match (selected, strikes) {
            (Ok(recording), Ok(strikes)) => self.check_strides(recording, &strikes),
            (Ok(recording), Err(of_strikes)) => {
                faults.extend(recording.check_channels().err().map(Error::from));
                Err(of_strikes)
            }
            (Err(of_channels), strikes) => {
                faults.push(of_channels);
                strikes.map(drop)
            }
        };
        faults.extend(checked.err());
        faults
    }

    fn check_strides(&self, recording: EmgRecording, strikes: &FootStrikes) -> Result<(), Error> {
        let strides = self.kept_strides(strikes)?;
        recording.check_channels()?;
        for (channel, values) in recording.channels {
            let raw = Envelope { channel, start_s: recording.start_s, rate_hz: recording.rate_hz, values };
            CycleActivity::of_leg(&raw, &strides)?;
        }
        Ok(())
    }
}
