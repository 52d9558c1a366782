//! Search spaces: grids over the tuned bounds, and the bounds of each action.

use crate::error::{Error, FieldError};
use gait_learner::{ActionIndex, Dimension, LearnerError, SearchSpace};
use gait_optimizer::{ModelError, TunedBounds};
use serde::Deserialize;
use serde_json::json;

/// Values and lengthscale of each bound in Table I of the paper, in the order of an action: 11,664 actions. A bound
/// that the table lacks has one value.
pub const TABLE_I: [(&[f64], f64); TunedBounds::COUNT] = [
    (&[15.0, 20.0], 5.0),
    (&[70.0, 80.0, 90.0], 10.0),
    (&[0.3, 0.4, 0.5], 0.1),
    (&[1.2, 1.3, 1.4], 0.1),
    (&[0.0, 0.013, 0.026, 0.039], 0.013),
    (&[0.0, 0.1, 0.2, 0.3, 0.4, 0.5], 0.1),
    (&[20.0, 35.0, 50.0], 15.0),
    (&[20.0, 30.0, 40.0], 10.0),
];

/// A search space as a request states it.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RequestedSearchSpace {
    /// One dimension for each tuned bound.
    pub dimensions: Vec<Dimension>,
}

impl From<SearchSpace> for RequestedSearchSpace {
    fn from(space: SearchSpace) -> Self {
        Self { dimensions: space.dimensions().to_vec() }
    }
}

impl RequestedSearchSpace {
    /// The search space.
    ///
    /// # Errors
    /// [`Error::Invalid`] with the path of the field.
    pub fn checked(self) -> Result<SearchSpace, Error> {
        const FIELD: &str = "search_space.dimensions";
        let at = |name: &str| self.dimensions.iter().position(|dimension| dimension.name == name).unwrap_or_default();
        match SearchSpace::new(self.dimensions.clone()) {
            Ok(space) => Ok(space),
            Err(LearnerError::NoDimension) => Err(Error::invalid(FIELD, json!([]), "a list of at least one dimension")),
            Err(LearnerError::TooManyDimensions { given, limit }) => {
                let message = format!("{FIELD} has {given} entries; it must be a list of at most {limit} dimensions.");
                Err(FieldError::in_words(FIELD, &message).into())
            }
            Err(LearnerError::DuplicateDimension { dimension }) => {
                let last = self.dimensions.iter().rposition(|other| other.name == dimension).unwrap_or_default();
                let field = format!("{FIELD}[{last}].name");
                Err(Error::invalid(&field, dimension, "a name that no other dimension has"))
            }
            Err(LearnerError::InvalidDimension { dimension, reason }) => {
                let at = at(&dimension);
                let values = self.dimensions.get(at).map(|dimension| json!(dimension.values)).unwrap_or_default();
                Err(Error::invalid(
                    &format!("{FIELD}[{at}].values"),
                    values,
                    &format!("a valid list of values ({reason})"),
                ))
            }
            Err(LearnerError::InvalidLengthscale { dimension, lengthscale, shortest, longest }) => {
                let field = format!("{FIELD}[{}].lengthscale", at(&dimension));
                Err(Error::invalid(&field, lengthscale, &format!("{shortest} to {longest}")))
            }
            Err(other) => Err(FieldError::in_words(FIELD, &format!("{FIELD}: {other}.")).into()),
        }
    }
}

/// The search space of Table I.
///
/// # Errors
/// Never for this table; the signature is that of the constructor.
pub fn table_i() -> Result<SearchSpace, LearnerError> {
    SearchSpace::new(
        TunedBounds::NAMES
            .iter()
            .zip(TABLE_I)
            .map(|(name, (values, lengthscale))| Dimension {
                name: (*name).to_owned(),
                values: values.to_vec(),
                lengthscale,
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

/// The action with these bounds, if the search space has it.
pub fn action_of(space: &SearchSpace, base: TunedBounds, bounds: TunedBounds) -> Option<ActionIndex> {
    let all = bounds.to_array();
    let value = |dimension: &Dimension| Some(all[TunedBounds::NAMES.iter().position(|name| *name == dimension.name)?]);
    let values: Option<Vec<f64>> = space.dimensions().iter().map(value).collect();
    let action = space.index_of_values(&values?).ok()?;
    bounds_of(space, base, action).is_ok_and(|found| found == bounds).then_some(action)
}

/// The action whose values are nearest to these bounds. The smaller value wins a tie.
///
/// # Errors
/// If a dimension is not a bound.
pub fn nearest_action(space: &SearchSpace, bounds: TunedBounds) -> Result<ActionIndex, LearnerError> {
    let all = bounds.to_array();
    let nearest = |dimension: &Dimension| {
        let bound = TunedBounds::NAMES.iter().position(|name| *name == dimension.name);
        let wanted = bound.map_or(f64::NAN, |bound| all[bound]);
        let distance = |level: &usize| (dimension.values[*level] - wanted).abs();
        (0..dimension.values.len()).min_by(|a, b| distance(a).total_cmp(&distance(b))).unwrap_or_default()
    };
    space.index_of_levels(&space.dimensions().iter().map(nearest).collect::<Vec<_>>())
}

/// Checks that every dimension is a bound and that every combination of values makes valid bounds.
///
/// # Errors
/// [`FieldError`] with the path of the field.
pub fn validate(space: &SearchSpace, base: TunedBounds) -> Result<(), FieldError> {
    for (at, dimension) in space.dimensions().iter().enumerate() {
        let within = |error: ModelError| {
            let part = format!("search_space.dimensions[{at}]");
            let unknown = matches!(error, ModelError::Unknown { .. });
            let refused = FieldError::from(error);
            let field = if unknown { "name" } else { "values" };
            let message = refused.message.strip_prefix(&refused.field).map(|rest| format!("{field}{rest}"));
            FieldError { field: field.to_owned(), message: message.unwrap_or(refused.message), ..refused }.within(&part)
        };
        for &value in &dimension.values {
            base.clone().set(&dimension.name, value).map_err(within)?;
        }
    }
    // Only a3 < a4 couples bounds, so the largest a3 with the smallest a4 is the critical combination.
    let mut tightest = base;
    for dimension in space.dimensions() {
        let chosen = if dimension.name == "a3" { dimension.values.last() } else { dimension.values.first() };
        tightest.set(&dimension.name, chosen.copied().unwrap_or_default())?;
    }
    tightest.validate().map_err(|error| FieldError::from(error).within("search_space"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nearest_action_has_the_nearest_value_of_each_bound() {
        let (space, default) = (table_i().unwrap(), TunedBounds::default());
        assert_eq!(nearest_action(&space, default).ok(), action_of(&space, default, default));
        let between = TunedBounds { a1: 17.5, a2: 86.0, ..default };
        let nearest = nearest_action(&space, between).unwrap();
        assert_eq!(bounds_of(&space, default, nearest).unwrap(), TunedBounds { a1: 15.0, a2: 90.0, ..default });
    }

    #[test]
    fn table_i_has_the_published_number_of_actions() {
        let space = table_i().unwrap();
        assert_eq!(space.len(), 11_664);
        validate(&space, TunedBounds::default()).unwrap();
        let last = bounds_of(&space, TunedBounds::default(), ActionIndex(11_663)).unwrap();
        assert_eq!(last, TunedBounds { a3: 0.5, a5: 0.039, ..TunedBounds::default() });
    }

    #[test]
    fn refused_dimensions_are_named_with_what_is_allowed() {
        let dimension =
            |name: &str, values: &[f64]| Dimension { name: name.to_owned(), values: values.to_vec(), lengthscale: 1.0 };
        let refused = |dimensions: Vec<Dimension>| match (RequestedSearchSpace { dimensions }).checked() {
            Err(Error::Invalid(field)) => (field.field, field.message),
            other => panic!("{other:?}"),
        };
        let (field, message) = refused(Vec::new());
        assert_eq!(field, "search_space.dimensions");
        assert_eq!(message, "search_space.dimensions is []; it must be a list of at least one dimension.");
        let (field, message) = refused(vec![dimension("a1", &[20.0]), dimension("a1", &[20.0, 15.0])]);
        assert_eq!(field, "search_space.dimensions[1].name");
        assert!(message.ends_with("it must be a name that no other dimension has."), "{message}");
        let (field, message) = refused((0..257).map(|i| dimension(&format!("a{i}"), &[1.0])).collect());
        assert_eq!(field, "search_space.dimensions");
        assert!(message.contains("has 257 entries") && message.contains("at most 256 dimensions"), "{message}");
        let (field, message) = refused(vec![dimension("a1", &[20.0]), dimension("a2", &[80.0, 70.0])]);
        assert_eq!(field, "search_space.dimensions[1].values");
        assert!(message.contains("it must be a valid list of values"), "{message}");
    }

    #[test]
    fn untuned_bounds_keep_their_values() {
        let space =
            SearchSpace::new(vec![Dimension { name: "a5".to_owned(), values: vec![0.0, 0.02], lengthscale: 0.02 }])
                .unwrap();
        let base = TunedBounds { a1: 17.0, ..TunedBounds::default() };
        let bounds = bounds_of(&space, base, ActionIndex(1)).unwrap();
        assert_eq!(bounds, TunedBounds { a5: 0.02, ..base });
        assert_eq!(action_of(&space, base, bounds), Some(ActionIndex(1)));
        assert_eq!(action_of(&space, TunedBounds::default(), bounds), None);
        assert_eq!(action_of(&space, base, TunedBounds { a5: 0.01, ..base }), None);
    }

    #[test]
    fn grids_with_invalid_actions_are_refused() {
        let dimension = |name: &str, values: &[f64]| {
            SearchSpace::new(vec![Dimension { name: name.to_owned(), values: values.to_vec(), lengthscale: 1.0 }])
                .unwrap()
        };
        assert!(validate(&dimension("a0", &[1.0]), TunedBounds::default()).is_err());
        assert!(validate(&dimension("a1", &[1000.0]), TunedBounds::default()).is_err());
        assert!(validate(&dimension("a3", &[0.3, 1.5]), TunedBounds::default()).is_err());
    }
}
