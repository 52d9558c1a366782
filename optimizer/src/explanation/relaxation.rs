//! Relaxations: which bound, or which bounds together, must give way for a gait, and by how much at least.

use super::bound::step;
use crate::solve::WarmStart;
use crate::tuned_bounds::TunedBounds;
use serde::{Deserialize, Serialize};

/// The effect of relaxing one tuned bound.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Relaxation {
    /// Name of the bound.
    pub bound: String,
    /// Limited quantity and its unit.
    pub meaning: String,
    /// The given value.
    pub from: f64,
    /// The nearest value with which a gait converged; `None` if no gait converged with the loosest value.
    pub to: Option<f64>,
    /// The loosest value with which no gait converged.
    pub not_with: f64,
    /// Whether a solve with it ended at a limit or stalled, so that a gait may exist.
    pub undecided: bool,
    /// Solves that this took.
    pub solves: usize,
    /// Number of starts of the search at the `not_with` value. 0 if unknown, or if only the explained solve was done.
    #[serde(default)]
    pub starts: usize,
    /// Warm start of the gait with `to`. The search found it from nearby gaits; other starts may not reach it.
    #[serde(skip)]
    pub warm_start: Option<WarmStart>,
}

/// One bound of a joint relaxation.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RelaxedBound {
    /// Name of the bound.
    pub bound: String,
    /// Limited quantity and its unit.
    pub meaning: String,
    /// The given value.
    pub from: f64,
    /// The nearest value, together with the others, with which a gait converged; `None` if no gait converged with the
    /// loosest values.
    pub to: Option<f64>,
    /// The loosest value, together with the others, with which no gait converged.
    pub not_with: f64,
}

/// The effect of relaxing several tuned bounds together, if no single one is sufficient: each by the same fraction of
/// the way to its loosest value.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct JointRelaxation {
    /// The bounds, one from each conflict.
    pub bounds: Vec<RelaxedBound>,
    /// As in a [`Relaxation`].
    pub undecided: bool,
    /// Solves that this took.
    pub solves: usize,
    /// As in a [`Relaxation`].
    pub starts: usize,
    /// As in a [`Relaxation`].
    #[serde(skip)]
    pub warm_start: Option<WarmStart>,
}

/// The values of the bounds of a relaxation.
fn size<'a>(bounds: impl Iterator<Item = (&'a str, f64, Option<f64>)>) -> f64 {
    bounds
        .map(|(name, from, to)| {
            let bound = TunedBounds::NAMES.iter().position(|known| *known == name).unwrap_or(0);
            to.map_or(f64::INFINITY, |to| step(bound, from, to))
        })
        .sum()
}

impl Relaxation {
    pub(super) fn size(&self) -> f64 {
        size(std::iter::once((self.bound.as_str(), self.from, self.to)))
    }
}

impl JointRelaxation {
    pub(super) fn size(&self) -> f64 {
        size(self.bounds.iter().map(|one| (one.bound.as_str(), one.from, one.to)))
    }
}

/// A joint relaxation that consists of one bound.
pub(super) fn of_one_bound(joint: JointRelaxation) -> Option<Relaxation> {
    let JointRelaxation { bounds, undecided, solves, starts, warm_start } = joint;
    let RelaxedBound { bound, meaning, from, to, not_with } = bounds.into_iter().next()?;
    Some(Relaxation { bound, meaning, from, to, not_with, undecided, solves, starts, warm_start })
}
