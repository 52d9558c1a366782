//! Checks that a signal is raw: not constant, without artefacts, neither rectified nor smoothed.

use super::{EmgRecording, EmgSettings};
use crate::model_error::ModelError;
use crate::signal_filter::{self, band_pass};

/// Largest plausible distance of a sample from the median, as a multiple of the 99th percentile of these distances.
/// Bursts of activity reach about 10.
const FARTHEST_SAMPLE: f64 = 100.0;
/// Distance from zero, as a share of the RMS, within which a sample counts as zero ...
const NEAR_ZERO: f64 = 0.1;
/// ... and the share of such samples from which a non-negative signal counts as rectified. For noise it is 8 %; a raw
/// signal with an offset has almost none.
const MIN_SIGN_CHANGE_SHARE: f64 = 0.02;
/// Smallest share of the RMS of a raw signal within the band of the filter. White noise has about 90 %, an envelope of
/// 6 to 10 Hz a few per cent.
const MIN_IN_BAND: f64 = 0.1;

impl EmgRecording {
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
             the samples, which lie within {kept_within:.3e} of it",
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
        (share < MIN_IN_BAND).then(|| {
            format!(
                "only {:.1} % of the signal (RMS) is between {band_low_hz} and {band_high_hz} Hz; a raw signal has at least \
                 {:.0} %. This looks like an envelope or a movement artefact; upload the raw signal",
                100.0 * share,
                100.0 * MIN_IN_BAND
            )
        })
    }
}

/// Detects a rectified signal.
fn rectified(samples: &[f64]) -> Option<String> {
    if samples.iter().any(|sample| *sample < 0.0) {
        return None;
    }
    let near = NEAR_ZERO * rms(samples);
    let share = samples.iter().filter(|sample| **sample <= near).count() as f64 / samples.len() as f64;
    (share >= MIN_SIGN_CHANGE_SHARE).then(|| {
        format!(
            "the signal is never negative and often near zero ({:.0} % of the samples). It looks rectified, but the raw signal \
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
