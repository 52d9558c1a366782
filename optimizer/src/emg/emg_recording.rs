//! Raw EMG signals, and the checks that they are raw.

use super::{CycleActivity, EmgSettings, Envelope, strides_between};
use crate::model_error::ModelError;
use crate::opensim::StorageFile;
use crate::reference::{contacts, given};
use crate::signal_filter::{self, band_pass, low_pass};
use crate::table::{Separator, Table, TimeColumn, lines_of};

/// Allowed sampling rates of a file without a time column, Hz.
const RATE_RANGE_HZ: (f64, f64) = (100.0, 20_000.0);
/// Largest plausible distance of a sample from the median, as a multiple of the 99th percentile of these distances.
/// Bursts of activity reach about 10.
const FARTHEST_SAMPLE: f64 = 100.0;
/// Distance from zero, as a share of the RMS, within which a sample counts as zero ...
const NEAR_ZERO: f64 = 0.1;
/// ... and the share of such samples from which a non-negative signal counts as rectified. For noise it is 8 %; a raw
/// signal with an offset has almost none.
const OFTEN: f64 = 0.02;
/// Smallest share of the RMS of a raw signal within the band of the filter. White noise has about 90 %, an envelope of
/// 6 to 10 Hz a few per cent.
const LEAST_IN_BAND: f64 = 0.1;

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
            let reason = format!("the file has a time column, {time:?}; a sampling rate is for files without one");
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
            return Err(table.malformed_names("the file has no channel, only the time".to_owned()));
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
            reason: format!("column {name:?} is missing; the columns are {}", known()),
        })
    }

    /// Selects columns and renames them to channels.
    ///
    /// # Errors
    /// [`ModelError::Malformed`] for a column that is missing or selected twice.
    pub fn select<'a>(
        &self,
        what: &str,
        wanted: impl IntoIterator<Item = (&'a str, &'a str)>,
    ) -> Result<Self, ModelError> {
        let mut channels = Vec::new();
        let mut taken: Vec<(&str, &str)> = Vec::new();
        for (channel, column) in wanted {
            if let Some((other, _)) = taken.iter().find(|(_, known)| *known == column) {
                let reason = format!(
                    "column {column:?} is selected for both {other} and {channel}; each channel needs its own column"
                );
                return Err(ModelError::Malformed { what: what.to_owned(), reason });
            }
            channels.push((channel.to_owned(), self.column(what, column)?.to_vec()));
            taken.push((channel, column));
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
            let reason = format!("column {column:?} has {found} (a rise above {threshold}); a stride needs two");
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

    /// Checks that each channel is a raw muscle signal: not constant, without outliers, neither rectified nor smoothed.
    ///
    /// # Errors
    /// [`ModelError::Malformed`] with the channel and the reason.
    pub fn check_channels(&self) -> Result<(), ModelError> {
        for (channel, samples) in &self.channels {
            if let Some(reason) = self.no_muscle(samples) {
                return Err(ModelError::Malformed { what: format!("channel {channel}"), reason });
            }
        }
        Ok(())
    }

    /// The reason why a channel is not a raw muscle signal, if any.
    fn no_muscle(&self, samples: &[f64]) -> Option<String> {
        let first = samples.first()?;
        if samples.iter().all(|sample| sample == first) {
            return Some(format!("every sample is {first}; check that the electrode was connected"));
        }
        self.artefact(samples).or_else(|| self.smoothed(samples)).or_else(|| rectified(samples))
    }

    /// Finds an outlier, which would inflate the activity.
    fn artefact(&self, samples: &[f64]) -> Option<String> {
        let median = quantile(samples.to_vec(), 0.5);
        let kept_within = quantile(samples.iter().map(|sample| (sample - median).abs()).collect(), 0.99);
        let place = samples.iter().position(|sample| (sample - median).abs() > FARTHEST_SAMPLE * kept_within)?;
        let time_s = self.start_s + place as f64 / self.rate_hz;
        Some(format!(
            "the sample {} at {time_s:.4} s is an artefact: it is more than {FARTHEST_SAMPLE} times as far from the median as 99 % of \
             the samples ({kept_within:.3e})",
            samples[place]
        ))
    }

    /// Detects an envelope, which has little signal in the frequency band of muscles.
    fn smoothed(&self, samples: &[f64]) -> Option<String> {
        let EmgSettings { band_low_hz, band_high_hz, order, .. } = EmgSettings::default();
        let half = 0.5 * self.rate_hz;
        let band_high_hz = band_high_hz.min(0.9 * half);
        if band_low_hz >= 0.9 * band_high_hz {
            return None; // The check of the settings rejects such a sampling rate.
        }
        let band = band_pass(order, band_low_hz / half, band_high_hz / half);
        if samples.len() <= signal_filter::extension(&band) {
            return None;
        }
        let mean = samples.iter().sum::<f64>() / samples.len() as f64;
        let about_mean: Vec<f64> = samples.iter().map(|sample| sample - mean).collect();
        let share = rms(&signal_filter::filter(&band, &about_mean)) / rms(&about_mean);
        (share < LEAST_IN_BAND).then(|| {
            format!(
                "{:.1} % of the signal (RMS) is within {band_low_hz} to {band_high_hz} Hz, less than {:.0} %. It looks \
                 like an envelope or movement, but the raw signal is needed",
                100.0 * share,
                100.0 * LEAST_IN_BAND
            )
        })
    }

    /// The mean gait cycle of each channel, segmented at heel strikes in s.
    ///
    /// # Errors
    /// As [`Self::envelopes`] and [`CycleActivity::cut`].
    pub fn cycles(&self, heel_strikes_s: &[f64], settings: &EmgSettings) -> Result<Vec<CycleActivity>, ModelError> {
        self.cycles_of(&strides_between(heel_strikes_s), settings)
    }

    /// The mean gait cycle of each channel over given strides, s.
    ///
    /// # Errors
    /// As [`Self::cycles`].
    pub fn cycles_of(&self, strides: &[(f64, f64)], settings: &EmgSettings) -> Result<Vec<CycleActivity>, ModelError> {
        self.envelopes(settings)?.iter().map(|envelope| CycleActivity::of_strides(envelope, strides)).collect()
    }

    /// The envelope of each channel.
    ///
    /// # Errors
    /// [`ModelError`] if a setting is out of range or the recording is too short for the filters.
    pub fn envelopes(&self, settings: &EmgSettings) -> Result<Vec<Envelope>, ModelError> {
        settings.validate(self.rate_hz)?;
        let share = |hz: f64| hz / (0.5 * self.rate_hz);
        let band = band_pass(settings.order, share(settings.band_low_hz), share(settings.band_high_hz));
        let smooth = low_pass(settings.order, share(settings.envelope_hz));
        let fewest = signal_filter::extension(&band) + 1;
        self.channels
            .iter()
            .map(|(channel, samples)| {
                if samples.len() < fewest {
                    let reason =
                        format!("the recording has {} samples; the filters need at least {fewest}", samples.len());
                    return Err(ModelError::Malformed { what: format!("channel {channel}"), reason });
                }
                let rectified: Vec<f64> = signal_filter::filter(&band, samples).into_iter().map(f64::abs).collect();
                let values = signal_filter::filter(&smooth, &rectified);
                Ok(Envelope { channel: channel.clone(), start_s: self.start_s, rate_hz: self.rate_hz, values })
            })
            .collect()
    }
}

/// Detects a rectified signal.
fn rectified(samples: &[f64]) -> Option<String> {
    if samples.iter().any(|sample| *sample < 0.0) {
        return None;
    }
    let near = NEAR_ZERO * rms(samples);
    let share = samples.iter().filter(|sample| **sample <= near).count() as f64 / samples.len() as f64;
    (share >= OFTEN).then(|| {
        format!(
            "the signal is never negative and often near zero ({:.0} of 100 samples). It looks rectified, but the raw signal \
             is needed",
            100.0 * share
        )
    })
}

fn rms(values: &[f64]) -> f64 {
    (values.iter().map(|value| value.powi(2)).sum::<f64>() / values.len() as f64).sqrt()
}

/// The quantile of a share.
fn quantile(mut values: Vec<f64>, share: f64) -> f64 {
    values.sort_by(f64::total_cmp);
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // 0 <= place < length
    let place = (share * (values.len() - 1) as f64) as usize;
    values[place]
}

fn checked_rate(rate_hz: f64) -> Result<f64, ModelError> {
    ModelError::check_range("rate_hz", rate_hz, RATE_RANGE_HZ.0, RATE_RANGE_HZ.1)
}
