//! Bounds as forms show and read them: angles in degrees, unless a unit is written behind the number.

use crate::bound_units::{in_unit, unit};
use gait_optimizer::TunedBounds;
use gait_optimizer::number_format::with_unit;

/// Significant digits of an angle in a form.
const DIGITS: i32 = 4;

/// An entry that is not read.
#[derive(Debug, PartialEq)]
pub(crate) struct Unread {
    /// The refused part of the entry.
    pub(crate) part: String,
    /// For a number whose unit is in doubt: a sentence with both meanings.
    pub(crate) doubt: Option<String>,
}

/// A field for values of a bound, or for differences between two of them.
pub(crate) struct BoundField<'a> {
    name: &'a str,
    /// The numbers that the field can take, in the unit in which the bound is stored.
    range: (f64, f64),
    /// Rest of the unit of the bound after the angle, such as `/s`; `None` if the bound limits no angle.
    per: Option<&'static str>,
}

/// The units of an angle as they can be written.
const SPELLINGS: [(&str, Angle); 3] = [("rad", Angle::Radians), ("°", Angle::Degrees), ("deg", Angle::Degrees)];

#[derive(Clone, Copy, PartialEq)]
enum Angle {
    Radians,
    Degrees,
}

impl<'a> BoundField<'a> {
    /// A field for values of a bound.
    pub(crate) fn of_values(name: &'a str) -> Self {
        let range = TunedBounds::place_of(name).map_or((f64::MIN, f64::MAX), |place| TunedBounds::RANGES[place]);
        let stored = TunedBounds::unit_of(name);
        Self { name, range, per: stored.strip_prefix("rad").or_else(|| stored.strip_prefix('°')) }
    }

    /// A field for differences between two values of a bound.
    pub(crate) fn of_differences(name: &'a str) -> Self {
        let values = Self::of_values(name);
        Self { range: (0.0, values.range.1 - values.range.0), ..values }
    }

    /// Whether the bound limits an angle, or a velocity or acceleration of one.
    pub(crate) fn is_angle(&self) -> bool {
        self.per.is_some()
    }

    /// The allowed numbers with their unit: `0 to 57.3°`.
    pub(crate) fn allowed(&self) -> String {
        let (low, high) = self.range;
        with_unit(format!("{} to {}", self.few_digits(low), self.few_digits(high)), unit(self.name))
    }

    /// Numbers in the field, which [`Self::read_list`] reads.
    pub(crate) fn list(&self, values: &[f64]) -> String {
        values.iter().map(|value| self.entry(*value)).collect::<Vec<_>>().join(", ")
    }

    /// A number in the field, with a unit where [`Self::read`] would refuse it without one. [`Self::read`] gives exactly
    /// this number again.
    pub(crate) fn entry(&self, value: f64) -> String {
        let exact = if self.is_converted() { value.to_degrees() } else { value };
        let numbers = [self.few_digits(value), exact.to_string()];
        let texts = numbers.into_iter().flat_map(|number| [number.clone(), with_unit(number, unit(self.name))]);
        let mut read_back = texts.filter(|text| self.read(text) == Ok(value));
        read_back.next().unwrap_or_else(|| with_unit(value, TunedBounds::unit_of(self.name)))
    }

    /// Reads numbers, separated by commas, semicolons or spaces.
    pub(crate) fn read_list(&self, text: &str) -> Result<Vec<f64>, Unread> {
        let mut text = self.normal(text);
        for (unit, _) in self.units() {
            text = text.replace(&format!(" {unit}"), &unit);
        }
        text.split([',', ';', ' ']).filter(|part| !part.is_empty()).map(|part| self.read(part)).collect()
    }

    /// Reads a number. Without a unit it is in the unit in which the bound is shown, unless it could also be meant in
    /// radians.
    pub(crate) fn read(&self, text: &str) -> Result<f64, Unread> {
        let text = self.normal(text.trim());
        let no_number = || Unread { part: text.clone(), doubt: None };
        for (unit, angle) in self.units() {
            if let Some(number) = text.strip_suffix(&unit) {
                return finite(number).map(|number| self.stored(number, angle)).ok_or_else(no_number);
            }
        }
        let number = finite(&text).ok_or_else(no_number)?;
        let value = self.stored(number, Some(Angle::Degrees));
        self.doubt(&text, number).map_or(Ok(value), |doubt| Err(Unread { part: text.clone(), doubt: Some(doubt) }))
    }

    /// Both meanings of a number without a unit, if the field can take both.
    fn doubt(&self, text: &str, number: f64) -> Option<String> {
        let per = self.per?;
        let [degrees, radians] = [Angle::Degrees, Angle::Radians].map(|angle| self.stored(number, Some(angle)));
        let takes = |value: f64| (self.range.0..=self.range.1).contains(&value);
        if !takes(degrees) || !takes(radians) || number == 0.0 {
            return None;
        }
        let per_in_words = match per {
            "/s" => " per second",
            "/s²" => " per second squared",
            _ => "",
        };
        let [in_radians, in_degrees] = ["rad", "°"].map(|angle| with_unit(text, &format!("{angle}{per}")));
        let meant = in_unit(self.name, radians);
        Some(format!(
            "{text} has no unit. Did you mean {meant} ({in_radians})? If you mean {text} degrees{per_in_words}, write \
             {in_degrees}."
        ))
    }

    /// The units that can be written behind a number.
    fn units(&self) -> Vec<(String, Option<Angle>)> {
        match self.per {
            Some(per) => SPELLINGS.map(|(angle, kind)| (format!("{angle}{per}"), Some(kind))).into(),
            None => Some(TunedBounds::unit_of(self.name).to_owned())
                .filter(|unit| !unit.is_empty())
                .map(|unit| (unit, None))
                .into_iter()
                .collect(),
        }
    }

    /// The text with the unit of an acceleration as keyboards without ² write it.
    fn normal(&self, text: &str) -> String {
        let is_squared = self.per.is_some_and(|per| per.ends_with('²'));
        if is_squared { text.replace("s^2", "s²").replace("s2", "s²") } else { text.to_owned() }
    }

    /// The number in the unit in which the bound is stored.
    fn stored(&self, number: f64, angle: Option<Angle>) -> f64 {
        match angle {
            Some(Angle::Degrees) if self.is_converted() => to_radians(number),
            Some(Angle::Radians) if !self.is_converted() => number.to_degrees(),
            _ => number,
        }
    }

    /// The number in the unit in which the bound is shown, an angle in radians with few digits.
    fn few_digits(&self, value: f64) -> String {
        let shown = if self.is_converted() { rounded(value.to_degrees(), DIGITS) } else { value };
        shown.to_string()
    }

    /// Whether the bound is stored in radians.
    fn is_converted(&self) -> bool {
        unit(self.name) != TunedBounds::unit_of(self.name)
    }
}

fn finite(text: &str) -> Option<f64> {
    text.trim().parse().ok().filter(|number: &f64| number.is_finite())
}

/// An angle with few digits means the shortest number of radians that is the same angle to as many digits: 17.19° is 0.3 rad.
/// A form that shows 0.3 rad in degrees thus sends 0.3 rad, and trials with this bound are recognised.
fn to_radians(degrees: f64) -> f64 {
    let exact = degrees.to_radians();
    let is_same = |radians: &f64| rounded(radians.to_degrees(), DIGITS) == degrees;
    (1..=DIGITS + 2).map(|digits| rounded(exact, digits)).find(is_same).unwrap_or(exact)
}

/// The number with so many significant digits.
fn rounded(value: f64, digits: i32) -> f64 {
    if value == 0.0 {
        return value;
    }
    // The parser rounds correctly, unlike a product with a power of ten.
    format!("{value:.*e}", usize::try_from(digits - 1).unwrap_or_default()).parse().unwrap_or(value)
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use gaitwright_service::studies::bound_grid::TABLE_I;

    fn values(name: &str, text: &str) -> Option<f64> {
        BoundField::of_values(name).read(text).ok()
    }

    fn doubt(field: &BoundField<'_>, text: &str) -> Option<String> {
        field.read(text).err().and_then(|unread| unread.doubt)
    }

    #[test]
    fn every_number_comes_back_exactly_from_its_field() {
        for (name, (low, high)) in TunedBounds::NAMES.into_iter().zip(TunedBounds::RANGES) {
            let place = TunedBounds::place_of(name).unwrap();
            let (table, lengthscale) = TABLE_I[place];
            let (field, differences) = (BoundField::of_values(name), BoundField::of_differences(name));
            let steps = || (0..1000).map(|step| f64::from(step) / 999.0);
            let default = TunedBounds::default().to_array()[place];
            let short = table.iter().copied().chain([default]);
            for value in short.clone().chain([low, high]).chain(steps().map(|part| low + (high - low) * part)) {
                assert_eq!(field.read(&field.entry(value)), Ok(value), "{name} {value}");
            }
            for value in steps().map(|part| (high - low) * part).chain([lengthscale]) {
                assert_eq!(differences.read(&differences.entry(value)), Ok(value), "{name} {value}");
            }
            for value in short {
                assert!(field.entry(value).len() <= 5, "{name}: {}", field.entry(value));
            }
            let list = [low, default, high];
            assert_eq!(field.read_list(&field.list(&list)), Ok(list.to_vec()), "{name}");
        }
    }

    #[test]
    fn field_reads_degrees_and_other_units_if_they_are_named() {
        let lean = ["17.19", " 17.19° ", "17.19 deg", "0.3 rad", "0.3rad"].map(|text| values("a6", text));
        assert_eq!(lean, [Some(0.3); 5]);
        let speed = ["1146", "1146 °/s", "1146 deg/s", "20 rad/s"].map(|text| values("a1", text));
        assert_eq!(speed, [Some(20.0); 4]);
        assert_eq!(["90 rad/s²", "90 rad/s^2", "90rad/s2"].map(|text| values("a2", text)), [Some(90.0); 3]);
        assert_eq!(["30", "30°", "30 deg"].map(|text| values("a7", text)), [Some(30.0); 3]);
        assert!((values("a7", "0.5 rad").unwrap() - 28.647_89).abs() < 1e-5);
        assert_eq!(["0.02", "0.02 m"].map(|text| values("a5", text)), [Some(0.02); 2]);
        assert!((values("a6", "15").unwrap() - 15_f64.to_radians()).abs() < 1e-6);
        assert_eq!(values("a6", "15.123456"), Some(15.123_456_f64.to_radians()));
        assert_eq!(["", "high", "NaN", "inf", "3 m", "3 rad/s"].map(|text| values("a6", text)), [None; 6]);
        let lean = BoundField::of_values("a6");
        assert_eq!(lean.allowed(), "0 to 57.3°");
        assert_eq!(lean.read_list("0; 5.73 °, 0.2 rad 17.19 0.5 deg").map(|read| read.len()), Ok(5));
        assert_eq!(lean.read_list("0; 5.73 °, 0.2 rad 17.19"), Ok(vec![0.0, 0.1, 0.2, 0.3]));
        assert_eq!(lean.read_list("0, high"), Err(Unread { part: "high".to_owned(), doubt: None }));
    }

    #[test]
    fn number_that_may_be_radians_needs_a_unit() {
        let [lean, speed, hip, clearance] = ["a6", "a1", "a7", "a5"].map(BoundField::of_values);
        assert_eq!(
            doubt(&lean, ".3").as_deref(),
            Some(".3 has no unit. Did you mean 17.2° (.3 rad)? If you mean .3 degrees, write .3°.")
        );
        assert_eq!(
            doubt(&speed, "80").as_deref(),
            Some("80 has no unit. Did you mean 4584 °/s (80 rad/s)? If you mean 80 degrees per second, write 80 °/s.")
        );
        let refused = lean.read_list("0, 0.3").unwrap_err();
        assert!(refused.part == "0.3" && refused.doubt.is_some(), "{refused:?}");
        for (field, clear) in [(&lean, ["0", "1.5", ".3°"]), (&speed, ["1146", "80 °/s", "0.3"])] {
            assert_eq!(clear.map(|text| doubt(field, text)), [None, None, None]);
        }
        // No angle of the hip within the range is also one in radians, and a length has no second unit.
        assert_eq!(["0.3", "10"].map(|text| doubt(&hip, text)), [None, None]);
        assert_eq!(doubt(&clearance, "0.03"), None);
        // A difference between two angles of the hip can be small.
        assert!(doubt(&BoundField::of_differences("a7"), "0.3").is_some());
        assert_eq!(doubt(&BoundField::of_differences("a7"), "15"), None);
    }
}
