//! Descriptors of actions: points whose distances say how alike the outcomes of two actions are.

use crate::error::{LearnerError, Result};
use crate::linalg::Square;

/// Largest number of descriptors: the table of their correlations has its square as many entries.
const MAX_DESCRIPTORS: usize = 2_000;
/// Largest number of coordinates of a descriptor.
const MAX_COORDINATES: usize = 1_000;
/// Largest magnitude of a coordinate: up to it, squared distances stay finite.
const MAX_COORDINATE: f64 = 1e15;
/// Shortest and longest lengthscale, as multiples of the spread.
const LENGTHSCALES: (f64, f64) = (1e-2, 1e2);

/// The descriptor of each action of a search space, for [`SearchSpace::described_by`](crate::SearchSpace::described_by).
///
/// Actions with the same outcome share a descriptor. The utility is then a function of the descriptor instead of the levels,
/// and no two actions with one descriptor are proposed. Actions without a descriptor have no outcome: they are never
/// proposed, and nothing follows from them for others.
#[derive(Debug, Clone, PartialEq)]
pub struct ActionDescriptors {
    of_action: Vec<Option<usize>>,
    /// Squared distances of the descriptors, in lengthscales.
    squared_distances: Square,
}

impl ActionDescriptors {
    /// `of_action` has the index of each action's descriptor, if it has one. `lengthscale` is the distance over which
    /// utilities stay similar, as a multiple of the spread of the descriptors: the root mean square of their distances from
    /// their mean.
    ///
    /// # Errors
    /// If there is no descriptor or more than 2,000, if their coordinates differ in number, are more than 1,000 or out of
    /// range, if an action has a descriptor that does not exist, or if the lengthscale is out of range.
    pub fn new(of_action: Vec<Option<usize>>, descriptors: &[Vec<f64>], lengthscale: f64) -> Result<Self> {
        let refuse = |descriptor: usize, reason: String| Err(LearnerError::InvalidDescriptor { descriptor, reason });
        let count = descriptors.len();
        if !(1..=MAX_DESCRIPTORS).contains(&count) {
            return Err(LearnerError::WrongDescriptorCount { given: count, limit: MAX_DESCRIPTORS });
        }
        let coordinates = descriptors[0].len();
        for (descriptor, point) in descriptors.iter().enumerate() {
            let given = point.len();
            if !(1..=MAX_COORDINATES).contains(&given) {
                return refuse(descriptor, format!("it has {given} coordinates; it must have 1 to {MAX_COORDINATES}"));
            }
            if given != coordinates {
                return refuse(descriptor, format!("it has {given} coordinates; descriptor 0 has {coordinates}"));
            }
            if let Some(value) = point.iter().find(|value| value.is_nan() || value.abs() > MAX_COORDINATE) {
                let range = format!("{:e} to {MAX_COORDINATE:e}", -MAX_COORDINATE);
                return refuse(descriptor, format!("a coordinate is {value}; it must be {range}"));
            }
        }
        if let Some(&descriptor) = of_action.iter().flatten().find(|descriptor| **descriptor >= count) {
            return refuse(descriptor, format!("it does not exist: there are {count}, counted from 0"));
        }
        let (shortest, longest) = LENGTHSCALES;
        if !(lengthscale >= shortest && lengthscale <= longest) {
            return Err(LearnerError::InvalidDescriptorLengthscale { lengthscale, shortest, longest });
        }
        let points = in_lengthscales(descriptors, lengthscale);
        let squared_distance =
            |i: usize, j: usize| points[i].iter().zip(&points[j]).map(|(a, b)| (a - b) * (a - b)).sum();
        Ok(Self { of_action, squared_distances: Square::from_fn(count, squared_distance) })
    }

    /// Number of actions.
    pub(crate) fn actions(&self) -> u64 {
        self.of_action.len() as u64
    }

    /// The index of each action's descriptor.
    pub(crate) fn of_actions(&self) -> &[Option<usize>] {
        &self.of_action
    }

    /// Squared distances of the descriptors, in lengthscales.
    pub(crate) fn squared_distances(&self) -> &Square {
        &self.squared_distances
    }
}

/// Points around their mean, in lengthscales. Equal points are all 0.
fn in_lengthscales(descriptors: &[Vec<f64>], lengthscale: f64) -> Vec<Vec<f64>> {
    let count = descriptors.len() as f64;
    let coordinates = descriptors.first().map_or(0, Vec::len);
    let mean: Vec<f64> =
        (0..coordinates).map(|c| descriptors.iter().map(|point| point[c]).sum::<f64>() / count).collect();
    let centred =
        |point: &Vec<f64>| -> Vec<f64> { point.iter().zip(&mean).map(|(value, mean)| value - mean).collect() };
    let mut points: Vec<Vec<f64>> = descriptors.iter().map(centred).collect();
    let spread = (points.iter().flatten().map(|value| value * value).sum::<f64>() / count).sqrt();
    let unit = if spread > 0.0 { spread * lengthscale } else { 1.0 };
    points.iter_mut().flatten().for_each(|value| *value /= unit);
    points
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distances_are_multiples_of_the_spread() {
        let points = in_lengthscales(&[vec![1.0, 5.0], vec![5.0, 5.0], vec![3.0, 5.0], vec![3.0, 5.0]], 0.5);
        let root = 2.0_f64.sqrt();
        for (point, expected) in points.iter().zip([-2.0 * root, 2.0 * root, 0.0, 0.0]) {
            assert!((point[0] - expected).abs() < 1e-12 && point[1] == 0.0, "{points:?}");
        }
        assert_eq!(in_lengthscales(&[vec![7.0], vec![7.0]], 0.5), [[0.0], [0.0]]);
    }

    #[test]
    fn invalid_descriptors_are_refused_with_their_place() {
        let refusal = |of: &[usize], descriptors: &[&[f64]], lengthscale| {
            let descriptors: Vec<Vec<f64>> = descriptors.iter().map(|point| point.to_vec()).collect();
            let of = of.iter().map(|of| Some(*of)).collect();
            ActionDescriptors::new(of, &descriptors, lengthscale).unwrap_err().to_string()
        };
        let two: &[&[f64]] = &[&[0.0, 1.0], &[2.0, 3.0]];
        for (text, expected) in [
            (refusal(&[], &[], 1.0), "the number of descriptors is 0; it must be 1 to 2000"),
            (refusal(&[0], &[&[0.0, 1.0], &[2.0]], 1.0), "descriptor 1: it has 1 coordinates; descriptor 0 has 2"),
            (refusal(&[0], &[&[]], 1.0), "descriptor 0: it has 0 coordinates; it must have 1 to 1000"),
            (refusal(&[0], &[&[0.0], &[f64::NAN]], 1.0), "descriptor 1: a coordinate is NaN; it must be -1e15 to 1e15"),
            (refusal(&[0, 2], two, 1.0), "descriptor 2: it does not exist: there are 2, counted from 0"),
            (
                refusal(&[0, 1], two, f64::NAN),
                "the lengthscale of the descriptors is NaN; it must be 0.01 to 100, in units of their spread",
            ),
        ] {
            assert_eq!(text, expected);
        }
    }
}
