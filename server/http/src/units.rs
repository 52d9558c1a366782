//! The units in which pages show heights and body masses of people: a preference of the browser, kept in a cookie. Figures of
//! studies and gaits have SI units everywhere.

use crate::authentication::cookie_in;
use crate::body_measures::{self, feet_and_inches, pounds};
use crate::refused_fields::FieldLabels;
use axum::extract::FromRequestParts;
use axum::http::HeaderValue;
use axum::http::request::Parts;
use gaitwright_service::error::Error;
use serde::Deserialize;
use std::convert::Infallible;

const COOKIE: &str = "gaitwright_units";
/// How long a browser keeps the preference: a year, s.
const COOKIE_LIFETIME_S: u32 = 365 * 24 * 3600;

/// Units of heights and body masses.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Units {
    /// Metres and kilograms.
    #[default]
    Si,
    /// Feet, inches and pounds.
    Customary,
}

impl Units {
    fn as_str(self) -> &'static str {
        match self {
            Self::Si => "si",
            Self::Customary => "customary",
        }
    }

    /// The Set-Cookie header that keeps the preference. It identifies nobody.
    pub(crate) fn cookie(self) -> Result<HeaderValue, Error> {
        let text = format!("{COOKIE}={}; Path=/; HttpOnly; SameSite=Lax; Max-Age={COOKIE_LIFETIME_S}", self.as_str());
        HeaderValue::from_str(&text).map_err(|error| Error::Internal(error.to_string()))
    }
}

// Templates pass references.
#[allow(clippy::trivially_copy_pass_by_ref)]
impl Units {
    pub(crate) fn are_customary(self) -> bool {
        self == Self::Customary
    }

    /// `1.73 m`, or `5 ft 8 in` to the inch.
    pub(crate) fn height(self, height_m: &f64) -> String {
        match self {
            Self::Si => format!("{height_m} m"),
            Self::Customary => feet_and_inches(*height_m),
        }
    }

    /// `65.7 kg`, or `145 lb` to the pound.
    pub(crate) fn mass(self, mass_kg: &f64) -> String {
        match self {
            Self::Si => format!("{mass_kg} kg"),
            Self::Customary => pounds(*mass_kg),
        }
    }

    /// The same in a table, whose heading has the unit.
    pub(crate) fn height_in_table(self, height_m: &f64) -> String {
        if self == Self::Si { height_m.to_string() } else { self.height(height_m) }
    }

    /// The same in a table, whose heading has the unit.
    pub(crate) fn mass_in_table(self, mass_kg: &f64) -> String {
        if self == Self::Si { mass_kg.to_string() } else { self.mass(mass_kg) }
    }

    /// The heading of such a column.
    pub(crate) fn height_heading(self) -> &'static str {
        if self == Self::Si { "Height, m" } else { "Height" }
    }

    /// The heading of such a column.
    pub(crate) fn mass_heading(self) -> &'static str {
        if self == Self::Si { "Body mass, kg" } else { "Body mass" }
    }

    /// The labels of a form with the fields `height_m` and `body_mass_kg`, whose labels have no unit.
    pub(crate) fn with_headings(self, labels: FieldLabels) -> Vec<(String, String)> {
        let heading = |&(name, label): &(&str, &str)| {
            let label = match (name, label) {
                ("height_m", "Height") => self.height_heading(),
                ("height_m", _) => self.measured_height_heading(),
                ("body_mass_kg", _) => self.mass_heading(),
                _ => label,
            };
            (name.to_owned(), label.to_owned())
        };
        labels.iter().map(heading).collect()
    }

    /// The label of the height of a person whose gait was measured.
    pub(crate) fn measured_height_heading(self) -> &'static str {
        if self == Self::Si { "Height of the measured person, m" } else { "Height of the measured person" }
    }

    /// The text in an empty field for a height.
    pub(crate) fn height_example(self) -> &'static str {
        if self == Self::Si { "1.73" } else { "5 ft 8 in" }
    }

    /// The text in an empty field for a body mass.
    pub(crate) fn mass_example(self) -> &'static str {
        if self == Self::Si { "65.7" } else { "145 lb" }
    }

    /// Accepted entries of a height.
    pub(crate) fn height_help(self) -> &'static str {
        if self == Self::Si {
            "1.4 to 2.2, or in feet and inches, such as 5 ft 8 in"
        } else {
            "4 ft 8 in to 7 ft 2 in, or in metres, such as 1.73 m"
        }
    }

    /// Accepted entries of a body mass.
    pub(crate) fn mass_help(self) -> &'static str {
        if self == Self::Si {
            "35 to 160, or in pounds, such as 145 lb"
        } else {
            "78 to 352 lb, or in kilograms, such as 65.7 kg"
        }
    }

    /// An exact height in a field, which is not rounded to an inch.
    pub(crate) fn height_entry(self, height_m: f64) -> String {
        if self == Self::Si { height_m.to_string() } else { Self::Si.height(&height_m) }
    }

    /// An exact body mass in a field, which is not rounded to a pound.
    pub(crate) fn mass_entry(self, mass_kg: f64) -> String {
        if self == Self::Si { mass_kg.to_string() } else { Self::Si.mass(&mass_kg) }
    }

    /// The value of the hidden field `units`, which says how the numbers of a form are meant.
    pub(crate) fn name(&self) -> &'static str {
        self.as_str()
    }

    /// Reads a height, m. A number without a unit is in metres, or refused among feet and inches.
    ///
    /// # Errors
    /// [`Error::Invalid`] naming the field.
    pub(crate) fn read_height(self, field: &str, text: &str) -> Result<f64, Error> {
        if self == Self::Customary && is_bare(text) {
            return Err(Error::invalid(field, text, "feet and inches, such as 5 ft 9 in, or metres, such as 1.75 m"));
        }
        body_measures::height_m(field, text)
    }

    /// Reads a body mass, kg. A number without a unit is in kilograms, or in pounds among feet and inches.
    ///
    /// # Errors
    /// [`Error::Invalid`] naming the field.
    pub(crate) fn read_mass(self, field: &str, text: &str) -> Result<f64, Error> {
        if self == Self::Customary && is_bare(text) {
            return body_measures::mass_kg(field, &format!("{text} lb"));
        }
        body_measures::mass_kg(field, text)
    }

    /// Height, m, and body mass, kg, as typed in the fields of a form.
    ///
    /// # Errors
    /// [`Error::Invalid`] naming the field.
    pub(crate) fn read_height_and_mass(self, height: &str, mass: &str) -> Result<(f64, f64), Error> {
        Ok((self.read_height("height_m", height)?, self.read_mass("body_mass_kg", mass)?))
    }
}

/// Whether a text is a number without a unit.
fn is_bare(text: &str) -> bool {
    text.trim().parse::<f64>().is_ok()
}

impl<S: Send + Sync> FromRequestParts<S> for Units {
    type Rejection = Infallible;

    async fn from_request_parts(parts: &mut Parts, _: &S) -> Result<Self, Infallible> {
        let customary = cookie_in(&parts.headers, COOKIE) == Some(Self::Customary.as_str());
        Ok(if customary { Self::Customary } else { Self::Si })
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    #[test]
    fn number_without_a_unit_is_in_the_units_of_its_form() {
        assert_eq!(Units::Si.read_mass("body_mass_kg", "145").unwrap(), 145.0);
        assert_eq!(Units::Customary.read_mass("body_mass_kg", " 145 ").unwrap(), 65.77);
        assert_eq!(Units::Si.read_height("height_m", "1.73").unwrap(), 1.73);
        assert!(matches!(Units::Customary.read_height("height_m", "68"), Err(Error::Invalid(_))));
    }

    #[test]
    fn exact_values_stay_exact_in_fields_of_either_units() {
        for units in [Units::Si, Units::Customary] {
            let (height, mass) = (units.height_entry(1.7272), units.mass_entry(65.7));
            assert_eq!(units.read_height_and_mass(&height, &mass).unwrap(), (1.7272, 65.7));
        }
    }
}
