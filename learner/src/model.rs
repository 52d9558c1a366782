//! Answers about points of the grid, as a Gaussian process sees them.

use std::collections::HashMap;

use crate::error::Result;
use crate::kernel::Kernel;
use crate::likelihood::Interval;
use crate::linalg::Cholesky;
use crate::space::{ActionIndex, SearchSpace};

/// An answer about the utility of one point or the difference of two.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Site {
    /// Point with coefficient +1.
    pub(crate) plus: usize,
    /// Point with coefficient -1.
    pub(crate) minus: Option<usize>,
    pub(crate) interval: Interval,
}

impl Site {
    /// The site's functional of a vector over the points.
    pub(crate) fn of(&self, f: &[f64]) -> f64 {
        f[self.plus] - self.minus.map_or(0.0, |m| f[m])
    }
}

/// Points in the order in which answers first speak of them, the factor of their prior covariance, and the answers.
#[derive(Debug, Clone, Default)]
pub(crate) struct Model {
    pub(crate) points: Vec<ActionIndex>,
    pub(crate) levels: Vec<Vec<usize>>,
    pub(crate) prior: Cholesky,
    pub(crate) sites: Vec<Site>,
    slots: HashMap<ActionIndex, usize>,
}

impl Model {
    /// A copy with room for one more point.
    pub(crate) fn roomy(&self) -> Self {
        Self {
            points: self.points.clone(),
            levels: self.levels.clone(),
            prior: self.prior.roomy(),
            sites: self.sites.clone(),
            slots: self.slots.clone(),
        }
    }

    /// Position of an action among the points.
    pub(crate) fn slot(&self, action: ActionIndex) -> Option<usize> {
        self.slots.get(&action).copied()
    }

    /// The point of an action, added if it is new.
    fn point(&mut self, space: &SearchSpace, kernel: &Kernel, action: ActionIndex) -> Result<usize> {
        if let Some(slot) = self.slot(action) {
            return Ok(slot);
        }
        let levels = space.levels(action);
        let mut row = kernel.column(&levels, &self.levels);
        row.push(kernel.covariance(&levels, &levels) + kernel.nugget);
        self.prior.append(&row)?;
        let slot = self.points.len();
        self.points.push(action);
        self.levels.push(levels);
        self.slots.insert(action, slot);
        Ok(slot)
    }

    /// Adds an answer about one action or the difference of two.
    pub(crate) fn add(
        &mut self,
        space: &SearchSpace,
        kernel: &Kernel,
        plus: ActionIndex,
        minus: Option<ActionIndex>,
        interval: Interval,
    ) -> Result<()> {
        let plus = self.point(space, kernel, plus)?;
        let minus = minus.map(|action| self.point(space, kernel, action)).transpose()?;
        self.sites.push(Site { plus, minus, interval });
        Ok(())
    }
}
