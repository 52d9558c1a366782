//! Relaxations: which bound, or which bounds together, must give way for a gait, and by how much at least.

use super::bound::{Level, least_move, loosened, step};
use super::conflict::BoundSet;
use super::given_bound::BoundValue;
use super::search::Search;
use super::solves::{SearchEnd, Starts};
use crate::solve::WarmStart;
use crate::tuned_bounds::TunedBounds;
use serde::{Deserialize, Serialize};

/// The effect of relaxing one tuned bound.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Relaxation {
    /// Name of the bound.
    pub bound: String,
    /// What it limits, with its unit.
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
    /// What it limits, with its unit.
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

impl Search<'_> {
    /// The smallest relaxation of the bounds of a set that gives a gait, if there is one.
    pub(super) fn level(&mut self, set: BoundSet) -> Result<Option<Level>, SearchEnd> {
        let before = self.solves.count;
        if self.solves.is_met(&loosened(&self.problem.bounds, set, Level::Usual)?, Starts::All)? {
            return Ok(Some(Level::Usual));
        }
        // Initial guesses that failed there also fail with the loosest values, which are further from walking.
        let starts = if self.solves.count > before { Starts::Nearest } else { Starts::All };
        let loosest = self.solves.is_met(&loosened(&self.problem.bounds, set, Level::Loosest)?, starts)?;
        Ok(loosest.then_some(Level::Loosest))
    }

    /// The smallest joint relaxation of the bounds of a set.
    pub(super) fn relaxed(&mut self, set: BoundSet) -> Result<JointRelaxation, SearchEnd> {
        let given = self.problem.bounds;
        let before = self.solves.count;
        let (mut to, mut warm_start) = (None, None);
        let (not_with, searches) = match self.level(set)? {
            Some(level) => {
                let loose = loosened(&given, set, level)?;
                warm_start = self.solves.gait(&loose)?;
                // Tighter bounds than those without a gait need no solve.
                let tight = if level == Level::Usual { given } else { loosened(&given, set, Level::Usual)? };
                let solves = &mut self.solves;
                let (nearest, none) = least_move(&tight, &loose, |bounds| {
                    let gait = solves.solve(bounds, Starts::All)?;
                    let found = gait.is_some();
                    warm_start = gait.or(warm_start.take());
                    Ok::<_, SearchEnd>(found)
                })?;
                to = Some(nearest.to_array());
                (none, self.solves.unmet(&none).into_iter().filter(|_| none != given).collect())
            }
            None => (loosened(&given, set, Level::Loosest)?, self.searched(set)?),
        };
        let (starts, undecided) = (searches.iter().map(|s| s.starts).sum(), searches.iter().any(|s| s.undecided));
        let of_bound = |one: BoundValue, bound: usize| RelaxedBound {
            bound: one.bound,
            meaning: one.meaning,
            from: one.value,
            to: to.map(|to| to[bound]),
            not_with: not_with.to_array()[bound],
        };
        Ok(JointRelaxation {
            bounds: self.given(set).into_iter().zip(set.bounds()).map(|(one, bound)| of_bound(one, bound)).collect(),
            undecided,
            solves: self.solves.count - before,
            starts,
            warm_start,
        })
    }
}

/// A joint relaxation that consists of one bound.
pub(super) fn of_one_bound(joint: JointRelaxation) -> Option<Relaxation> {
    let JointRelaxation { bounds, undecided, solves, starts, warm_start } = joint;
    let RelaxedBound { bound, meaning, from, to, not_with } = bounds.into_iter().next()?;
    Some(Relaxation { bound, meaning, from, to, not_with, undecided, solves, starts, warm_start })
}
