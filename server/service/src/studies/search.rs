//! Search spaces: grids over the bounds a1 to a8, and the bounds of each action.

use gait_learner::{ActionIndex, Dimension, LearnerError, SearchSpace};
use gait_optimizer::{ModelError, TunedBounds};

/// Values and lengthscale of each bound in Table I of the paper: 11,664 actions.
pub const TABLE_I: [(&str, &[f64], f64); 8] = [
    ("a1", &[15.0, 20.0], 5.0),
    ("a2", &[70.0, 80.0, 90.0], 10.0),
    ("a3", &[0.3, 0.4, 0.5], 0.1),
    ("a4", &[1.2, 1.3, 1.4], 0.1),
    ("a5", &[0.0, 0.013, 0.026, 0.039], 0.013),
    ("a6", &[0.0, 0.1, 0.2, 0.3, 0.4, 0.5], 0.1),
    ("a7", &[20.0, 35.0, 50.0], 15.0),
    ("a8", &[20.0, 30.0, 40.0], 10.0),
];

/// The search space of Table I.
///
/// # Errors
/// Never for this table; the signature is that of the constructor.
pub fn table_i() -> Result<SearchSpace, LearnerError> {
    SearchSpace::new(
        TABLE_I
            .iter()
            .map(|(name, values, lengthscale)| Dimension {
                name: (*name).to_owned(),
                values: values.to_vec(),
                lengthscale: *lengthscale,
            })
            .collect(),
    )
}

/// The bounds of an action: its values replace those of `base`.
///
/// # Errors
/// [`ModelError`] naming the bound that is unknown or out of range.
pub fn bounds_of(space: &SearchSpace, base: TunedBounds, action: ActionIndex) -> Result<TunedBounds, ModelError> {
    let mut bounds = base;
    for (dimension, value) in space.dimensions().iter().zip(space.values(action)) {
        bounds.set(&dimension.name, value)?;
    }
    bounds.validate()?;
    Ok(bounds)
}

/// Attributes an unknown bound to the field `search_space`.
fn in_search_space(error: ModelError) -> ModelError {
    match error {
        ModelError::Unknown { value, known, .. } => {
            ModelError::Unknown { field: "search_space".to_owned(), value, known }
        }
        other => other,
    }
}

/// Checks that every dimension is a bound and that every combination of values makes valid bounds.
///
/// # Errors
/// [`ModelError`] naming the bound.
pub fn validate(space: &SearchSpace, base: TunedBounds) -> Result<(), ModelError> {
    for dimension in space.dimensions() {
        for &value in &dimension.values {
            base.clone().set(&dimension.name, value).map_err(in_search_space)?;
        }
    }
    // Only a3 < a4 couples bounds, so the largest a3 with the smallest a4 is the critical combination.
    let mut tightest = base;
    for dimension in space.dimensions() {
        let chosen = if dimension.name == "a3" { dimension.values.last() } else { dimension.values.first() };
        tightest.set(&dimension.name, chosen.copied().unwrap_or_default())?;
    }
    tightest.validate()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn table_i_has_the_published_number_of_actions() {
        let space = table_i().unwrap();
        assert_eq!(space.len(), 11_664);
        validate(&space, TunedBounds::default()).unwrap();
        let last = bounds_of(&space, TunedBounds::default(), ActionIndex(11_663)).unwrap();
        assert_eq!(last.to_array(), [20.0, 90.0, 0.5, 1.4, 0.039, 0.5, 50.0, 40.0]);
    }

    #[test]
    fn untuned_bounds_keep_their_values() {
        let space =
            SearchSpace::new(vec![Dimension { name: "a5".to_owned(), values: vec![0.0, 0.02], lengthscale: 0.02 }])
                .unwrap();
        let base = TunedBounds { a1: 17.0, ..TunedBounds::default() };
        let bounds = bounds_of(&space, base, ActionIndex(1)).unwrap();
        assert_eq!(bounds, TunedBounds { a5: 0.02, ..base });
    }

    #[test]
    fn grids_with_invalid_actions_are_refused() {
        let dimension = |name: &str, values: &[f64]| {
            SearchSpace::new(vec![Dimension { name: name.to_owned(), values: values.to_vec(), lengthscale: 1.0 }])
                .unwrap()
        };
        assert!(validate(&dimension("a9", &[1.0]), TunedBounds::default()).is_err());
        assert!(validate(&dimension("a1", &[1000.0]), TunedBounds::default()).is_err());
        assert!(validate(&dimension("a3", &[0.3, 1.5]), TunedBounds::default()).is_err());
    }
}
