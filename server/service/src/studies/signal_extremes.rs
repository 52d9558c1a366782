//! The smallest and the largest samples of a signal, which its trace draws in place of every sample.

/// How many intervals a trace has.
pub(super) const INTERVALS: usize = 400;

/// The smallest and the largest sample of each interval, in order of time.
pub(super) fn extremes(samples: &[f64]) -> Vec<(usize, f64)> {
    extremes_in(INTERVALS, samples)
}

/// The smallest and the largest sample of each of so many intervals, in order of time.
pub(super) fn extremes_in(intervals: usize, samples: &[f64]) -> Vec<(usize, f64)> {
    let length = samples.len().div_ceil(intervals).max(1);
    let mut points = Vec::new();
    for (interval, part) in samples.chunks(length).enumerate() {
        let place = |best: fn(&f64, &f64) -> std::cmp::Ordering| {
            part.iter()
                .enumerate()
                .max_by(|a, b| best(a.1, b.1))
                .map(|(place, value)| (interval * length + place, *value))
        };
        let (low, high) = (place(|a, b| b.total_cmp(a)), place(f64::total_cmp));
        let mut both: Vec<(usize, f64)> = low.into_iter().chain(high).collect();
        both.sort_by_key(|(place, _)| *place);
        both.dedup_by_key(|(place, _)| *place);
        points.append(&mut both);
    }
    points
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_interval_keeps_its_smallest_and_largest_sample_in_order_of_time() {
        let samples = [0.0, 3.0, -1.0, 2.0, 5.0, 5.0, 4.0, 4.5];
        assert_eq!(extremes_in(2, &samples), [(1, 3.0), (2, -1.0), (5, 5.0), (6, 4.0)]);
        assert_eq!(extremes(&samples).len(), samples.len());
        assert!(extremes(&[]).is_empty());
    }
}
