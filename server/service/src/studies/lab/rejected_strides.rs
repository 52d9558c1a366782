//! Leaves out the strides of an EMG recording that a person rejected.

use super::emg_reading::EmgReading;
use crate::error::{Error, FieldError};
use gait_optimizer::reference::strides_between;

impl EmgReading {
    /// The strides, s, without the rejected ones.
    ///
    /// # Errors
    /// [`Error::Invalid`] for a number that no stride has, or if every stride is rejected.
    pub fn kept_strides(&self, heel_strikes_s: &[f64]) -> Result<Vec<(f64, f64)>, Error> {
        let strides = strides_between(heel_strikes_s);
        let numbered = |number: u32| usize::try_from(number).is_ok_and(|number| (1..=strides.len()).contains(&number));
        if let Some(unknown) = self.rejected_strides.iter().find(|number| !numbered(**number)) {
            return Err(Error::invalid(
                "reading.rejected_strides",
                *unknown,
                &format!("the number of a stride, at most {}", strides.len()),
            ));
        }
        let kept: Vec<(f64, f64)> = strides
            .into_iter()
            .zip(1_u32..)
            .filter(|(_, number)| !self.rejected_strides.contains(number))
            .map(|(stride, _)| stride)
            .collect();
        if kept.is_empty() {
            return Err(FieldError::in_words(
                "reading.rejected_strides",
                "Every stride is rejected. Keep at least one.",
            )
            .into());
        }
        Ok(kept)
    }
}
