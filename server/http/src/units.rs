//! The units in which pages show heights and body masses of people: a preference of the browser, kept in a cookie. Figures of
//! studies and gaits have SI units everywhere.

use crate::authentication::cookie_in;
use crate::body_measures::{feet_and_inches, pounds};
use axum::extract::FromRequestParts;
use axum::http::HeaderValue;
use axum::http::request::Parts;
use gaitwright_service::error::Error;
use serde::Deserialize;
use std::convert::Infallible;

const COOKIE: &str = "gaitwright_units";
/// How long a browser keeps the preference: a year, s.
const KEPT_S: u32 = 365 * 24 * 3600;

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
        let text = format!("{COOKIE}={}; Path=/; HttpOnly; SameSite=Lax; Max-Age={KEPT_S}", self.as_str());
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
}

impl<S: Send + Sync> FromRequestParts<S> for Units {
    type Rejection = Infallible;

    async fn from_request_parts(parts: &mut Parts, _: &S) -> Result<Self, Infallible> {
        let customary = cookie_in(&parts.headers, COOKIE) == Some(Self::Customary.as_str());
        Ok(if customary { Self::Customary } else { Self::Si })
    }
}
