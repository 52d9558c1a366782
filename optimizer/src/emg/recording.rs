//! Raw signals as recorded.

use super::{CycleActivity, EmgSettings, Envelope};
use crate::filter::{self, band_pass, low_pass};
use crate::opensim::StorageFile;
use crate::reference::{contacts, given};
use crate::subject::ModelError;
use crate::table::{Clock, Separator, Table, lines_of};

/// Sampling rates that are accepted where a file has no time, Hz.
const RATE_RANGE_HZ: (f64, f64) = (100.0, 20_000.0);
/// A sample farther from the median than so many times what 99 of 100 samples keep within is no muscle's: those of bursts
/// of activity reach about 10.
const FARTHEST_SAMPLE: f64 = 100.0;
/// A rectified signal is within this share of its RMS of zero ...
const NEAR_ZERO: f64 = 0.1;
/// ... for this share of its samples or more: 8 of 100 for noise. One that an offset lifts above zero is hardly there.
const OFTEN: f64 = 0.02;
/// Of a raw signal more than this share of its RMS about the mean is within the band: nine tenths of white noise, some
/// hundredths of an envelope of 6 to 10 Hz.
const LEAST_IN_BAND: f64 = 0.1;

/// Raw signals of several channels over the same time.
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
    /// A table with one column per channel, evenly sampled. Its first column is `time_s`, unless `rate_hz` says how many
    /// rows a second has. Lines that begin with `#` before the names are left out.
    ///
    /// # Errors
    /// [`ModelError::Malformed`] with line and column, [`ModelError::OutOfRange`] for a rate out of range.
    pub fn from_csv(what: &str, text: &str, rate_hz: Option<f64>) -> Result<Self, ModelError> {
        let clock = match rate_hz {
            Some(rate_hz) => Clock::Rate(checked_rate(rate_hz)?),
            None => Clock::Column("time_s"),
        };
        let lines = lines_of(text);
        let comments = lines.iter().take_while(|line| line.starts_with('#')).count();
        let table = Table::read(what, &lines[comments..], comments + 1, Separator::Comma, clock)?;
        if rate_hz.is_some()
            && let Some(time) = table.names().iter().find(|name| name.to_ascii_lowercase().starts_with("time"))
        {
            let reason = format!("the column {time:?} has the time: rate_hz is for files without one");
            return Err(table.malformed_names(reason));
        }
        Self::from_table(&table)
    }

    /// Columns of an OpenSim motion or storage file (.mot, .sto), evenly sampled.
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
            return Err(table.malformed_names("there is no channel beside the time".to_owned()));
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
        let known = || self.channels.iter().map(|(name, _)| name.as_str()).collect::<Vec<_>>().join(", ");
        let found = self.channels.iter().find(|(known, _)| known == name);
        found.map(|(_, samples)| &samples[..]).ok_or_else(|| ModelError::Malformed {
            what: what.to_owned(),
            reason: format!("column {name:?} is missing; there are {}", known()),
        })
    }

    /// The channels under the names that are wanted, each from a column of its own.
    ///
    /// # Errors
    /// [`ModelError::Malformed`] for a column that is missing or wanted twice.
    pub fn select<'a>(
        &self,
        what: &str,
        wanted: impl IntoIterator<Item = (&'a str, &'a str)>,
    ) -> Result<Self, ModelError> {
        let mut channels = Vec::new();
        let mut taken: Vec<(&str, &str)> = Vec::new();
        for (channel, column) in wanted {
            if let Some((other, _)) = taken.iter().find(|(_, known)| *known == column) {
                let reason =
                    format!("column {column:?} is wanted for {other} and for {channel}: each muscle has its own");
                return Err(ModelError::Malformed { what: what.to_owned(), reason });
            }
            channels.push((channel.to_owned(), self.column(what, column)?.to_vec()));
            taken.push((channel, column));
        }
        Ok(Self { start_s: self.start_s, rate_hz: self.rate_hz, channels })
    }

    /// Heel strikes, s: where the column of a foot switch or of a vertical force rises above the threshold.
    ///
    /// # Errors
    /// [`ModelError::Malformed`] for a column that is missing or tells of fewer than two.
    pub fn strikes_of_column(&self, what: &str, column: &str, threshold: f64) -> Result<Vec<f64>, ModelError> {
        let signal = self.column(what, column)?;
        let times: Vec<f64> = (0..signal.len()).map(|k| self.start_s + k as f64 / self.rate_hz).collect();
        let strikes = contacts(&times, signal, threshold);
        if strikes.len() < 2 {
            let reason =
                format!("column {column:?} rises {} times above {threshold}, two make a stride", strikes.len());
            return Err(ModelError::Malformed { what: what.to_owned(), reason });
        }
        Ok(strikes)
    }

    /// Checks heel strikes that were told, s.
    ///
    /// # Errors
    /// [`ModelError`] when they are not in order or not within the recording.
    pub fn check_strikes(&self, what: &str, heel_strikes_s: &[f64]) -> Result<(), ModelError> {
        given(what, heel_strikes_s, self.start_s, self.end_s())
    }

    /// Checks that every channel is the raw signal of a muscle: it changes, no sample stands far out of all others, and
    /// it was neither rectified nor smoothed.
    ///
    /// # Errors
    /// [`ModelError::Malformed`] naming the channel and the reason.
    pub fn check_channels(&self) -> Result<(), ModelError> {
        for (channel, samples) in &self.channels {
            if let Some(reason) = self.no_muscle(samples) {
                return Err(ModelError::Malformed { what: format!("channel {channel}"), reason });
            }
        }
        Ok(())
    }

    /// Why this is no raw signal of a muscle.
    fn no_muscle(&self, samples: &[f64]) -> Option<String> {
        let first = samples.first()?;
        if samples.iter().all(|sample| sample == first) {
            return Some(format!("every sample is {first}: nothing was connected"));
        }
        self.artefact(samples).or_else(|| self.smoothed(samples)).or_else(|| rectified(samples))
    }

    /// Why a channel would pass for active: one sample stands out of all others.
    fn artefact(&self, samples: &[f64]) -> Option<String> {
        let median = quantile(samples.to_vec(), 0.5);
        let kept_within = quantile(samples.iter().map(|sample| (sample - median).abs()).collect(), 0.99);
        let place = samples.iter().position(|sample| (sample - median).abs() > FARTHEST_SAMPLE * kept_within)?;
        let time_s = self.start_s + place as f64 / self.rate_hz;
        Some(format!(
            "{} at {time_s:.4} s is more than {FARTHEST_SAMPLE} times as far from the median as 99 of 100 samples are \
             ({kept_within:.3e}): an artefact that would pass for activity",
            samples[place]
        ))
    }

    /// Why a channel is an envelope: hardly anything of it is where the signals of muscles are.
    fn smoothed(&self, samples: &[f64]) -> Option<String> {
        let EmgSettings { band_low_hz, band_high_hz, order, .. } = EmgSettings::default();
        let half = 0.5 * self.rate_hz;
        let band_high_hz = band_high_hz.min(0.9 * half);
        if band_low_hz >= 0.9 * band_high_hz {
            return None; // too slow for this band: the settings of the filters are refused then
        }
        let band = band_pass(order, band_low_hz / half, band_high_hz / half);
        if samples.len() <= filter::extension(&band) {
            return None;
        }
        let mean = samples.iter().sum::<f64>() / samples.len() as f64;
        let about_mean: Vec<f64> = samples.iter().map(|sample| sample - mean).collect();
        let share = rms(&filter::filter(&band, &about_mean)) / rms(&about_mean);
        (share < LEAST_IN_BAND).then(|| {
            format!(
                "{:.1} % of the signal (RMS) is within {band_low_hz} to {band_high_hz} Hz, less than {:.0} %: an envelope \
                 or movement, where the raw signal is needed",
                100.0 * share,
                100.0 * LEAST_IN_BAND
            )
        })
    }

    /// The mean cycle of every channel, cut at heel strikes (s).
    ///
    /// # Errors
    /// As [`Self::envelopes`] and [`CycleActivity::cut`].
    pub fn cycles(&self, heel_strikes_s: &[f64], settings: &EmgSettings) -> Result<Vec<CycleActivity>, ModelError> {
        self.envelopes(settings)?.iter().map(|envelope| CycleActivity::cut(envelope, heel_strikes_s)).collect()
    }

    /// The envelope of every channel.
    ///
    /// # Errors
    /// [`ModelError`] naming a setting out of range, or when the recording is too short to be filtered.
    pub fn envelopes(&self, settings: &EmgSettings) -> Result<Vec<Envelope>, ModelError> {
        settings.validate(self.rate_hz)?;
        let share = |hz: f64| hz / (0.5 * self.rate_hz);
        let band = band_pass(settings.order, share(settings.band_low_hz), share(settings.band_high_hz));
        let smooth = low_pass(settings.order, share(settings.envelope_hz));
        let fewest = filter::extension(&band) + 1;
        self.channels
            .iter()
            .map(|(channel, samples)| {
                if samples.len() < fewest {
                    let reason = format!("{} samples, the filters need {fewest}", samples.len());
                    return Err(ModelError::Malformed { what: format!("channel {channel}"), reason });
                }
                let rectified: Vec<f64> = filter::filter(&band, samples).into_iter().map(f64::abs).collect();
                let values = filter::filter(&smooth, &rectified);
                Ok(Envelope { channel: channel.clone(), start_s: self.start_s, rate_hz: self.rate_hz, values })
            })
            .collect()
    }
}

/// Why a channel is no raw signal: it was rectified.
fn rectified(samples: &[f64]) -> Option<String> {
    if samples.iter().any(|sample| *sample < 0.0) {
        return None;
    }
    let near = NEAR_ZERO * rms(samples);
    let share = samples.iter().filter(|sample| **sample <= near).count() as f64 / samples.len() as f64;
    (share >= OFTEN).then(|| {
        format!(
            "it is never below zero and often at it ({:.0} of 100 samples): a rectified signal, where the raw one is \
             needed",
            100.0 * share
        )
    })
}

fn rms(values: &[f64]) -> f64 {
    (values.iter().map(|value| value.powi(2)).sum::<f64>() / values.len() as f64).sqrt()
}

/// The value below which a share of the values lies.
fn quantile(mut values: Vec<f64>, share: f64) -> f64 {
    values.sort_by(f64::total_cmp);
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // 0 <= place < length
    let place = (share * (values.len() - 1) as f64) as usize;
    values[place]
}

fn checked_rate(rate_hz: f64) -> Result<f64, ModelError> {
    ModelError::check_range("rate_hz", rate_hz, RATE_RANGE_HZ.0, RATE_RANGE_HZ.1)
}
