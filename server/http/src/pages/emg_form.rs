//! The form for an EMG recording, as typed, in the order of its steps: file, signals with heel strikes, muscles, strides.

use super::form_numbers::{file_name, given, list, optional};
use crate::refused_fields::{FieldLabels, TypedForm};
use gait_optimizer::emg::CHANNELS;
use gaitwright_service::error::Error;
use gaitwright_service::studies::lab::{EmgOverview, EmgReading, MeasurementFormat, NewEmg};
use serde::Deserialize;
use std::collections::BTreeMap;

/// A step of the form.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum EmgStep {
    /// Which file.
    File,
    /// Every column as recorded, with heel strikes.
    Signals,
    /// Which column has which muscle.
    Muscles,
    /// Which strides are left out, and the result.
    Strides,
}

impl EmgStep {
    pub(super) const ALL: [(Self, &'static str); 4] = [
        (Self::File, "File"),
        (Self::Signals, "Signals and heel strikes"),
        (Self::Muscles, "Muscles"),
        (Self::Strides, "Strides and result"),
    ];
}

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
    pub(super) left_heel_strikes_s: String,
    pub(super) left_heel_strike_column: String,
    pub(super) heel_strike_threshold: String,
    /// Numbers of strides, separated by commas.
    pub(super) rejected_strides: String,
    pub(super) file_name: String,
    /// `signals`, `muscles` or `preview` for a step, or else an upload.
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
            left_heel_strikes_s: String::new(),
            left_heel_strike_column: String::new(),
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
            heel_strike_column: given(&self.heel_strike_column),
            left_heel_strikes_s: list("left_heel_strikes_s", &self.left_heel_strikes_s)?,
            left_heel_strike_column: given(&self.left_heel_strike_column),
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
        ("channels", "Muscles"),
        ("heel_strikes_s", "Right heel strikes, s"),
        ("heel_strike_column", "Heel strike column"),
        ("heel_strike_threshold", "Contact threshold"),
        ("left_heel_strike_column", "Left heel strike column"),
        ("left_heel_strikes_s", "Left heel strikes, s"),
        ("rejected_strides", "Rejected strides"),
        ("file_name", "File name"),
    ];

    fn repair(&mut self, field: &str) -> bool {
        match field {
            "rate_hz" => self.rate_hz.clear(),
            "channels" => self.channels.clear(),
            "heel_strikes_s" => self.heel_strikes_s.clear(),
            "left_heel_strikes_s" => self.left_heel_strikes_s.clear(),
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

    /// The step that the form asks for; `None`: the upload.
    pub(super) fn asks_for(&self) -> Option<EmgStep> {
        match self.button.as_str() {
            "signals" => Some(EmgStep::Signals),
            "muscles" => Some(EmgStep::Muscles),
            "preview" => Some(EmgStep::Strides),
            _ => None,
        }
    }

    /// Fills in what was guessed about the file, where nothing was given.
    pub(super) fn fill_in(&mut self, overview: &EmgOverview) {
        if let Some(guess) = &overview.guessed_strikes {
            self.heel_strike_column.clone_from(&guess.column);
            self.heel_strike_threshold = guess.threshold.to_string();
        }
        if self.columns().is_ok_and(|known| known.is_empty()) {
            for (channel, column) in &overview.guessed_channels {
                if let Some(chosen) = self.column_mut(channel) {
                    chosen.clone_from(column);
                }
            }
        }
    }

    fn column_mut(&mut self, channel: &str) -> Option<&mut String> {
        let columns = [
            &mut self.column_rf_l,
            &mut self.column_ta_l,
            &mut self.column_bf_l,
            &mut self.column_gas_l,
            &mut self.column_rf_r,
            &mut self.column_bf_r,
        ];
        CHANNELS.iter().zip(columns).find(|(known, _)| **known == channel).map(|(_, column)| column)
    }

    /// The entries of later steps, to keep them in a form that does not show them: name and value.
    pub(super) fn kept_from(&self, step: EmgStep) -> Vec<(String, &str)> {
        let named = |name: &str, value| (name.to_owned(), value);
        let mut kept = Vec::new();
        if step < EmgStep::Signals {
            kept.extend([
                named("heel_strikes_s", self.heel_strikes_s.as_str()),
                named("heel_strike_column", &self.heel_strike_column),
                named("heel_strike_threshold", &self.heel_strike_threshold),
                named("left_heel_strikes_s", &self.left_heel_strikes_s),
                named("left_heel_strike_column", &self.left_heel_strike_column),
            ]);
        }
        if step < EmgStep::Muscles {
            kept.push(named("channels", &self.channels));
            kept.extend(self.chosen().map(|(channel, column)| (format!("column_{channel}"), column)));
        }
        if step < EmgStep::Strides {
            kept.push(named("rejected_strides", &self.rejected_strides));
        }
        kept.retain(|(_, value)| !value.is_empty());
        kept
    }
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
