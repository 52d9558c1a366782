//! Sensitivities as sentences.

use super::{BoundSensitivity, GaitSensitivities};
use crate::display_angle_unit::DisplayAngleUnit;
use crate::number_format::figure;
use crate::tuned_bounds::TunedBounds;

/// A change of a bound that a person would make, in words and in units of the bound.
fn change_of(bound: usize, angles: DisplayAngleUnit) -> (&'static str, f64) {
    match (TunedBounds::UNITS[bound], angles) {
        ("rad/s", DisplayAngleUnit::Radian) => ("1 rad/s", 1.0),
        ("rad/s", DisplayAngleUnit::Degree) => ("10 °/s", 10_f64.to_radians()),
        ("rad/s²", DisplayAngleUnit::Radian) => ("1 rad/s²", 1.0),
        ("rad/s²", DisplayAngleUnit::Degree) => ("10 °/s²", 10_f64.to_radians()),
        ("m/s", _) => ("0.01 m/s", 0.01),
        ("m", _) => ("1 mm", 0.001),
        ("rad", DisplayAngleUnit::Radian) => ("0.01 rad", 0.01),
        ("rad", DisplayAngleUnit::Degree) => ("1°", 1_f64.to_radians()),
        _ => ("1°", 1.0),
    }
}
/// Number of places that a sentence names.
const MAX_NAMED_PLACES: usize = 3;
/// An interval without ends.
const ANY_VALUE: &str = "any value";

impl GaitSensitivities {
    /// One sentence for each bound that matters, and one for the others.
    pub fn sentences(&self, angles: DisplayAngleUnit) -> Vec<String> {
        let matters = |bound: &&BoundSensitivity| !bound.active.is_empty();
        let mut sentences: Vec<String> =
            self.bounds.iter().filter(matters).map(|bound| bound.sentence(self.cost_of_transport, angles)).collect();
        let others: Vec<&str> = self.bounds.iter().filter(|bound| !matters(bound)).map(|bound| bound.bound).collect();
        if let Some((last, first)) = others.split_last() {
            let listed = if first.is_empty() { (*last).to_owned() } else { format!("{} and {last}", first.join(", ")) };
            sentences.push(format!("Small changes in {listed} have no effect."));
        }
        sentences
    }
}

impl BoundSensitivity {
    /// The values with the same active constraints, as far as the bound can have them: `0.1 to 0.2`, `0.1 or more`.
    pub fn interval_in_words(&self, number: impl Fn(f64) -> String) -> String {
        let range = TunedBounds::NAMES.iter().zip(TunedBounds::RANGES).find(|(name, _)| **name == self.bound);
        let (lowest, highest) = range.map_or((f64::NEG_INFINITY, f64::INFINITY), |(_, range)| range);
        let (least, most) = self.interval;
        let least = least.filter(|least| *least > lowest).map(&number);
        let most = most.filter(|most| *most < highest).map(&number);
        match (least, most) {
            (None, None) => ANY_VALUE.to_owned(),
            (Some(least), None) => format!("{least} or more"),
            (None, Some(most)) => format!("{most} or less"),
            (Some(least), Some(most)) if least == most => format!("about {least}"),
            (Some(least), Some(most)) => format!("{least} to {most}"),
        }
    }

    fn sentence(&self, cost_of_transport: f64, angles: DisplayAngleUnit) -> String {
        let place = TunedBounds::NAMES.iter().position(|name| *name == self.bound).unwrap_or(0);
        let (change, by) = change_of(place, angles);
        // A lower bound is stricter the larger it is.
        let (stricter, by) = if TunedBounds::IS_LOWER[place] { ("more", by) } else { ("less", -by) };
        let derivatives = &self.derivatives;
        let quantity = TunedBounds::QUANTITIES[place];
        let mut places: Vec<&str> =
            self.active.iter().map(|active| active.place.as_str()).take(MAX_NAMED_PLACES).collect();
        let more = self.active.len().saturating_sub(places.len());
        let rest = format!("{more} more");
        if more > 0 {
            places.push(&rest);
        }
        let weak = if self.is_weakly_active {
            " Raising and lowering the bound have different effects, because a constraint is only just active."
        } else {
            ""
        };
        let number = |value: f64| figure(angles.shown(value, TunedBounds::UNITS[place]));
        let values = match self.interval_in_words(number).as_str() {
            ANY_VALUE => ANY_VALUE.to_owned(),
            values => format!("values of {values}"),
        };
        format!(
            "{} ({quantity}): {change} {stricter} changes the cost of transport by {} % and Gait RMSE by {} rad. Active at {}. \
             The same constraints stay active for {values}.{weak}",
            self.bound,
            figure(100.0 * by * derivatives.cost_of_transport / cost_of_transport),
            figure(by * derivatives.gait_rmse_rad),
            places.join("; "),
        )
    }
}

#[cfg(test)]
mod tests {
    use super::super::{ActiveConstraint, ResultDerivatives};
    use super::*;

    #[test]
    fn sentence_names_the_values_with_the_same_active_constraints() {
        let of = |interval| BoundSensitivity {
            bound: "a6",
            value: 0.3,
            active: vec![ActiveConstraint { place: "SS1_R node 3, torso".to_owned(), multiplier: 1.0 }],
            derivatives: ResultDerivatives {
                objective: 0.1,
                cost_of_transport: 0.1,
                gait_rmse_rad: 0.2,
                speed_m_s: 0.0,
                largest_angles_rad: [0.0; 7],
                smallest_angles_rad: [0.0; 7],
            },
            interval,
            is_weakly_active: false,
        };
        for (interval, values) in [
            ((None, None), "for any value."),
            ((Some(0.25), None), "for values of 0.25 or more."),
            ((None, Some(0.5)), "for values of 0.5 or less."),
            ((Some(0.25), Some(0.5)), "for values of 0.25 to 0.5."),
            ((Some(0.3), Some(0.300_01)), "for values of about 0.3."),
            // Beyond the range of the bound there is no limit.
            ((Some(-1.0), Some(100.0)), "for any value."),
        ] {
            let sentence = of(interval).sentence(1.0, DisplayAngleUnit::Radian);
            assert!(sentence.ends_with(&format!("The same constraints stay active {values}")), "{sentence}");
        }
        let in_degrees = of((Some(0.25), None)).sentence(1.0, DisplayAngleUnit::Degree);
        assert!(
            in_degrees.starts_with("a6 (torso lean): 1° less") && in_degrees.ends_with("14.3 or more."),
            "{in_degrees}"
        );
    }
}
