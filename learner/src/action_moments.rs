//! Posterior moments, without nugget, of many actions at once: of the whole grid, or of a list of actions if the grid is
//! too large. Both give the same values.

use crate::action::ActionIndex;
use crate::gaussian_process::GaussianProcess;
use crate::linalg::{BLOCK, Block, dot};
use crate::search_space::SearchSpace;
use crate::whole_grid::WholeGrid;

/// The actions of a search, in ascending order. A position counts them from 0.
#[derive(Debug, Clone)]
pub(crate) enum ActionSet {
    /// The whole grid of this many actions.
    Grid(usize),
    /// Some actions.
    List(Vec<ActionIndex>),
}

impl ActionSet {
    /// A list of actions in any order.
    pub(crate) fn list(mut actions: Vec<ActionIndex>) -> Self {
        actions.sort_unstable();
        actions.dedup();
        Self::List(actions)
    }

    /// Number of actions.
    pub(crate) fn len(&self) -> usize {
        match self {
            Self::Grid(len) => *len,
            Self::List(actions) => actions.len(),
        }
    }

    /// The action at a position.
    pub(crate) fn action(&self, position: usize) -> ActionIndex {
        match self {
            Self::Grid(_) => ActionIndex(position as u64),
            Self::List(actions) => actions[position],
        }
    }

    /// The position of an action.
    pub(crate) fn position(&self, action: ActionIndex) -> Option<usize> {
        match self {
            Self::Grid(len) => usize::try_from(action.0).ok().filter(|position| position < len),
            Self::List(actions) => actions.binary_search(&action).ok(),
        }
    }
}

/// The moments of the actions of a set under a Gaussian process.
pub(crate) enum ActionMoments<'a> {
    Grid(WholeGrid<'a>),
    List { process: &'a GaussianProcess, levels: Vec<Vec<usize>> },
}

impl<'a> ActionMoments<'a> {
    pub(crate) fn new(space: &SearchSpace, process: &'a GaussianProcess, set: &ActionSet) -> Self {
        match set {
            ActionSet::Grid(_) => Self::Grid(WholeGrid::new(space, process)),
            ActionSet::List(actions) => {
                Self::List { process, levels: actions.iter().map(|&action| space.levels(action)).collect() }
            }
        }
    }

    /// `k(x, points) . weights` for every action `x`.
    pub(crate) fn form(&self, weights: &[f64]) -> Vec<f64> {
        match self {
            Self::Grid(grid) => grid.form(weights),
            Self::List { process, levels } => {
                let points = &process.observed().levels;
                levels.iter().map(|levels| dot(&process.kernel.column(levels, points), weights)).collect()
            }
        }
    }

    /// Prior covariance of every action with one action.
    pub(crate) fn prior_with(&self, space: &SearchSpace, action: ActionIndex) -> Vec<f64> {
        match self {
            Self::Grid(grid) => grid.prior_with(space, action),
            Self::List { process, levels } => {
                let target = space.levels(action);
                levels.iter().map(|levels| process.kernel.covariance(levels, &target)).collect()
            }
        }
    }

    /// Posterior variances of the actions at these positions.
    pub(crate) fn variances(&self, positions: &[usize]) -> Vec<f64> {
        match self {
            Self::Grid(grid) => grid.variances(positions),
            Self::List { process, levels } => {
                let points = &process.observed().levels;
                let mut variances = Vec::with_capacity(positions.len());
                for chunk in positions.chunks(BLOCK) {
                    let mut columns: Block = vec![[0.0; BLOCK]; points.len()];
                    for (lane, &position) in chunk.iter().enumerate() {
                        let column = process.kernel.column(&levels[position], points);
                        columns.iter_mut().zip(column).for_each(|(lanes, value)| lanes[lane] = value);
                    }
                    variances.extend_from_slice(&process.block_variances(columns)[..chunk.len()]);
                }
                variances
            }
        }
    }
}
