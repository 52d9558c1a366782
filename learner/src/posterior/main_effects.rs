//! How much the utility depends on a dimension.

use serde::{Deserialize, Serialize};

use crate::error::Result;
use crate::posterior::marginals::AverageView;
use crate::posterior::{Posterior, Prediction};

/// How much the utility depends on a dimension, averaged over all levels of the other dimensions.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct MainEffect {
    /// Value with the highest marginal utility, in the unit of the dimension.
    pub best: f64,
    /// Value with the lowest marginal utility.
    pub worst: f64,
    /// The difference of their marginal utilities.
    pub difference: Prediction,
}

impl MainEffect {
    /// The dimensions of these effects by how much the utility depends on them, the most important first.
    pub fn ranked(effects: &[Self]) -> Vec<usize> {
        let mut ranked: Vec<usize> = (0..effects.len()).collect();
        let effect = |dimension: usize| effects[dimension].difference.mean;
        ranked.sort_by(|a, b| effect(*b).total_cmp(&effect(*a)));
        ranked
    }
}

impl Posterior {
    /// The difference between the highest and the lowest marginal utility of a dimension.
    ///
    /// # Errors
    /// If the dimension does not exist.
    pub fn main_effect(&self, dimension: usize) -> Result<MainEffect> {
        let values = &self.dimension(dimension)?.values;
        let views: Vec<AverageView> = (0..values.len()).map(|level| self.average_view(dimension, level)).collect();
        let (mut best, mut worst) = (0, 0);
        for (level, view) in views.iter().enumerate() {
            if view.mean > views[best].mean {
                best = level;
            }
            if view.mean < views[worst].mean {
                worst = level;
            }
        }
        let covariance = |a: usize, b: usize| views[a].covariance(&views[b], &self.utility);
        let variance = covariance(best, best) + covariance(worst, worst) - 2.0 * covariance(best, worst);
        let mean = views[best].mean - views[worst].mean;
        let difference = Prediction { mean, standard_deviation: variance.max(0.0).sqrt() };
        Ok(MainEffect { best: values[best], worst: values[worst], difference })
    }
}
