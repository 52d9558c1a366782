//! The tuned constraint bounds a1 to a8 (Table I of the paper).

use crate::subject::ModelError;
use serde::{Deserialize, Serialize};

/// The eight tuned bounds. Defaults are the loosest values of Table I.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct TunedBounds {
    /// a1: upper bound of the magnitude of every coordinate velocity, rad/s (m/s for the hip point).
    pub a1: f64,
    /// a2: upper bound of the magnitude of every coordinate acceleration, rad/s² (m/s² for the hip point).
    pub a2: f64,
    /// a3: lower bound of the hip velocity v_hip, m/s.
    pub a3: f64,
    /// a4: upper bound of the hip velocity v_hip, m/s.
    pub a4: f64,
    /// a5: lower bound of the swing-foot clearance at mid-swing, m.
    pub a5: f64,
    /// a6: upper bound of the magnitude of the torso lean, rad.
    pub a6: f64,
    /// a7: upper bound of the magnitude of both hip angles, degrees.
    pub a7: f64,
    /// a8: upper bound of the magnitude of both ankle angles, degrees.
    pub a8: f64,
}

impl Default for TunedBounds {
    fn default() -> Self {
        Self { a1: 20.0, a2: 90.0, a3: 0.3, a4: 1.4, a5: 0.0, a6: 0.5, a7: 50.0, a8: 40.0 }
    }
}

impl TunedBounds {
    /// Names, in the order of an action.
    pub const NAMES: [&'static str; 8] = ["a1", "a2", "a3", "a4", "a5", "a6", "a7", "a8"];
    /// Quantity that each bound limits, with its unit, in the order of an action.
    pub const MEANINGS: [&'static str; 8] = [
        "coordinate velocity, rad/s",
        "coordinate acceleration, rad/s²",
        "hip velocity lower bound, m/s",
        "hip velocity upper bound, m/s",
        "swing-foot clearance, m",
        "torso lean, rad",
        "hip angle, °",
        "ankle angle, °",
    ];
    /// Allowed range of each bound, in the order of an action.
    pub const RANGES: [(f64, f64); 8] =
        [(1.0, 100.0), (5.0, 1000.0), (0.05, 3.0), (0.05, 3.0), (0.0, 0.3), (0.0, 1.0), (5.0, 68.0), (5.0, 60.0)];

    /// Values, in the order of an action.
    pub fn to_array(self) -> [f64; 8] {
        [self.a1, self.a2, self.a3, self.a4, self.a5, self.a6, self.a7, self.a8]
    }

    /// Validated bounds from values in the order of an action.
    ///
    /// # Errors
    /// [`ModelError::OutOfRange`] naming the bound.
    pub fn from_array(a: [f64; 8]) -> Result<Self, ModelError> {
        let [a1, a2, a3, a4, a5, a6, a7, a8] = a;
        let bounds = Self { a1, a2, a3, a4, a5, a6, a7, a8 };
        bounds.validate()?;
        Ok(bounds)
    }

    /// Sets one bound by name, `a1` to `a8`. [`Self::validate`] checks the bounds against each other.
    ///
    /// # Errors
    /// [`ModelError::Unknown`] for any other name, [`ModelError::OutOfRange`] for a value outside its range.
    pub fn set(&mut self, name: &str, value: f64) -> Result<(), ModelError> {
        let Some(index) = Self::NAMES.iter().position(|n| *n == name) else {
            return Err(ModelError::Unknown {
                field: "bounds".to_owned(),
                value: name.to_owned(),
                known: format!("one of {}", Self::NAMES.join(", ")),
            });
        };
        ModelError::check_range(name, value, Self::RANGES[index].0, Self::RANGES[index].1)?;
        let slot = match index {
            0 => &mut self.a1,
            1 => &mut self.a2,
            2 => &mut self.a3,
            3 => &mut self.a4,
            4 => &mut self.a5,
            5 => &mut self.a6,
            6 => &mut self.a7,
            _ => &mut self.a8,
        };
        *slot = value;
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
        for ((name, value), (minimum, maximum)) in Self::NAMES.iter().zip(self.to_array()).zip(Self::RANGES) {
            ModelError::check_range(name, value, minimum, maximum)?;
        }
        // The interior-point method needs an interval of hip velocities with an interior.
        ModelError::check_range("a3", self.a3, Self::RANGES[2].0, self.a4 - 1e-3)?;
        Ok(())
    }
}
