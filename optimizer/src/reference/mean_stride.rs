//! The mean of several strides and their standard deviation, as 101 points of the gait cycle.

use super::motion_recording::MotionRecording;
use super::reference_gait::REFERENCE_ROWS;

/// The mean of a signal over strides, given by start and end, s, at 0, 1, ..., 100 % of the cycle; interpolated linearly. Empty
/// without strides.
pub fn mean_cycle(time_s: &[f64], values: &[f64], strides: &[(f64, f64)]) -> Vec<f64> {
    if strides.is_empty() || time_s.len() < 2 || values.len() != time_s.len() {
        return Vec::new();
    }
    let at = |time: f64| {
        let after = time_s.partition_point(|&t| t < time).clamp(1, time_s.len() - 1);
        let (t0, t1) = (time_s[after - 1], time_s[after]);
        values[after - 1] + ((time - t0) / (t1 - t0)).clamp(0.0, 1.0) * (values[after] - values[after - 1])
    };
    let mean = |row: usize| {
        let fraction = row as f64 / (REFERENCE_ROWS - 1) as f64;
        strides.iter().map(|(a, b)| at(a + fraction * (b - a))).sum::<f64>() / strides.len() as f64
    };
    (0..REFERENCE_ROWS).map(mean).collect()
}

impl MotionRecording {
    /// The angles at a time, interpolated linearly.
    fn at(&self, time: f64) -> [f64; 5] {
        let after = self.time_s.partition_point(|&t| t < time).clamp(1, self.time_s.len() - 1);
        let (t0, t1) = (self.time_s[after - 1], self.time_s[after]);
        let share = ((time - t0) / (t1 - t0)).clamp(0.0, 1.0);
        let (a, b) = (&self.angles_rad[after - 1], &self.angles_rad[after]);
        std::array::from_fn(|i| a[i] + share * (b[i] - a[i]))
    }

    /// Mean and standard deviation of strides, given by start and end, s. A single stride has a deviation of zero.
    pub(super) fn mean_stride(&self, strides: &[(f64, f64)]) -> [Vec<[f64; 5]>; 2] {
        let count = strides.len() as f64;
        let mut mean = vec![[0.0; 5]; REFERENCE_ROWS];
        let mut deviation = vec![[0.0; 5]; REFERENCE_ROWS];
        for row in 0..REFERENCE_ROWS {
            let fraction = row as f64 / (REFERENCE_ROWS - 1) as f64;
            let samples: Vec<[f64; 5]> = strides.iter().map(|(a, b)| self.at(a + fraction * (b - a))).collect();
            for i in 0..5 {
                mean[row][i] = samples.iter().map(|s| s[i]).sum::<f64>() / count;
                let squares: f64 = samples.iter().map(|s| (s[i] - mean[row][i]).powi(2)).sum();
                deviation[row][i] = if strides.len() > 1 { (squares / (count - 1.0)).sqrt() } else { 0.0 };
            }
        }
        [mean, deviation]
    }
}
