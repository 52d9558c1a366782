//! Zero-phase filtering by a forward and a backward pass, as `filtfilt` of SciPy: odd extension at both ends, and each
//! pass starts in the steady state of its first value.

use super::butterworth::SecondOrderSection;

/// Number of samples by which a signal is extended at both ends: three times the number of coefficients of the filter.
pub(crate) fn extension(sections: &[SecondOrderSection]) -> usize {
    3 * (2 * sections.len() + 1)
}

/// The filtered signal. `signal` must be longer than [`extension`].
pub(crate) fn filter(sections: &[SecondOrderSection], signal: &[f64]) -> Vec<f64> {
    let extension = extension(sections);
    let last = signal.len() - 1;
    let before = (1..=extension).rev().map(|k| 2.0 * signal[0] - signal[k]);
    let after = (1..=extension).map(|k| 2.0 * signal[last] - signal[last - k]);
    let mut extended: Vec<f64> = before.chain(signal.iter().copied()).chain(after).collect();
    for _ in 0..2 {
        pass(sections, &mut extended);
        extended.reverse();
    }
    extended[extension..extension + signal.len()].to_vec()
}

/// One pass in place.
fn pass(sections: &[SecondOrderSection], signal: &mut [f64]) {
    let mut steady = signal[0];
    for SecondOrderSection { b, a } in sections {
        let out = steady * (b[0] + b[1] + b[2]) / (1.0 + a[0] + a[1]);
        let mut state = [out - b[0] * steady, b[2] * steady - a[1] * out];
        for value in signal.iter_mut() {
            let filtered = b[0] * *value + state[0];
            state = [b[1] * *value - a[0] * filtered + state[1], b[2] * *value - a[1] * filtered];
            *value = filtered;
        }
        steady = out;
    }
}
