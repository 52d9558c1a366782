//! The tuned constraint bounds (Table I of the paper).

use crate::model_error::ModelError;
use crate::number_format::with_unit;
use serde::{Deserialize, Serialize};
use std::fmt::Display;

const LOWER: bool = true;
const UPPER: bool = false;

/// Defines [`TunedBounds`] from one list, in the order of an action.
macro_rules! tuned_bounds {
    ($($(#[$says:meta])* $name:ident: $is_lower:ident, $default:literal, $range:expr, $quantity:literal, $unit:literal;)+) => {
        /// The tuned bounds. Defaults are the loosest values of Table I.
        #[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
        #[serde(deny_unknown_fields, default)]
        pub struct TunedBounds {
            $($(#[$says])* pub $name: f64,)+
        }

        impl Default for TunedBounds {
            fn default() -> Self {
                Self { $($name: $default,)+ }
            }
        }

        impl TunedBounds {
            /// Number of bounds.
            pub const COUNT: usize = [$($is_lower),+].len();
            /// Names, in the order of an action.
            pub const NAMES: [&'static str; Self::COUNT] = [$(stringify!($name)),+];
            /// Whether each bound is a lower bound, in the order of an action. A lower bound is loosest at its minimum.
            pub const IS_LOWER: [bool; Self::COUNT] = [$($is_lower),+];
            /// Allowed range of each bound, in the order of an action.
            pub const RANGES: [(f64, f64); Self::COUNT] = [$($range),+];
            /// Quantity that each bound limits, with its unit, in the order of an action.
            pub const MEANINGS: [&'static str; Self::COUNT] = [$(concat!($quantity, ", ", $unit)),+];
            /// Quantity that each bound limits, in the order of an action.
            pub const QUANTITIES: [&'static str; Self::COUNT] = [$($quantity),+];
            /// Unit of each bound, in the order of an action.
            pub const UNITS: [&'static str; Self::COUNT] = [$($unit),+];

            /// Values, in the order of an action.
            pub fn to_array(self) -> [f64; Self::COUNT] {
                [$(self.$name),+]
            }

            fn slots(&mut self) -> [&mut f64; Self::COUNT] {
                [$(&mut self.$name),+]
            }

            /// Bounds from values in the order of an action, not validated.
            pub(crate) fn of_array([$($name),+]: [f64; Self::COUNT]) -> Self {
                Self { $($name),+ }
            }

            /// Validated bounds from values in the order of an action.
            ///
            /// # Errors
            /// [`ModelError::OutOfRange`] naming the bound.
            pub fn from_array(values: [f64; Self::COUNT]) -> Result<Self, ModelError> {
                let bounds = Self::of_array(values);
                bounds.validate()?;
                Ok(bounds)
            }
        }
    };
}

tuned_bounds! {
    /// Upper bound of the magnitude of every coordinate velocity, rad/s (m/s for the hip point).
    a1: UPPER, 20.0, (1.0, 100.0), "coordinate velocity", "rad/s";
    /// Upper bound of the magnitude of every coordinate acceleration, rad/s² (m/s² for the hip point).
    a2: UPPER, 90.0, (5.0, 1000.0), "coordinate acceleration", "rad/s²";
    /// Lower bound of the hip velocity v_hip, m/s.
    a3: LOWER, 0.3, (0.05, 3.0), "minimum hip velocity", "m/s";
    /// Upper bound of the hip velocity v_hip, m/s.
    a4: UPPER, 1.4, (0.05, 3.0), "maximum hip velocity", "m/s";
    /// Lower bound of the swing-foot clearance at mid-swing, m.
    a5: LOWER, 0.0, (0.0, 0.3), "swing-foot clearance", "m";
    /// Upper bound of the magnitude of the torso lean, rad.
    a6: UPPER, 0.5, (0.0, 1.0), "torso lean", "rad";
    /// Upper bound of the magnitude of both hip angles, degrees.
    a7: UPPER, 50.0, (5.0, 68.0), "hip angle", "°";
    /// Upper bound of the magnitude of both ankle angles, degrees.
    a8: UPPER, 40.0, (5.0, 60.0), "ankle angle", "°";
}

impl TunedBounds {
    /// Unit of the bound with this name; empty for any other name.
    pub fn unit_of(name: &str) -> &'static str {
        Self::place_of(name).map_or("", |place| Self::UNITS[place])
    }

    /// Quantity that the bound with this name limits; empty for any other name.
    pub fn quantity_of(name: &str) -> &'static str {
        Self::place_of(name).map_or("", |place| Self::QUANTITIES[place])
    }

    /// The value with the unit of the bound with this name: `0.5 m/s`, `15°`.
    pub fn in_unit(name: &str, value: impl Display) -> String {
        with_unit(value, Self::unit_of(name))
    }

    /// Place of the bound with this name in an action.
    pub fn place_of(name: &str) -> Option<usize> {
        Self::NAMES.iter().position(|known| *known == name)
    }

    /// Sets one bound by name. [`Self::validate`] checks the bounds against each other.
    ///
    /// # Errors
    /// [`ModelError::Unknown`] for any other name, [`ModelError::OutOfRange`] for a value outside its range.
    pub fn set(&mut self, name: &str, value: f64) -> Result<(), ModelError> {
        let Some(index) = Self::place_of(name) else {
            return Err(ModelError::Unknown {
                field: "bounds".to_owned(),
                value: name.to_owned(),
                known: format!("one of {}", Self::NAMES.join(", ")),
            });
        };
        ModelError::check_related_range(name, value, Self::RANGES[index], (Self::unit_of(name), ""))?;
        *self.slots()[index] = value;
        Ok(())
    }

    /// Parses `a1=20,a5=0.013`. The other bounds keep their defaults.
    ///
    /// # Errors
    /// [`ModelError`] with the item that is malformed, repeated or out of range.
    pub fn parse(text: &str) -> Result<Self, ModelError> {
        let mut bounds = Self::default();
        let mut seen: Vec<&str> = Vec::new();
        let items = (!text.trim().is_empty()).then(|| text.split(',').map(str::trim));
        for item in items.into_iter().flatten() {
            let malformed = |reason: &str| ModelError::Malformed {
                what: format!("bounds item {item:?}"),
                reason: reason.to_owned(),
            };
            let (name, value) = item.split_once('=').ok_or_else(|| malformed("expected NAME=VALUE, as in a5=0.013"))?;
            let (name, value) = (name.trim(), value.trim());
            if !Self::NAMES.contains(&name) {
                return Err(malformed(&format!("{name:?} is not a bound; the bounds are {}", Self::NAMES.join(", "))));
            }
            let value: f64 = value.parse().map_err(|_| malformed("the value is not a number"))?;
            if seen.contains(&name) {
                return Err(malformed("this bound is given twice"));
            }
            bounds.set(name, value)?;
            seen.push(name);
        }
        bounds.validate()?;
        Ok(bounds)
    }

    /// Checks that each bound is in its range and that a3 is less than a4.
    ///
    /// # Errors
    /// [`ModelError::OutOfRange`] with the bound.
    pub fn validate(&self) -> Result<(), ModelError> {
        for ((name, value), range) in Self::NAMES.iter().zip(self.to_array()).zip(Self::RANGES) {
            ModelError::check_related_range(name, value, range, (Self::unit_of(name), ""))?;
        }
        // The interior-point method needs an interval of hip velocities with an interior.
        let below_a4 = (Self::RANGES[2].0, self.a4 - 1e-3);
        ModelError::check_related_range("a3", self.a3, below_a4, (Self::unit_of("a3"), "below a4"))?;
        Ok(())
    }
}
