//! The search space: the grid of all combinations of the levels of its dimensions.

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use crate::action::ActionIndex;
use crate::descriptors::ActionDescriptors;
use crate::error::{LearnerError, Result};

/// Largest number of actions: up to it, a JSON number represents every index exactly.
const MAX_ACTIONS: u64 = 1 << 53;
/// Largest number of actions for methods that evaluate the whole grid.
const MAX_ENUMERATED: usize = 1 << 20;
/// Largest number of levels of one dimension.
const MAX_LEVELS: usize = 1_000;
/// Largest number of dimensions.
const MAX_DIMENSIONS: usize = 256;
/// Largest magnitude of a level: up to it, squared distances stay finite.
const MAX_LEVEL: f64 = 1e15;
/// Smallest distance between two levels.
const MIN_STEP: f64 = 1e-15;
/// Shortest lengthscale, as a multiple of the smallest step: below it, levels are uncorrelated.
const MIN_LENGTHSCALE: f64 = 1e-2;
/// Longest lengthscale, as a multiple of the range: above it, correlations are 1 in double precision.
const MAX_LENGTHSCALE: f64 = 1e4;

/// One tuned quantity and its levels.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Dimension {
    /// Name, unique in the search space.
    pub name: String,
    /// Levels, strictly increasing; 1 to 1,000 of them.
    pub values: Vec<f64>,
    /// Lengthscale of the Gaussian process, in the unit of `values`: the distance over which utilities stay similar.
    pub lengthscale: f64,
}

/// Rounds to three digits, because the last digits of a product of decimal fractions are noise.
fn to_three_digits(value: f64) -> f64 {
    format!("{value:.2e}").parse().unwrap_or(value)
}

impl Dimension {
    fn validate(&self) -> Result<()> {
        let refuse = |reason: String| Err(LearnerError::InvalidDimension { dimension: self.name.clone(), reason });
        if self.values.is_empty() {
            return refuse("at least one value is needed".into());
        }
        if self.values.len() > MAX_LEVELS {
            return refuse(format!("it has {} values; at most {MAX_LEVELS} are allowed", self.values.len()));
        }
        if let Some(value) = self.values.iter().find(|v| v.is_nan() || v.abs() > MAX_LEVEL) {
            return refuse(format!("a value is {value}; it must be {:e} to {MAX_LEVEL:e}", -MAX_LEVEL));
        }
        if let Some([low, high]) = self.values.array_windows().find(|[low, high]| low >= high) {
            return refuse(format!("values must increase, but {high} follows {low}"));
        }
        let steps = self.values.array_windows().map(|[low, high]| high - low);
        let nearest = steps.reduce(f64::min).unwrap_or(1.0);
        if nearest < MIN_STEP {
            return refuse(format!("two values are {nearest:e} apart; the smallest distance allowed is {MIN_STEP:e}"));
        }
        let (shortest, longest) = match self.values.len() {
            1 => (MIN_STEP, MAX_LEVEL),
            _ => (MIN_LENGTHSCALE * nearest, MAX_LENGTHSCALE * self.range()),
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

    /// Distance between the first and the last level; the lengthscale if there is only one level.
    pub(crate) fn range(&self) -> f64 {
        let range = self.values.last().unwrap_or(&0.0) - self.values.first().unwrap_or(&0.0);
        if range > 0.0 { range } else { self.lengthscale }
    }

    /// Mean distance between neighbouring levels; the lengthscale if there is only one level.
    pub(crate) fn mean_step(&self) -> f64 {
        match (self.values.first(), self.values.last()) {
            (Some(first), Some(last)) if self.values.len() > 1 => (last - first) / (self.values.len() - 1) as f64,
            _ => self.lengthscale,
        }
    }
}

/// A validated search space. Its actions are numbered by [`ActionIndex`].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "SpaceDocument", into = "SpaceDocument")]
pub struct SearchSpace {
    dimensions: Vec<Dimension>,
    len: u64,
    descriptors: Option<Arc<ActionDescriptors>>,
}

/// Serialised form: the dimensions, from which the rest follows.
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
    /// If there is no dimension or more than 256, if levels do not increase, if a level or a lengthscale is out of
    /// range, if two dimensions share a name, or if the grid has more than 2^53 actions.
    pub fn new(dimensions: Vec<Dimension>) -> Result<Self> {
        if dimensions.is_empty() {
            return Err(LearnerError::NoDimension);
        }
        if dimensions.len() > MAX_DIMENSIONS {
            return Err(LearnerError::TooManyDimensions { given: dimensions.len(), limit: MAX_DIMENSIONS });
        }
        let mut len = 1_u64;
        for (d, dimension) in dimensions.iter().enumerate() {
            if dimensions[..d].iter().any(|other| other.name == dimension.name) {
                return Err(LearnerError::DuplicateDimension { dimension: dimension.name.clone() });
            }
            dimension.validate()?;
            len = len
                .checked_mul(dimension.values.len() as u64)
                .filter(|&len| len <= MAX_ACTIONS)
                .ok_or(LearnerError::TooManyActions { limit: MAX_ACTIONS })?;
        }
        Ok(Self { dimensions, len, descriptors: None })
    }

    /// The space with a descriptor for each action. Descriptors replace levels in the prior correlations of two actions. The
    /// serialised form of a space lacks the descriptors.
    ///
    /// # Errors
    /// If the number of actions differs, or is too large to evaluate all of them.
    pub fn described_by(self, descriptors: ActionDescriptors) -> Result<Self> {
        self.enumerable()?;
        let (given, expected) = (descriptors.actions(), self.len);
        if given != expected {
            return Err(LearnerError::WrongActionCount { given, expected });
        }
        Ok(Self { descriptors: Some(Arc::new(descriptors)), ..self })
    }

    /// The descriptors of the actions, if they have some.
    pub(crate) fn descriptors(&self) -> Option<&Arc<ActionDescriptors>> {
        self.descriptors.as_ref()
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

    /// Number of actions, if the grid is small enough to evaluate all of them.
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

    /// Whether the action is in the search space.
    pub fn contains(&self, action: ActionIndex) -> bool {
        action.0 < self.len
    }

    /// Returns the action if it is in the search space.
    ///
    /// # Errors
    /// [`LearnerError::UnknownAction`] if it is not.
    pub fn check(&self, action: ActionIndex) -> Result<ActionIndex> {
        if self.contains(action) { Ok(action) } else { Err(LearnerError::UnknownAction { action, actions: self.len }) }
    }

    /// Level index of each dimension, counted from 0. An index outside the space is taken modulo the number of actions.
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

    /// Value of each dimension, in its unit. An index outside the space is taken modulo the number of actions.
    pub fn values(&self, action: ActionIndex) -> Vec<f64> {
        self.levels(action).iter().zip(&self.dimensions).map(|(&level, d)| d.values[level]).collect()
    }

    /// The action with the given level index in each dimension, counted from 0.
    ///
    /// # Errors
    /// If the number of levels differs from the number of dimensions, or a level does not exist.
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

    /// The action with the given value in each dimension, to a tolerance of 1e-9 of the mean step.
    ///
    /// # Errors
    /// If the number of values differs from the number of dimensions, or a value is not a level.
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
    fn last_dimension_varies_fastest() {
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
    fn invalid_search_spaces_are_rejected() {
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
    fn deserialisation_validates_levels() {
        let space = SearchSpace::new(vec![dimension("a", &[0.0, 1.0])]).unwrap();
        let text = serde_json::to_string(&space).unwrap();
        assert_eq!(serde_json::from_str::<SearchSpace>(&text).unwrap(), space);
        assert!(serde_json::from_str::<SearchSpace>(&text.replace("1.0]", "-1.0]")).is_err());
    }
}
