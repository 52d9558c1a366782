//! The utility as a function of one or two dimensions.

use serde::{Deserialize, Serialize};

use crate::action::ActionIndex;
use crate::error::{LearnerError, Result};
use crate::gaussian_process::GaussianProcess;
use crate::linalg::dot;
use crate::posterior::{Posterior, Prediction};

/// The utility at one level of a dimension, averaged over all levels of the other dimensions.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Marginal {
    /// Value of the level, in the unit of the dimension.
    pub value: f64,
    /// Posterior mean and standard deviation of the average.
    #[serde(flatten)]
    pub average: Prediction,
}

/// Predictions over the levels of two dimensions, with the other dimensions fixed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Slice {
    /// Index of the dimension of the rows.
    pub row_dimension: usize,
    /// Index of the dimension of the columns.
    pub column_dimension: usize,
    /// Predictions, `predictions[row level][column level]`.
    pub predictions: Vec<Vec<Prediction>>,
}

/// The average of the utility at one level of a dimension, with what its covariances need.
pub(super) struct AverageView {
    profile: Vec<Option<usize>>,
    prior: Vec<f64>,
    left: Vec<f64>,
    right: Vec<f64>,
    pub(super) mean: f64,
}

impl AverageView {
    pub(super) fn covariance(&self, other: &Self, process: &GaussianProcess) -> f64 {
        process.kernel.average_covariance(&self.profile, &other.profile) - dot(&self.prior, &other.prior)
            + dot(&self.left, &other.right)
    }
}

impl Posterior {
    pub(super) fn average_view(&self, dimension: usize, level: usize) -> AverageView {
        let process = &self.utility;
        let observed = process.observed();
        let profile: Vec<Option<usize>> =
            (0..self.space().dimensions().len()).map(|d| (d == dimension).then_some(level)).collect();
        let mut prior: Vec<f64> =
            observed.levels.iter().map(|point| process.kernel.average_with(&profile, point)).collect();
        let mean = dot(&prior, &process.approximation().weights);
        observed.prior.solve_lower(&mut prior);
        let (left, right) = process.approximation().project(&observed.prior, &prior);
        AverageView { profile, prior, left, right, mean }
    }

    /// The marginal utility of each level of a dimension: its average over all levels of the other dimensions.
    ///
    /// # Errors
    /// If the dimension does not exist.
    pub fn marginal(&self, dimension: usize) -> Result<Vec<Marginal>> {
        let marginal = |(level, &value): (usize, &f64)| {
            let view = self.average_view(dimension, level);
            let variance = view.covariance(&view, &self.utility);
            Marginal { value, average: Prediction { mean: view.mean, standard_deviation: variance.max(0.0).sqrt() } }
        };
        Ok(self.dimension(dimension)?.values.iter().enumerate().map(marginal).collect())
    }

    /// Predictions over the levels of two dimensions. The other dimensions are fixed at the levels of `through`.
    ///
    /// # Errors
    /// If a dimension does not exist, if both are the same, or if the action is not in the space.
    pub fn slice(&self, row_dimension: usize, column_dimension: usize, through: ActionIndex) -> Result<Slice> {
        self.space().check(through)?;
        let rows = self.dimension(row_dimension)?.values.len();
        let columns = self.dimension(column_dimension)?.values.len();
        if row_dimension == column_dimension {
            return Err(LearnerError::InvalidDimension {
                dimension: self.dimension(row_dimension)?.name.clone(),
                reason: "it is given for both rows and columns; a slice needs two different dimensions".into(),
            });
        }
        let mut levels = self.space().levels(through);
        let mut predictions = Vec::with_capacity(rows);
        for row in 0..rows {
            levels[row_dimension] = row;
            let mut line = Vec::with_capacity(columns);
            for column in 0..columns {
                levels[column_dimension] = column;
                line.push(self.predict(self.space().index_of_levels(&levels)?)?);
            }
            predictions.push(line);
        }
        Ok(Slice { row_dimension, column_dimension, predictions })
    }
}
