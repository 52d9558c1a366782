//! Sensitivities as sentences.

use super::{BoundSensitivity, GaitSensitivities};
use crate::number_format::figure;
use crate::tuned_bounds::TunedBounds;

/// For each bound: a change that a person would make, its unit in the sentence, and the change in units of the bound.
const CHANGES: [(&str, f64); TunedBounds::COUNT] = [
    ("1 rad/s", 1.0),
    ("1 rad/s²", 1.0),
    ("0.01 m/s", 0.01),
    ("0.01 m/s", 0.01),
    ("1 mm", 0.001),
    ("0.01 rad", 0.01),
    ("1°", 1.0),
    ("1°", 1.0),
];
/// Number of places that a sentence names.
const PLACES: usize = 3;

impl GaitSensitivities {
    /// One sentence for each bound that matters, and one for the others.
    pub fn sentences(&self) -> Vec<String> {
        let matters = |bound: &&BoundSensitivity| !bound.active.is_empty();
        let mut sentences: Vec<String> =
            self.bounds.iter().filter(matters).map(|bound| bound.sentence(self.cost_of_transport)).collect();
        let others: Vec<&str> = self.bounds.iter().filter(|bound| !matters(bound)).map(|bound| bound.bound).collect();
        if !others.is_empty() {
            sentences.push(format!("Small changes in {} have no effect.", others.join(", ")));
        }
        sentences
    }
}

impl BoundSensitivity {
    fn sentence(&self, cost_of_transport: f64) -> String {
        let place = TunedBounds::NAMES.iter().position(|name| *name == self.bound).unwrap_or(0);
        let (change, by) = CHANGES[place];
        // A lower bound is stricter the larger it is.
        let (stricter, by) = if TunedBounds::IS_LOWER[place] { ("more", by) } else { ("less", -by) };
        let derivatives = &self.derivatives;
        let quantity = TunedBounds::MEANINGS[place].split(',').next().unwrap_or_default();
        let mut places: Vec<&str> = self.active.iter().map(|active| active.place.as_str()).take(PLACES).collect();
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
        let end = |value: Option<f64>| value.map_or_else(|| "any value".to_owned(), figure);
        format!(
            "{} ({quantity}): {change} {stricter} changes the cost of transport by {} % and Gait RMSE by {} rad. Active at {}. \
             The same constraints stay active from {} to {}.{weak}",
            self.bound,
            figure(100.0 * by * derivatives.cost_of_transport / cost_of_transport),
            figure(by * derivatives.gait_rmse_rad),
            places.join("; "),
            end(self.interval.0),
            end(self.interval.1),
        )
    }
}
