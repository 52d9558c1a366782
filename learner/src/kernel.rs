//! The prior covariance: a squared exponential in every dimension, multiplied.
//!
//! `k(x, y) = s2 exp(-1/2 sum_d ((x_d - y_d) / l_d)^2)`. On a grid each factor is a small table over pairs of levels.

use crate::linalg::Square;
use crate::settings::LearnerSettings;
use crate::space::SearchSpace;

/// Tables of the factors of the covariance.
#[derive(Debug, Clone)]
pub(crate) struct Kernel {
    pub(crate) variance: f64,
    pub(crate) nugget: f64,
    /// For each dimension the correlation of every pair of levels.
    pub(crate) factors: Vec<Square>,
}

impl Kernel {
    pub(crate) fn new(space: &SearchSpace, settings: &LearnerSettings) -> Self {
        let factors = space
            .dimensions()
            .iter()
            .map(|dimension| {
                let lengthscale = dimension.lengthscale * settings.lengthscale_factor;
                Square::from_fn(dimension.values.len(), |i, j| {
                    let r = (dimension.values[i] - dimension.values[j]) / lengthscale;
                    crate::math::exp(-0.5 * r * r)
                })
            })
            .collect();
        Self { variance: settings.signal_variance, nugget: settings.nugget, factors }
    }

    /// Covariance of the utilities of two actions given by their levels.
    pub(crate) fn covariance(&self, a: &[usize], b: &[usize]) -> f64 {
        let mut product = self.variance;
        for ((factor, &i), &j) in self.factors.iter().zip(a).zip(b) {
            product *= factor.at(i, j);
        }
        product
    }

    /// Covariances of one action with many.
    pub(crate) fn column(&self, a: &[usize], points: &[Vec<usize>]) -> Vec<f64> {
        points.iter().map(|b| self.covariance(a, b)).collect()
    }
}
