//! Settings of the filters.

use crate::model_error::ModelError;
use serde::{Deserialize, Serialize};

/// Highest lower edge of the band-pass, and highest edge of the envelope, Hz.
const MAX_LOW_HZ: f64 = 450.0;
/// Highest upper edge of the band-pass, Hz: muscles have no activity above it.
const MAX_BAND_EDGE_HZ: f64 = 1000.0;

/// Settings of the filters. The order is that of one pass and edge; forward and backward pass together have twice the
/// order.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct EmgSettings {
    /// Lower edge of the band-pass, Hz. Motion artefacts of cable and skin are below.
    pub band_low_hz: f64,
    /// Upper edge of the band-pass, Hz; below half the sampling rate.
    pub band_high_hz: f64,
    /// Edge of the low-pass for the envelope, Hz.
    pub envelope_hz: f64,
    /// Order of both filters: 2, 4, 6 or 8.
    pub order: usize,
}

impl Default for EmgSettings {
    fn default() -> Self {
        Self { band_low_hz: 20.0, band_high_hz: 450.0, envelope_hz: 6.0, order: 4 }
    }
}

impl EmgSettings {
    /// Checks the settings for signals with this sampling rate.
    ///
    /// # Errors
    /// [`ModelError::OutOfRange`] with the field.
    pub fn validate(&self, rate_hz: f64) -> Result<(), ModelError> {
        let half = 0.5 * rate_hz;
        let (low, high) = ((0.9 * half).min(MAX_LOW_HZ), (0.99 * half).min(MAX_BAND_EDGE_HZ));
        ModelError::check_range("emg.band_low_hz", self.band_low_hz, 1.0, low)?;
        let above_low = (self.band_low_hz + 1.0, high);
        ModelError::check_related_range(
            "emg.band_high_hz",
            self.band_high_hz,
            above_low,
            ("Hz", "above the lower cut-off"),
        )?;
        ModelError::check_range("emg.envelope_hz", self.envelope_hz, 0.5, low)?;
        ModelError::check_range("emg.order", self.order as f64, 2.0, 8.0)?;
        if self.order % 2 == 1 {
            return Err(ModelError::Unknown {
                field: "emg.order".to_owned(),
                value: self.order.to_string(),
                known: "2, 4, 6 or 8".to_owned(),
            });
        }
        Ok(())
    }
}
