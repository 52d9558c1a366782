//! The grid of actions: an ordered list of dimensions, each with a few levels.

use std::fmt;

use serde::{Deserialize, Serialize};

use crate::error::{LearnerError, Result};

/// Largest number of actions of a search space: indices stay exact as JSON numbers.
const MAX_ACTIONS: u64 = 1 << 53;
/// Largest number of actions that are looked at one by one.
const MAX_ENUMERATED: usize = 1 << 20;
/// Largest number of levels of one dimension.
const MAX_LEVELS: usize = 1_000;
/// Largest number of dimensions.
const MAX_DIMENSIONS: usize = 256;
/// Largest size of a level: squares of distances stay finite.
const MAX_LEVEL: f64 = 1e15;
/// Smallest distance of two levels.
const MIN_STEP: f64 = 1e-15;
/// Shortest lengthscale in units of the smallest step: below it no action tells anything of another.
const SHORTEST_LENGTHSCALE: f64 = 1e-2;
/// Longest lengthscale in units of the range: above it all levels are the same to double precision.
const LONGEST_LENGTHSCALE: f64 = 1e4;

/// One tuned quantity and the values it may take.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Dimension {
    /// What people call it.
    pub name: String,
    /// The levels, strictly increasing.
    pub values: Vec<f64>,
    /// Distance, in the unit of `values`, over which the utility is expected to stay similar.
    pub lengthscale: f64,
}

/// For people: the last digits of a product of decimal fractions are noise.
fn to_three_digits(value: f64) -> f64 {
    format!("{value:.2e}").parse().unwrap_or(value)
}

impl Dimension {
    fn validate(&self) -> Result<()> {
        let refuse = |reason: String| Err(LearnerError::InvalidDimension { dimension: self.name.clone(), reason });
        if self.values.is_empty() {
            return refuse("it has no value to try".into());
        }
        if self.values.len() > MAX_LEVELS {
            return refuse(format!("it has {} levels, at most {MAX_LEVELS} are accepted", self.values.len()));
        }
        if let Some(value) = self.values.iter().find(|v| v.is_nan() || v.abs() > MAX_LEVEL) {
            return refuse(format!("level {value} is not between {:e} and {MAX_LEVEL:e}", -MAX_LEVEL));
        }
        if let Some([low, high]) = self.values.array_windows().find(|[low, high]| low >= high) {
            return refuse(format!("values must increase, but {low} is followed by {high}"));
        }
        let steps = self.values.array_windows().map(|[low, high]| high - low);
        let nearest = steps.reduce(f64::min).unwrap_or(1.0);
        if nearest < MIN_STEP {
            return refuse(format!("levels {nearest:e} apart are nearer than {MIN_STEP:e}"));
        }
        let (shortest, longest) = match self.values.len() {
            1 => (MIN_STEP, MAX_LEVEL),
            _ => (SHORTEST_LENGTHSCALE * nearest, LONGEST_LENGTHSCALE * self.range()),
        };
        if !(self.lengthscale >= shortest && self.lengthscale <= longest) {
            return Err(LearnerError::InvalidLengthscale {
                dimension: self.name.clone(),
                lengthscale: self.lengthscale,
                shortest: to_three_digits(shortest),
                longest: to_three_digits(longest),
            });
        }
        Ok(())
    }

    /// Distance between the first and the last level; the lengthscale where there is only one level.
    pub(crate) fn range(&self) -> f64 {
        let range = self.values.last().unwrap_or(&0.0) - self.values.first().unwrap_or(&0.0);
        if range > 0.0 { range } else { self.lengthscale }
    }

    /// Mean distance between neighbouring levels; the lengthscale itself where there is only one level.
    pub(crate) fn mean_step(&self) -> f64 {
        match (self.values.first(), self.values.last()) {
            (Some(first), Some(last)) if self.values.len() > 1 => (last - first) / (self.values.len() - 1) as f64,
            _ => self.lengthscale,
        }
    }
}

/// Number of an action in its space, row-major, the last dimension running fastest.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(transparent)]
pub struct ActionIndex(pub u64);

impl fmt::Display for ActionIndex {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}

/// A validated grid of actions.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "SpaceDocument", into = "SpaceDocument")]
pub struct SearchSpace {
    dimensions: Vec<Dimension>,
    len: u64,
}

/// What is written: the dimensions alone, the rest follows.
#[derive(Serialize, Deserialize)]
struct SpaceDocument {
    dimensions: Vec<Dimension>,
}

impl TryFrom<SpaceDocument> for SearchSpace {
    type Error = LearnerError;

    fn try_from(document: SpaceDocument) -> Result<Self> {
        Self::new(document.dimensions)
    }
}

impl From<SearchSpace> for SpaceDocument {
    fn from(space: SearchSpace) -> Self {
        Self { dimensions: space.dimensions }
    }
}

impl SearchSpace {
    /// The grid of all combinations of the dimensions' levels.
    ///
    /// # Errors
    /// When there is no dimension, a dimension has no level, unordered levels, levels or a lengthscale out of range, two
    /// dimensions have one name, or the grid is too large to be counted.
    pub fn new(dimensions: Vec<Dimension>) -> Result<Self> {
        if dimensions.is_empty() {
            return Err(LearnerError::NoDimension);
        }
        let mut len = 1_u64;
        for (d, dimension) in dimensions.iter().enumerate() {
            dimension.validate()?;
            if d >= MAX_DIMENSIONS || dimensions[..d].iter().any(|other| other.name == dimension.name) {
                return Err(LearnerError::InvalidDimension {
                    dimension: dimension.name.clone(),
                    reason: if d >= MAX_DIMENSIONS {
                        format!("at most {MAX_DIMENSIONS} dimensions are accepted")
                    } else {
                        "another dimension has the same name".into()
                    },
                });
            }
            len = len
                .checked_mul(dimension.values.len() as u64)
                .filter(|&len| len <= MAX_ACTIONS)
                .ok_or(LearnerError::TooManyActions { limit: MAX_ACTIONS })?;
        }
        Ok(Self { dimensions, len })
    }

    /// The dimensions, in order.
    pub fn dimensions(&self) -> &[Dimension] {
        &self.dimensions
    }

    /// Number of actions.
    #[allow(clippy::len_without_is_empty, reason = "a search space is never empty")]
    pub fn len(&self) -> u64 {
        self.len
    }

    /// Number of actions when all of them can be looked at.
    pub(crate) fn enumerable(&self) -> Result<usize> {
        usize::try_from(self.len)
            .ok()
            .filter(|&len| len <= MAX_ENUMERATED)
            .ok_or(LearnerError::TooManyActions { limit: MAX_ENUMERATED as u64 })
    }

    /// Number of levels of every dimension.
    pub(crate) fn shape(&self) -> Vec<usize> {
        self.dimensions.iter().map(|d| d.values.len()).collect()
    }

    /// Whether the action is in the grid.
    pub fn contains(&self, action: ActionIndex) -> bool {
        action.0 < self.len
    }

    /// The action itself when it is in the grid.
    ///
    /// # Errors
    /// When it is not.
    pub fn check(&self, action: ActionIndex) -> Result<ActionIndex> {
        if self.contains(action) { Ok(action) } else { Err(LearnerError::UnknownAction { action, actions: self.len }) }
    }

    /// The level of every dimension. An index outside the grid is taken modulo the number of actions.
    pub fn levels(&self, action: ActionIndex) -> Vec<usize> {
        let mut rest = action.0;
        let mut levels = vec![0; self.dimensions.len()];
        for (level, dimension) in levels.iter_mut().zip(&self.dimensions).rev() {
            let count = dimension.values.len() as u64;
            *level = usize::try_from(rest % count).unwrap_or(0);
            rest /= count;
        }
        levels
    }

    /// The value of every dimension. An index outside the grid is taken modulo the number of actions.
    pub fn values(&self, action: ActionIndex) -> Vec<f64> {
        self.levels(action).iter().zip(&self.dimensions).map(|(&level, d)| d.values[level]).collect()
    }

    /// The action with the given level in every dimension.
    ///
    /// # Errors
    /// When the number of levels is wrong or one of them does not exist.
    pub fn index_of_levels(&self, levels: &[usize]) -> Result<ActionIndex> {
        self.check_count(levels.len())?;
        let mut index = 0_u64;
        for (&level, dimension) in levels.iter().zip(&self.dimensions) {
            let count = dimension.values.len();
            if level >= count {
                return Err(LearnerError::UnknownLevel { dimension: dimension.name.clone(), level, levels: count });
            }
            index = index * count as u64 + level as u64;
        }
        Ok(ActionIndex(index))
    }

    /// The action with the given value in every dimension, to 1e-9 of the distance between levels.
    ///
    /// # Errors
    /// When the number of values is wrong or one of them is not a level.
    pub fn index_of_values(&self, values: &[f64]) -> Result<ActionIndex> {
        self.check_count(values.len())?;
        let mut levels = Vec::with_capacity(values.len());
        for (&value, dimension) in values.iter().zip(&self.dimensions) {
            let tolerance = 1e-9 * dimension.mean_step();
            let level = dimension.values.iter().position(|v| (v - value).abs() <= tolerance).ok_or_else(|| {
                LearnerError::UnknownValue {
                    dimension: dimension.name.clone(),
                    value,
                    levels: dimension.values.clone(),
                }
            })?;
            levels.push(level);
        }
        self.index_of_levels(&levels)
    }

    fn check_count(&self, given: usize) -> Result<()> {
        let expected = self.dimensions.len();
        if given == expected { Ok(()) } else { Err(LearnerError::WrongDimensionCount { given, expected }) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn dimension(name: &str, values: &[f64]) -> Dimension {
        Dimension { name: name.into(), values: values.to_vec(), lengthscale: 1.0 }
    }

    #[test]
    fn last_dimension_runs_fastest() {
        let space = SearchSpace::new(vec![dimension("a", &[0.0, 1.0]), dimension("b", &[5.0, 6.0, 8.0])]).unwrap();
        assert_eq!(space.len(), 6);
        assert_eq!(space.levels(ActionIndex(4)), [1, 1]);
        assert_eq!(space.values(ActionIndex(5)), [1.0, 8.0]);
        for index in 0..6 {
            let action = ActionIndex(index);
            assert_eq!(space.index_of_levels(&space.levels(action)), Ok(action));
            assert_eq!(space.index_of_values(&space.values(action)), Ok(action));
        }
        assert!(space.index_of_values(&[1.0, 7.0]).is_err());
        assert!(space.index_of_levels(&[1]).is_err());
        assert!(space.index_of_levels(&[2, 0]).is_err());
        assert!(space.check(ActionIndex(6)).is_err());
    }

    #[test]
    fn impossible_spaces_are_refused() {
        for dimensions in [
            vec![],
            vec![dimension("a", &[])],
            vec![dimension("a", &[1.0, 1.0])],
            vec![dimension("a", &[2.0, 1.0])],
            vec![dimension("a", &[f64::NAN])],
            vec![dimension("a", &[1.0, f64::INFINITY])],
            vec![dimension("a", &[-1e308, 1e308])],
            vec![dimension("a", &[0.0, 5e-324])],
            vec![Dimension { lengthscale: 0.0, ..dimension("a", &[1.0]) }],
            vec![Dimension { lengthscale: 1e300, ..dimension("a", &[1.0]) }],
            vec![Dimension { lengthscale: f64::NAN, ..dimension("a", &[0.0, 1.0]) }],
            vec![Dimension { lengthscale: 0.009, ..dimension("a", &[0.0, 1.0, 3.0]) }],
            vec![Dimension { lengthscale: 30_001.0, ..dimension("a", &[0.0, 1.0, 3.0]) }],
            vec![dimension("a", &[1.0]), dimension("a", &[1.0])],
            (0..54).map(|i| dimension(&i.to_string(), &[0.0, 1.0])).collect(),
        ] {
            assert!(SearchSpace::new(dimensions).is_err());
        }
    }

    #[test]
    fn the_document_is_validated() {
        let space = SearchSpace::new(vec![dimension("a", &[0.0, 1.0])]).unwrap();
        let text = serde_json::to_string(&space).unwrap();
        assert_eq!(serde_json::from_str::<SearchSpace>(&text).unwrap(), space);
        assert!(serde_json::from_str::<SearchSpace>(&text.replace("1.0]", "-1.0]")).is_err());
    }
}
