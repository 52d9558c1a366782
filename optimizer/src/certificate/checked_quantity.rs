//! A check of a certificate: the worst value of a quantity, its place, and its limit.

use crate::gait::DomainTrajectory;
use crate::number_format::{figure, with_unit};
use serde::{Deserialize, Serialize};

/// The worst value of a quantity, with its limit.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Check {
    /// Name of the quantity, with the number of its constraint if it has one.
    pub name: String,
    /// Unit of value and limit; empty if dimensionless.
    pub unit: String,
    /// Worst value. `None` if it could not be determined, which fails the check.
    pub value: Option<f64>,
    /// Largest allowed value. `None` for a quantity without a limit.
    pub limit: Option<f64>,
    /// Location of the worst value: domain and time of the stride.
    pub place: String,
}

impl Check {
    /// The name with the number of the constraint behind it: `Equations of motion, forces, at nodes (C1)`.
    pub fn name_in_words(&self) -> String {
        let is_number =
            |word: &str| word.strip_prefix('C').is_some_and(|rest| rest.starts_with(|c: char| c.is_ascii_digit()));
        let (number, name) = match self.name.split_once(' ').filter(|(word, _)| is_number(word)) {
            Some((number, name)) => (format!(" ({})", number.replace('-', " to ")), name),
            None => (String::new(), self.name.as_str()),
        };
        let mut letters = name.chars();
        let first = letters.next().map(|letter| letter.to_uppercase().to_string()).unwrap_or_default();
        format!("{first}{}{number}", letters.as_str())
    }

    /// Whether the value is within its limit.
    pub fn passed(&self) -> bool {
        self.limit.is_none_or(|limit| self.value.is_some_and(|value| value <= limit))
    }

    /// The value as text.
    pub fn value_in_words(&self) -> String {
        self.value.map_or_else(|| "not determined".to_owned(), |value| self.in_unit(value))
    }

    /// The limit as text.
    pub fn limit_in_words(&self) -> String {
        self.limit.map_or_else(|| "no limit; reported only".to_owned(), |limit| self.in_unit(limit))
    }

    /// A figure with the unit, if there is one.
    fn in_unit(&self, value: f64) -> String {
        with_unit(figure(value), &self.unit)
    }
}

/// The place of a value.
#[derive(Debug, Clone, Copy)]
pub(super) struct CheckLocation<'a> {
    pub(super) domain: &'a str,
    /// Time of the stride; `None` for a value of the whole stride.
    pub(super) time_s: Option<f64>,
}

impl<'a> CheckLocation<'a> {
    /// At a fraction of the duration of a domain.
    pub(super) fn within(trajectory: &'a DomainTrajectory, share: f64) -> Self {
        let start = trajectory.time_s.first().copied().unwrap_or(0.0);
        Self { domain: &trajectory.name, time_s: Some(start + share * trajectory.duration_s) }
    }
}

/// A quantity that is measured at many places.
#[derive(Debug, Clone, Copy)]
pub(super) struct Quantity {
    pub(super) name: &'static str,
    pub(super) unit: &'static str,
    pub(super) limit: Option<f64>,
}

impl Quantity {
    /// A quantity with a limit.
    pub(super) const fn limited(name: &'static str, unit: &'static str, limit: f64) -> Self {
        Self { name, unit, limit: Some(limit) }
    }
}

/// The worst values of quantities so far.
#[derive(Debug, Default)]
pub(super) struct WorstValues {
    checks: Vec<Check>,
}

impl WorstValues {
    /// Adds a value. A value that is not finite counts as undetermined and is the worst.
    pub(super) fn add(&mut self, quantity: Quantity, value: f64, place: CheckLocation<'_>) {
        let value = value.is_finite().then_some(value);
        let words = || match place.time_s {
            Some(time_s) => format!("{}, {time_s:.4} s", place.domain),
            None => place.domain.to_owned(),
        };
        match self.checks.iter_mut().find(|c| c.name == quantity.name) {
            Some(check) => {
                let worse = match (value, check.value) {
                    (Some(value), Some(worst)) => value > worst,
                    (None, Some(_)) => true,
                    (_, None) => false,
                };
                if worse {
                    check.value = value;
                    check.place = words();
                }
            }
            None => self.checks.push(Check {
                name: quantity.name.to_owned(),
                unit: quantity.unit.to_owned(),
                value,
                limit: quantity.limit,
                place: words(),
            }),
        }
    }

    /// The checks; `where_measured` is appended to their names.
    pub(super) fn into_checks(mut self, where_measured: &str) -> Vec<Check> {
        for check in &mut self.checks {
            check.name.push_str(where_measured);
        }
        self.checks
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::certificate::Certificate;

    fn named(name: &str) -> Check {
        Check { name: name.to_owned(), unit: String::new(), value: None, limit: None, place: String::new() }
    }

    #[test]
    fn number_of_a_constraint_is_behind_its_name() {
        let words = [
            ("C1 equations of motion, forces, at nodes", "Equations of motion, forces, at nodes (C1)"),
            ("C5-C7 equilibrium of fibre and tendon", "Equilibrium of fibre and tendon (C5 to C7)"),
            ("Cost of transport", "Cost of transport"),
            ("torques of the closed loop", "Torques of the closed loop"),
        ];
        for (name, expected) in words {
            assert_eq!(named(name).name_in_words(), expected);
        }
    }

    #[test]
    fn failures_name_checks_in_plain_words() {
        let mut failed = Certificate::failed_because("C3 feet: 1 m (stride), limit 0 m");
        failed.failures.push("the gait is unstable".to_owned());
        failed.checks = vec![named("C3"), named("C3 feet")];
        assert_eq!(failed.failures_in_words(), ["Feet (C3): 1 m (stride), limit 0 m", "the gait is unstable"]);
    }
}
