//! Extremes, average and correlation of samples.

/// The lowest and the highest value.
pub(crate) fn extremes(values: &[f64]) -> (f64, f64) {
    values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), &v| (low.min(v), high.max(v)))
}

/// The arithmetic mean.
pub(crate) fn average(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// Pearson's correlation of two equally long samples; `None` where one of them is constant.
pub(crate) fn correlation(a: &[f64], b: &[f64]) -> Option<f64> {
    let (mean_a, mean_b) = (average(a), average(b));
    let product: f64 = a.iter().zip(b).map(|(x, y)| (x - mean_a) * (y - mean_b)).sum();
    let spread = |values: &[f64], mean: f64| values.iter().map(|v| (v - mean).powi(2)).sum::<f64>().sqrt();
    let both = spread(a, mean_a) * spread(b, mean_b);
    (both > 0.0).then(|| product / both)
}

/// The 95 % confidence interval of a share (Wilson 1927). With no trials it is everything.
pub(crate) fn wilson_interval(successes: u32, trials: u32) -> (f64, f64) {
    const QUANTILE: f64 = 1.959_963_984_540_054;
    if trials == 0 {
        return (0.0, 1.0);
    }
    let n = f64::from(trials);
    let share = f64::from(successes) / n;
    let squared = QUANTILE * QUANTILE / n;
    let centre = share + 0.5 * squared;
    let half = QUANTILE * (share * (1.0 - share) / n + 0.25 * squared / n).sqrt();
    // Exact at the ends, where rounding would leave a remainder.
    let low = if successes == 0 { 0.0 } else { (centre - half) / (1.0 + squared) };
    let high = if successes == trials { 1.0 } else { (centre + half) / (1.0 + squared) };
    (low, high)
}

#[cfg(test)]
mod tests {
    use super::wilson_interval;

    #[test]
    fn interval_matches_wilsons_formula() {
        let (low, high) = wilson_interval(8, 10);
        assert!((low - 0.490).abs() < 5e-4 && (high - 0.943).abs() < 5e-4);
        assert_eq!(wilson_interval(0, 200).0, 0.0);
        assert_eq!(wilson_interval(200, 200).1, 1.0);
    }
}
