//! Observations of the utility, and the points of the grid that they are about.

use std::cmp::Ordering;
use std::collections::HashMap;

use crate::action::ActionIndex;
use crate::error::Result;
use crate::interval_likelihood::Interval;
use crate::kernel::Kernel;
use crate::linalg::Cholesky;
use crate::search_space::SearchSpace;

/// An observation of the utility of one action, or of the difference of two.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Observation {
    /// Action with coefficient +1.
    pub(crate) plus: ActionIndex,
    /// Action with coefficient -1.
    pub(crate) minus: Option<ActionIndex>,
    pub(crate) interval: Interval,
}

impl Observation {
    /// An order that depends on the observations alone.
    pub(crate) fn canonical_order(&self, other: &Self) -> Ordering {
        let numbers = |o: &Self| [o.interval.low, o.interval.high, o.interval.noise];
        let actions = (self.plus, self.minus).cmp(&(other.plus, other.minus));
        numbers(self).iter().zip(numbers(other)).fold(actions, |order, (a, b)| order.then(a.total_cmp(&b)))
    }
}

/// An observation in terms of points: one factor ("site") of the likelihood.
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

/// The points, in the order of their first observation, the Cholesky factor of their prior covariance, and the sites.
#[derive(Debug, Clone, Default)]
pub(crate) struct ObservedPoints {
    pub(crate) points: Vec<ActionIndex>,
    pub(crate) levels: Vec<Vec<usize>>,
    pub(crate) prior: Cholesky,
    pub(crate) sites: Vec<Site>,
    slots: HashMap<ActionIndex, usize>,
}

impl ObservedPoints {
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

    /// Adds an observation and its points.
    pub(crate) fn add(&mut self, space: &SearchSpace, kernel: &Kernel, observation: &Observation) -> Result<()> {
        let plus = self.point(space, kernel, observation.plus)?;
        let minus = observation.minus.map(|action| self.point(space, kernel, action)).transpose()?;
        self.sites.push(Site { plus, minus, interval: observation.interval });
        Ok(())
    }
}
