//! The unit of angles in texts for people.

use crate::number_format::{grouped, three_digits, with_unit};

/// The unit of angles, and of their velocities and accelerations, in a text. Other quantities keep their units.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DisplayAngleUnit {
    /// As in files and on the command line, with every digit.
    Radian,
    /// As on pages and charts, with three digits, or as a whole number.
    Degree,
}

impl DisplayAngleUnit {
    /// The unit in which a value is shown: `°/s` for `rad/s`.
    pub fn of(self, unit: &str) -> &str {
        match (self, unit) {
            (Self::Degree, "rad") => "°",
            (Self::Degree, "rad/s") => "°/s",
            (Self::Degree, "rad/s²") => "°/s²",
            _ => unit,
        }
    }

    /// The value in the unit in which it is shown, not rounded.
    pub fn converted(self, value: f64, unit: &str) -> f64 {
        if self.of(unit) == unit { value } else { value.to_degrees() }
    }

    /// The value in the unit in which it is shown. Degrees are rounded.
    pub fn shown(self, value: f64, unit: &str) -> f64 {
        if self.of(unit) == unit { value } else { three_digits(value.to_degrees()) }
    }

    /// The value with the unit in which it is shown: `17.2°` for 0.3 rad.
    pub fn in_words(self, value: f64, unit: &str) -> String {
        let number = self.shown(value, unit).to_string();
        with_unit(if self == Self::Degree { grouped(&number) } else { number }, self.of(unit))
    }
}

#[cfg(test)]
mod tests {
    use super::DisplayAngleUnit::{Degree, Radian};

    #[test]
    fn only_angles_are_shown_in_degrees() {
        assert_eq!([Radian, Degree].map(|unit| unit.in_words(0.3, "rad")), ["0.3 rad", "17.2°"]);
        assert_eq!([Radian, Degree].map(|unit| unit.in_words(20.0, "rad/s")), ["20 rad/s", "1146 °/s"]);
        assert_eq!([Radian, Degree].map(|unit| unit.in_words(0.0135, "m")), ["0.0135 m"; 2]);
        assert_eq!([Radian, Degree].map(|unit| unit.in_words(50.0, "°")), ["50°"; 2]);
        assert_eq!(Degree.in_words(1000.0, "rad/s²"), "57\u{202f}296 °/s²");
    }
}
