//! The values that are tuned, and medians of what is measured over them.

/// Levels of Table I (Li et al. 2022).
pub(crate) const LEVELS: [&[f64]; 8] = [
    &[15.0, 20.0],
    &[70.0, 80.0, 90.0],
    &[0.3, 0.4, 0.5],
    &[1.2, 1.3, 1.4],
    &[0.0, 0.013, 0.026, 0.039],
    &[0.0, 0.1, 0.2, 0.3, 0.4, 0.5],
    &[20.0, 35.0, 50.0],
    &[20.0, 30.0, 40.0],
];

/// Median; not a number of nothing.
pub(crate) fn median(values: &mut [f64]) -> f64 {
    values.sort_by(f64::total_cmp);
    let middle = values.len() / 2;
    match values.len() {
        0 => f64::NAN,
        odd if odd % 2 == 1 => values[middle],
        _ => 0.5 * (values[middle - 1] + values[middle]),
    }
}
