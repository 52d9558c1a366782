//! A stride sampled at a rate.

use crate::gait::Gait;
use crate::gait::between_nodes::{GaitInstant, instant};
use crate::model_error::ModelError;

/// Allowed sampling rates, Hz.
pub const RATE_RANGE_HZ: (f64, f64) = (10.0, 5000.0);

/// Samples of a stride at a rate, with their times in s from right heel strike. The last sample is the end of the
/// stride, so the last interval may be shorter.
pub(super) fn samples(gait: &Gait, rate_hz: f64) -> Result<Vec<(f64, GaitInstant)>, ModelError> {
    gait.validate()?;
    ModelError::check_range("rate_hz", rate_hz, RATE_RANGE_HZ.0, RATE_RANGE_HZ.1)?;
    let end: f64 = gait.domains.iter().map(|d| d.duration_s).sum();
    let mut result = Vec::new();
    let mut start = 0.0;
    let mut count = 0_u32;
    for domain in &gait.domains {
        let next_start = start + domain.duration_s;
        loop {
            let time = f64::from(count) / rate_hz;
            if time >= next_start {
                break;
            }
            result.push((time, instant(domain, (time - start) / domain.duration_s)));
            count += 1;
        }
        start = next_start;
    }
    if let Some(last) = gait.domains.last() {
        result.push((end, instant(last, 1.0)));
    }
    Ok(result)
}
