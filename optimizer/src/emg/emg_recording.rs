//! Raw EMG signals of a file, and heel strikes in it.

use super::muscle_of;
use crate::model_error::ModelError;
use crate::opensim_reading::StorageFile;
use crate::reference::{MIN_CONTACT_S, MIN_SWING_S, contacts, given};
use crate::table::{Separator, Table, TimeColumn, lines_of};

/// Lowest sampling rate of a file without a time column, Hz.
const MIN_RATE_HZ: f64 = 100.0;
/// Highest sampling rate of a file without a time column, Hz. At this rate filter settings have their widest ranges.
pub const MAX_RATE_HZ: f64 = 20_000.0;

/// Raw signals of several channels with common times.
#[derive(Debug, Clone, PartialEq)]
pub struct EmgRecording {
    /// Time of the first sample, s.
    pub start_s: f64,
    /// Samples per second.
    pub rate_hz: f64,
    /// Name and samples of each channel.
    pub channels: Vec<(String, Vec<f64>)>,
}

impl EmgRecording {
    /// Parses an evenly sampled table with one column for each channel. The first column is `time_s`, unless `rate_hz`
    /// gives the rows per second. Skips lines that begin with `#` before the names.
    ///
    /// # Errors
    /// [`ModelError::Malformed`] with line and column, [`ModelError::OutOfRange`] for a rate out of range.
    pub fn from_csv(what: &str, text: &str, rate_hz: Option<f64>) -> Result<Self, ModelError> {
        let clock = match rate_hz {
            Some(rate_hz) => TimeColumn::Rate(checked_rate(rate_hz)?),
            None => TimeColumn::Column("time_s"),
        };
        let lines = lines_of(text);
        let comments = lines.iter().take_while(|line| line.starts_with('#')).count();
        let table = Table::read(what, &lines[comments..], comments + 1, Separator::Comma, clock)?;
        if rate_hz.is_some()
            && let Some(time) = table.names().iter().find(|name| name.to_ascii_lowercase().starts_with("time"))
        {
            let reason =
                format!("the file has a time column, {time:?}; give a sampling rate only for a file without one");
            return Err(table.malformed_names(reason));
        }
        Self::from_table(&table)
    }

    /// Parses an evenly sampled OpenSim motion or storage file (.mot, .sto).
    ///
    /// # Errors
    /// [`ModelError::Malformed`] with line and column.
    pub fn from_opensim(what: &str, text: &str) -> Result<Self, ModelError> {
        Self::from_table(&StorageFile::read(what, text)?.table)
    }

    fn from_table(table: &Table) -> Result<Self, ModelError> {
        let rate_hz = table.even_rate_hz()?;
        let channels: Vec<(String, Vec<f64>)> =
            table.names().iter().filter_map(|name| Some((name.clone(), table.find(name)?))).collect();
        if channels.is_empty() {
            return Err(table.malformed_names("the file has a time column but no channels".to_owned()));
        }
        Ok(Self { start_s: table.times()[0], rate_hz, channels })
    }

    /// Time of the last sample, s.
    pub fn end_s(&self) -> f64 {
        self.start_s + (self.samples() - 1) as f64 / self.rate_hz
    }

    fn samples(&self) -> usize {
        self.channels.first().map_or(1, |(_, samples)| samples.len())
    }

    fn column(&self, what: &str, name: &str) -> Result<&[f64], ModelError> {
        self.find(name).ok_or_else(|| self.missing(what, &[format!("{name:?}")]))
    }

    fn find(&self, name: &str) -> Option<&[f64]> {
        self.channels.iter().find(|(known, _)| known == name).map(|(_, samples)| &samples[..])
    }

    fn missing(&self, what: &str, columns: &[String]) -> ModelError {
        let known = self.channels.iter().map(|(name, _)| name.as_str()).collect::<Vec<_>>().join(", ");
        let missing = match columns {
            [one] => format!("column {one} is missing"),
            [first @ .., last] => format!("columns {} and {last} are missing", first.join(", ")),
            [] => String::new(),
        };
        ModelError::Malformed { what: what.to_owned(), reason: format!("{missing}; the columns are {known}") }
    }

    /// Selects columns and renames them to channels.
    ///
    /// # Errors
    /// [`ModelError::Malformed`] for columns that are missing, all of them at once, or for one that is selected twice.
    pub fn select<'a>(
        &self,
        what: &str,
        wanted: impl IntoIterator<Item = (&'a str, &'a str)>,
    ) -> Result<Self, ModelError> {
        let (mut channels, mut missing) = (Vec::new(), Vec::new());
        let mut taken: Vec<(&str, &str)> = Vec::new();
        for (channel, column) in wanted {
            if let Some((other, _)) = taken.iter().find(|(_, known)| *known == column) {
                let reason = format!(
                    "column {column:?} is selected for both {other} and {channel}; each channel needs its own column"
                );
                return Err(ModelError::Malformed { what: what.to_owned(), reason });
            }
            match (self.find(column), muscle_of(channel)) {
                (Some(samples), _) => channels.push((channel.to_owned(), samples.to_vec())),
                (None, Some(muscle)) => missing.push(format!("{column:?} ({muscle})")),
                (None, None) => missing.push(format!("{column:?}")),
            }
            taken.push((channel, column));
        }
        if !missing.is_empty() {
            return Err(self.missing(what, &missing));
        }
        Ok(Self { start_s: self.start_s, rate_hz: self.rate_hz, channels })
    }

    /// Heel strikes, s: the times at which a foot switch or a vertical force rises above a threshold.
    ///
    /// # Errors
    /// [`ModelError::Malformed`] if the column is missing or has fewer than two heel strikes.
    pub fn strikes_of_column(&self, what: &str, column: &str, threshold: f64) -> Result<Vec<f64>, ModelError> {
        let signal = self.column(what, column)?;
        let times: Vec<f64> = (0..signal.len()).map(|k| self.start_s + k as f64 / self.rate_hz).collect();
        let strikes = contacts(&times, signal, threshold);
        if strikes.len() < 2 {
            let found = match strikes.len() {
                0 => "no heel strike",
                _ => "only one heel strike",
            };
            let reason = format!(
                "column {column:?} has {found}; a stride needs two. A heel strike is a rise above {threshold} that lasts at least \
                 {MIN_CONTACT_S} s, after at least {MIN_SWING_S} s below"
            );
            return Err(ModelError::Malformed { what: what.to_owned(), reason });
        }
        Ok(strikes)
    }

    /// Checks given heel strikes, s.
    ///
    /// # Errors
    /// [`ModelError`] if they do not increase or are outside the recording.
    pub fn check_strikes(&self, what: &str, heel_strikes_s: &[f64]) -> Result<(), ModelError> {
        given(what, heel_strikes_s, self.start_s, self.end_s())
    }
}

fn checked_rate(rate_hz: f64) -> Result<f64, ModelError> {
    ModelError::check_range("rate_hz", rate_hz, MIN_RATE_HZ, MAX_RATE_HZ)
}
