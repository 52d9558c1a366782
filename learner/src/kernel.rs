//! The prior covariance of the utility, from one table of correlations between levels for each dimension, or from
//! descriptors of the actions.
//!
//! Without descriptors, the kernel is `k = s2 prod_d k_d`, with a squared exponential `k_d` in each dimension `d`. It is a product of the
//! tables, so that the covariances of a grid split into the two halves of its dimensions (`whole_grid.rs`).

use crate::descriptor_correlations::DescriptorCorrelations;
use crate::linalg::Square;
use crate::search_space::SearchSpace;

/// A kernel on the grid of a search space.
#[derive(Debug, Clone)]
pub(crate) struct Kernel {
    /// `s2`.
    pub(crate) variance: f64,
    pub(crate) nugget: f64,
    correlations: Correlations,
}

#[derive(Debug, Clone)]
pub(crate) enum Correlations {
    /// Tables of `k_d`.
    Levels(Vec<Square>),
    Descriptors(DescriptorCorrelations),
}

impl Kernel {
    /// The kernel whose lengthscales are those of the dimensions times `lengthscale_factor`.
    pub(crate) fn new(space: &SearchSpace, variance: f64, nugget: f64, lengthscale_factor: f64) -> Self {
        if let Some(descriptors) = space.descriptors() {
            let described = DescriptorCorrelations::new(space.shape(), descriptors, lengthscale_factor);
            return Self { variance, nugget, correlations: Correlations::Descriptors(described) };
        }
        let factors = space
            .dimensions()
            .iter()
            .map(|dimension| {
                let lengthscale = dimension.lengthscale * lengthscale_factor;
                Square::from_fn(dimension.values.len(), |i, j| {
                    let r = (dimension.values[i] - dimension.values[j]) / lengthscale;
                    crate::special_functions::exp(-0.5 * r * r)
                })
            })
            .collect();
        Self { variance, nugget, correlations: Correlations::Levels(factors) }
    }

    /// The correlations between levels, or between descriptors.
    pub(crate) fn correlations(&self) -> &Correlations {
        &self.correlations
    }

    /// Product of the correlations of every combination of levels with `b`, the levels of some of the dimensions,
    /// starting with dimension `from`; the last dimension varies fastest. With descriptors, these are all dimensions or none.
    pub(crate) fn combinations(&self, from: usize, b: &[usize]) -> Vec<f64> {
        let tables = match &self.correlations {
            Correlations::Descriptors(described) if !b.is_empty() => return described.with_all(b).collect(),
            Correlations::Descriptors(_) => &[][..],
            Correlations::Levels(tables) => tables,
        };
        let mut all = vec![1.0];
        for (d, &j) in b.iter().enumerate() {
            // The tables are symmetric.
            let factors = tables[from + d].row(j);
            all = all.iter().flat_map(|product| factors.iter().map(move |factor| product * factor)).collect();
        }
        all
    }

    /// [`Self::combinations`] times `scale`, without allocation. The order of the multiplications differs.
    pub(crate) fn products(&self, from: usize, b: &[usize], scale: f64, into: &mut Vec<f64>) {
        into.clear();
        let tables = match &self.correlations {
            Correlations::Descriptors(described) if !b.is_empty() => {
                into.extend(described.with_all(b).map(|correlation| scale * correlation));
                return;
            }
            Correlations::Descriptors(_) => &[][..],
            Correlations::Levels(tables) => tables,
        };
        into.push(scale);
        // From the last dimension to the first, so that the combinations computed so far stay contiguous.
        for (d, &j) in b.iter().enumerate().rev() {
            let done = into.len();
            let factors = tables[from + d].row(j);
            for factor in &factors[1..] {
                into.extend_from_within(..done);
                let start = into.len() - done;
                into[start..].iter_mut().for_each(|value| *value *= factor);
            }
            into[..done].iter_mut().for_each(|value| *value *= factors[0]);
        }
    }

    /// Prior covariance of two actions, given by their levels.
    pub(crate) fn covariance(&self, a: &[usize], b: &[usize]) -> f64 {
        let correlation = match &self.correlations {
            Correlations::Levels(tables) => {
                product(tables.iter().zip(a.iter().zip(b)).map(|(table, (&i, &j))| table.at(i, j)))
            }
            Correlations::Descriptors(described) => described.of(a, b),
        };
        self.variance * correlation
    }

    /// Prior covariance of an action with the average over all levels of the dimensions that are `None` in `profile`.
    pub(crate) fn average_with(&self, profile: &[Option<usize>], point: &[usize]) -> f64 {
        let mean = |table: &Square, j: usize| table.row(j).iter().sum::<f64>() / table.order() as f64;
        let factor = |(table, (level, &j)): (&Square, (&Option<usize>, &usize))| match *level {
            Some(i) => table.at(i, j),
            None => mean(table, j),
        };
        let correlation = match &self.correlations {
            Correlations::Levels(tables) => product(tables.iter().zip(profile.iter().zip(point)).map(factor)),
            Correlations::Descriptors(described) => described.average_with(profile, point),
        };
        self.variance * correlation
    }

    /// Prior covariance of two averages, each over all levels of the dimensions that are `None` in its profile. Both
    /// average over the same dimensions.
    pub(crate) fn average_covariance(&self, one: &[Option<usize>], other: &[Option<usize>]) -> f64 {
        let mean = |table: &Square| {
            let n = table.order();
            (0..n).map(|i| table.row(i).iter().sum::<f64>()).sum::<f64>() / (n * n) as f64
        };
        let factor = |(table, levels): (&Square, (&Option<usize>, &Option<usize>))| match levels {
            (Some(i), Some(j)) => table.at(*i, *j),
            _ => mean(table),
        };
        let correlation = match &self.correlations {
            Correlations::Levels(tables) => product(tables.iter().zip(one.iter().zip(other)).map(factor)),
            Correlations::Descriptors(described) => described.average(one, other),
        };
        self.variance * correlation
    }

    /// Prior covariances of one action with many, all given by their levels.
    pub(crate) fn column(&self, a: &[usize], points: &[Vec<usize>]) -> Vec<f64> {
        points.iter().map(|b| self.covariance(a, b)).collect()
    }
}

/// The product in the order of the dimensions.
fn product(factors: impl Iterator<Item = f64>) -> f64 {
    factors.fold(1.0, |product, factor| product * factor)
}
