//! Leaves out the strides of an EMG recording that a person rejected.

use super::emg_reading::EmgReading;
use super::foot_strikes::FootStrikes;
use crate::error::{Error, FieldError};
use gait_optimizer::emg::LegStrides;
use gait_optimizer::reference::strides_between;

impl EmgReading {
    /// The strides of each leg without the rejected ones.
    ///
    /// # Errors
    /// [`Error::Invalid`] for a number that no stride has, or if every stride is rejected.
    pub fn kept_strides(&self, strikes: &FootStrikes) -> Result<LegStrides, Error> {
        let strides = strides_between(&strikes.right_s);
        let numbered = |number: u32| usize::try_from(number).is_ok_and(|number| (1..=strides.len()).contains(&number));
        if let Some(unknown) = self.rejected_strides.iter().find(|number| !numbered(**number)) {
            return Err(Error::invalid(
                "reading.rejected_strides",
                *unknown,
                &format!("the number of a stride, at most {}", strides.len()),
            ));
        }
        let (mut kept, mut rejected) = (Vec::new(), Vec::new());
        for (stride, number) in strides.into_iter().zip(1_u32..) {
            if self.rejected_strides.contains(&number) { rejected.push(stride) } else { kept.push(stride) }
        }
        if kept.is_empty() {
            return Err(FieldError::in_words(
                "reading.rejected_strides",
                "Every stride is rejected. Keep at least one.",
            )
            .into());
        }
        let overlaps =
            |(start, end): &(f64, f64)| rejected.iter().any(|(from, to): &(f64, f64)| start < to && from < end);
        let left = strikes
            .left_s
            .as_deref()
            .map(|left| strides_between(left).into_iter().filter(|stride| !overlaps(stride)).collect());
        Ok(LegStrides { right: kept, left })
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn left_strides_that_overlap_a_rejected_one_are_left_out() {
        let strikes = FootStrikes { right_s: vec![0.0, 1.0, 2.0, 3.0, 4.0], left_s: Some(vec![0.6, 1.6, 2.6, 3.6]) };
        let kept = |rejected_strides| EmgReading { rejected_strides, ..EmgReading::default() }.kept_strides(&strikes);
        assert_eq!(kept(Vec::new()).unwrap().left.unwrap().len(), 3);
        let without_first = kept(vec![1]).unwrap();
        assert_eq!(without_first.right, [(1.0, 2.0), (2.0, 3.0), (3.0, 4.0)]);
        assert_eq!(without_first.left.unwrap(), [(1.6, 2.6), (2.6, 3.6)]);
        let without_second = kept(vec![2]).unwrap();
        assert_eq!(without_second.left.unwrap(), [(2.6, 3.6)]);
    }
}
