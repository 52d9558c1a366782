//! The filters from a raw signal to an envelope: band-pass, rectification, low-pass.

use super::{CycleActivity, EmgRecording, EmgSettings, Envelope, LegStrides};
use crate::model_error::ModelError;
use crate::signal_filter::{self, band_pass, low_pass};

impl EmgRecording {
    /// The mean gait cycle of each channel, over the strides of its leg.
    ///
    /// # Errors
    /// As [`Self::envelopes`] and [`CycleActivity::of_leg`].
    pub fn cycles(&self, strides: &LegStrides, settings: &EmgSettings) -> Result<Vec<CycleActivity>, ModelError> {
        self.envelopes(settings)?.iter().map(|envelope| CycleActivity::of_leg(envelope, strides)).collect()
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
