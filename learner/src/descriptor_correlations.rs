//! The prior correlations of a grid whose actions have descriptors: a squared exponential of their distances.

use std::sync::Arc;

use crate::descriptors::ActionDescriptors;
use crate::error::Result;
use crate::linalg::{Cholesky, Square};
use crate::random::Random;

/// The correlations of all actions, from one table for the descriptors.
#[derive(Debug, Clone)]
pub(crate) struct DescriptorCorrelations {
    shape: Vec<usize>,
    descriptors: Arc<ActionDescriptors>,
    table: Square,
}

impl DescriptorCorrelations {
    /// `shape` has the number of levels of every dimension.
    pub(crate) fn new(shape: Vec<usize>, descriptors: &Arc<ActionDescriptors>, lengthscale_factor: f64) -> Self {
        let squared = descriptors.squared_distances();
        let scale = -0.5 / (lengthscale_factor * lengthscale_factor);
        let correlation = |i, j| crate::special_functions::exp(scale * squared.at(i, j));
        let table = Square::from_fn(squared.order(), correlation);
        Self { shape, descriptors: Arc::clone(descriptors), table }
    }

    fn of_action(&self) -> &[Option<usize>] {
        self.descriptors.of_actions()
    }

    /// Position of an action, given by its levels.
    fn position(&self, levels: &[usize]) -> usize {
        self.shape.iter().zip(levels).fold(0, |position, (count, level)| position * count + level)
    }

    fn at(&self, a: usize, b: usize) -> f64 {
        match (self.of_action()[a], self.of_action()[b]) {
            (Some(i), Some(j)) => self.table.at(i, j),
            _ => f64::from(u8::from(a == b)),
        }
    }

    /// The correlation of two actions, given by their levels.
    pub(crate) fn of(&self, a: &[usize], b: &[usize]) -> f64 {
        self.at(self.position(a), self.position(b))
    }

    /// The correlation of every action with one, given by its levels.
    pub(crate) fn with_all(&self, b: &[usize]) -> impl Iterator<Item = f64> {
        let b = self.position(b);
        (0..self.of_action().len()).map(move |a| self.at(a, b))
    }

    /// The actions with the levels of a profile. All levels of the dimensions that are `None` count.
    fn matching(&self, profile: &[Option<usize>]) -> Vec<usize> {
        let mut positions = vec![0];
        for (&count, level) in self.shape.iter().zip(profile) {
            let levels = level.map_or(0..count, |level| level..level + 1);
            positions = positions.iter().flat_map(|at| levels.clone().map(move |level| at * count + level)).collect();
        }
        positions
    }

    /// Mean correlation of an action with the actions of a profile.
    pub(crate) fn average_with(&self, profile: &[Option<usize>], point: &[usize]) -> f64 {
        let (matching, point) = (self.matching(profile), self.position(point));
        matching.iter().map(|&action| self.at(action, point)).sum::<f64>() / matching.len() as f64
    }

    /// Mean correlation of the actions of two profiles.
    pub(crate) fn average(&self, one: &[Option<usize>], other: &[Option<usize>]) -> f64 {
        // How many actions of a profile have each descriptor.
        let counts = |matching: &[usize]| {
            let mut counts = vec![0.0; self.table.order()];
            matching
                .iter()
                .filter_map(|&action| self.of_action()[action])
                .for_each(|descriptor| counts[descriptor] += 1.0);
            counts
        };
        let (one, other) = (self.matching(one), self.matching(other));
        let described: f64 =
            counts(&one).iter().zip(self.table.multiply(&counts(&other))).map(|(count, sum)| count * sum).sum();
        // Both are ascending.
        let alone =
            one.iter().filter(|&&action| self.of_action()[action].is_none() && other.binary_search(&action).is_ok());
        (described + alone.count() as f64) / (one.len() as f64 * other.len() as f64)
    }

    /// A sample of a standardised process: one value for each action.
    pub(crate) fn sample(&self, random: &mut Random) -> Result<Vec<f64>> {
        let noise: Vec<f64> = (0..self.table.order()).map(|_| random.normal()).collect();
        let values = Cholesky::new(&self.table.ridged(1e-10))?.multiply(&noise);
        Ok(self.of_action().iter().map(|of| of.map_or_else(|| random.normal(), |of| values[of])).collect())
    }
}
