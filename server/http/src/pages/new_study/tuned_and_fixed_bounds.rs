//! The editor of the search space: tuned bounds with their values, and fixed values of the others.

use crate::bound_entries::{BoundField, Unread};
use crate::bound_units;
use crate::form_errors;
use gait_learner::{Dimension, LearnerError, SearchSpace};
use gait_optimizer::TunedBounds;
use gaitwright_service::error::{Error, FieldError};
use gaitwright_service::studies::bound_grid::TABLE_I;
use serde_json::Value;
use std::collections::BTreeMap;

/// The entries of one bound.
pub(super) struct BoundEntries {
    pub(super) name: &'static str,
    pub(super) meaning: String,
    pub(super) allowed: String,
    /// Whether a number may need a unit, which numeric keypads cannot type.
    pub(super) is_angle: bool,
    pub(super) tuned: bool,
    pub(super) values: String,
    pub(super) lengthscale: String,
    pub(super) fixed: String,
}

/// The entries of the editor.
pub(super) struct SpaceEditor {
    pub(super) rows: Vec<BoundEntries>,
}

impl SpaceEditor {
    /// Reads the entries; without any, Table I of the paper.
    ///
    /// # Errors
    /// [`Error::Unreadable`] for a field that the form does not have.
    pub(super) fn typed(fields: &BTreeMap<String, String>) -> Result<Self, Error> {
        let known = |field: &str| {
            let parts = field.split_once('_');
            parts.is_some_and(|(part, bound)| {
                ["tuned", "values", "lengthscale", "fixed"].contains(&part) && TunedBounds::NAMES.contains(&bound)
            })
        };
        if let Some(field) = fields.keys().find(|field| !known(field)) {
            return Err(Error::Unreadable(Box::new(form_errors::unknown_field(field))));
        }
        let defaults = TunedBounds::default().to_array();
        let row = |(bound, name): (usize, &'static str)| {
            let (values, lengthscale) = TABLE_I[bound];
            let text = |part: &str, preset: String| fields.get(&format!("{part}_{name}")).cloned().unwrap_or(preset);
            let field = BoundField::of_values(name);
            BoundEntries {
                name,
                meaning: bound_units::meaning(name),
                allowed: field.allowed(),
                is_angle: field.is_angle(),
                tuned: fields.is_empty() || fields.contains_key(&format!("tuned_{name}")),
                values: text("values", field.list(values)),
                lengthscale: text("lengthscale", BoundField::of_differences(name).entry(lengthscale)),
                fixed: text("fixed", field.entry(defaults[bound])),
            }
        };
        Ok(Self { rows: TunedBounds::NAMES.into_iter().enumerate().map(row).collect() })
    }

    /// The search space, and the values of the bounds that are not tuned.
    ///
    /// # Errors
    /// [`Error::Invalid`] naming the field.
    pub(super) fn read(&self) -> Result<(SearchSpace, TunedBounds), Error> {
        let mut fixed = TunedBounds::default();
        let mut dimensions = Vec::new();
        for row in &self.rows {
            let of_row = BoundField::of_values(row.name);
            if !row.tuned {
                let field = format!("fixed_{}", row.name);
                let value = of_row.read(&row.fixed).map_err(|unread| refused(&field, &unread, &row.allowed))?;
                let beyond = |_| Error::invalid(&field, as_typed(&row.fixed), &row.allowed);
                fixed.set(row.name, value).map_err(beyond)?;
                continue;
            }
            let field = format!("values_{}", row.name);
            let values = of_row.read_list(&row.values).map_err(|unread| refused(&field, &unread, &row.allowed))?;
            for &value in &values {
                let beyond = |_| Error::invalid(&field, as_typed(&of_row.entry(value)), &row.allowed);
                fixed.clone().set(row.name, value).map_err(beyond)?;
            }
            let lengthscale = BoundField::of_differences(row.name)
                .read(&row.lengthscale)
                .map_err(|unread| refused(&format!("lengthscale_{}", row.name), &unread, "a number above 0"))?;
            dimensions.push(Dimension { name: row.name.to_owned(), values, lengthscale });
        }
        let space = SearchSpace::new(dimensions).map_err(|error| match error {
            LearnerError::NoDimension => {
                FieldError::in_words("tuned_a1", "No bound is tuned. Tick at least one.").into()
            }
            LearnerError::InvalidDimension { dimension, reason } => Error::invalid(
                &format!("values_{dimension}"),
                self.values_of(&dimension),
                &format!("a valid list of values ({reason})"),
            ),
            LearnerError::InvalidLengthscale { dimension, shortest, longest, .. } => {
                let shown = |value: f64| bound_units::number(&dimension, value);
                let allowed = format!("{} to {}", shown(shortest), bound_units::in_unit(&dimension, longest));
                let typed = self.rows.iter().find(|row| row.name == dimension).map_or("", |row| &row.lengthscale);
                Error::invalid(&format!("lengthscale_{dimension}"), as_typed(typed), &allowed)
            }
            LearnerError::TooManyActions { limit } => {
                let field = self.rows.iter().find(|row| row.tuned).map_or("a1", |row| row.name);
                let message =
                    format!("The values of the bounds have more than {limit} combinations. Give fewer values.");
                FieldError::in_words(&format!("values_{field}"), &message).into()
            }
            other => Error::Learner(other),
        })?;
        Ok((space, fixed))
    }

    fn values_of(&self, name: &str) -> String {
        self.rows.iter().find(|row| row.name == name).map(|row| row.values.clone()).unwrap_or_default()
    }
}

/// The refusal of an entry that is not read.
fn refused(field: &str, unread: &Unread, allowed: &str) -> Error {
    match &unread.doubt {
        Some(doubt) => FieldError::in_words(field, &format!("{field}: {doubt}")).into(),
        None => Error::invalid(field, as_typed(&unread.part), allowed),
    }
}

/// A refused entry: a number if it is one.
fn as_typed(text: &str) -> Value {
    let text = text.trim();
    text.parse::<f64>().map_or_else(|_| text.into(), Value::from)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, clippy::panic)]
    use super::*;
    use gaitwright_service::studies::bound_grid::table_i;

    fn typed(fields: &[(&str, &str)]) -> BTreeMap<String, String> {
        fields.iter().map(|(name, value)| ((*name).to_owned(), (*value).to_owned())).collect()
    }

    fn refused_field(fields: &[(&str, &str)]) -> String {
        match SpaceEditor::typed(&typed(fields)).and_then(|editor| editor.read()) {
            Err(Error::Invalid(field)) => field.field,
            other => format!("{:?}", other.map(|_| ())),
        }
    }

    #[test]
    fn empty_form_gives_table_i() {
        let (space, fixed) = SpaceEditor::typed(&BTreeMap::new()).unwrap().read().unwrap();
        assert_eq!((space, fixed), (table_i().unwrap(), TunedBounds::default()));
    }

    #[test]
    fn form_tunes_one_bound_and_fixes_another() {
        let fields = typed(&[("tuned_a5", "on"), ("values_a5", "0; 0.02 0.04"), ("fixed_a6", "14.32")]);
        let (space, fixed) = SpaceEditor::typed(&fields).unwrap().read().unwrap();
        assert_eq!(space.dimensions().len(), 1);
        assert_eq!(space.dimensions()[0].values, [0.0, 0.02, 0.04]);
        assert_eq!(fixed, TunedBounds { a6: 0.25, ..TunedBounds::default() });
    }

    #[test]
    fn error_gives_rounded_ends_of_the_range() {
        let fields = typed(&[("tuned_a3", "on"), ("lengthscale_a3", "0")]);
        let Err(Error::Invalid(field)) = SpaceEditor::typed(&fields).and_then(|editor| editor.read()) else { panic!() };
        assert_eq!((field.field.as_str(), field.allowed.as_deref()), ("lengthscale_a3", Some("0.001 to 2000 m/s")));
    }

    #[test]
    fn errors_name_the_wrong_field() {
        assert_eq!(refused_field(&[("tuned_a5", "on"), ("values_a5", "0, high")]), "values_a5");
        assert_eq!(refused_field(&[("tuned_a5", "on"), ("values_a5", "0, 7")]), "values_a5");
        assert_eq!(refused_field(&[("tuned_a5", "on"), ("values_a5", "")]), "values_a5");
        assert_eq!(refused_field(&[("tuned_a5", "on"), ("lengthscale_a5", "wide")]), "lengthscale_a5");
        assert_eq!(refused_field(&[("tuned_a1", "on"), ("lengthscale_a1", "-5")]), "lengthscale_a1");
        assert_eq!(refused_field(&[("tuned_a5", "on"), ("fixed_a6", "NaN")]), "fixed_a6");
        assert_eq!(refused_field(&[("fixed_a6", "5.73")]), "tuned_a1");
        // 1,000 values of each bound within its range.
        let mut every = Vec::new();
        for (name, (low, high)) in TunedBounds::NAMES.into_iter().zip(TunedBounds::RANGES) {
            let value = |step: usize| (low + (high - low) * step as f64 / 1000.0).to_string();
            every.push((format!("tuned_{name}"), "on".to_owned()));
            every.push((format!("values_{name}"), (0..1000).map(value).collect::<Vec<_>>().join(" ")));
            every.push((format!("lengthscale_{name}"), (high - low).to_string()));
        }
        let every: Vec<(&str, &str)> = every.iter().map(|(name, value)| (name.as_str(), value.as_str())).collect();
        assert_eq!(refused_field(&every), "values_a1");
        let unknown = SpaceEditor::typed(&typed(&[("values_a0", "1")])).err().unwrap();
        assert_eq!(unknown.to_string(), "The form has no field values_a0.");
    }
}
