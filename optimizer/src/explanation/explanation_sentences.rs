//! Infeasibility explanations as sentences, for the command line, pages and programs.

use super::given_bound::BoundValue;
use super::{BoundAtLimit, Conflict, Explanation, JointRelaxation, Relaxation};
use crate::display_angle_unit::DisplayAngleUnit;
use crate::number_format::{figure, with_unit};
use crate::solve::{SolveStatus, Violation};
use crate::tuned_bounds::TunedBounds;
use crate::walking::CYCLE;

/// The meaning of the status of a solve for its bounds; `None` if there is a gait.
pub fn status_in_words(status: SolveStatus) -> Option<&'static str> {
    match status {
        SolveStatus::Converged => None,
        SolveStatus::Infeasible => Some(
            "No motion near the last one tried satisfies every constraint: bounds conflict with each other or with another constraint.",
        ),
        SolveStatus::Cancelled => Some("The solve was cancelled."),
        SolveStatus::Stalled | SolveStatus::IterationLimit | SolveStatus::TimeLimit => Some(
            "The optimiser stopped before every constraint was satisfied. A gait with these bounds may still exist.",
        ),
    }
}

/// A bound with its value: `a7 = 5° (hip angle)`.
pub fn quantity(bound: &str, value: f64, angles: DisplayAngleUnit) -> String {
    format!("{bound} = {} ({})", in_unit(bound, value, angles), TunedBounds::quantity_of(bound))
}

fn in_unit(bound: &str, value: f64, angles: DisplayAngleUnit) -> String {
    angles.in_words(value, TunedBounds::unit_of(bound))
}

/// A list: `a, b and c`.
fn list(items: &[String]) -> String {
    match items {
        [] => String::new(),
        [one] => one.clone(),
        [first @ .., last] => format!("{} and {last}", first.join(", ")),
    }
}

impl Violation {
    /// The constraint without place and component, such as `forward hip velocity`.
    pub fn constraint(&self) -> &str {
        self.row.split(", ").nth(1).unwrap_or(&self.row)
    }

    /// The amount with its unit: `0.107 m/s`.
    pub fn amount_in_words(&self) -> String {
        with_unit(figure(self.amount), &self.unit)
    }

    fn amount_in(&self, angles: DisplayAngleUnit) -> String {
        let is_shown_as_stored = angles.of(&self.unit) == self.unit;
        if is_shown_as_stored { self.amount_in_words() } else { angles.in_words(self.amount, &self.unit) }
    }
}

impl BoundAtLimit {
    /// The domains in which the bound is reached, as a sentence.
    pub fn in_words(&self, angles: DisplayAngleUnit) -> String {
        let quantity = quantity(&self.bound, self.value, angles);
        if self.domains.len() == CYCLE.len() {
            return format!("{quantity} is reached in every domain.");
        }
        let domains: Vec<String> = self
            .domains
            .iter()
            .map(|name| if name == "stride" { "the stride as a whole" } else { name }.to_owned())
            .collect();
        format!("{quantity} is reached in {}.", list(&domains))
    }
}

/// The number of starts: ` from 5 starts`.
fn from_starts(starts: usize) -> String {
    match starts {
        0 => String::new(),
        1 => " from 1 start".to_owned(),
        _ => format!(" from {starts} starts"),
    }
}

/// The caveat if a solve ended without a stationary point.
fn caveat(undecided: bool) -> &'static str {
    if undecided { " (not all solves ended at a local minimum of the violation, so a gait may exist)" } else { "" }
}

impl Conflict {
    /// The conflicting bounds and the violated constraint, as sentences.
    pub fn in_words(&self, angles: DisplayAngleUnit) -> String {
        let quantities: Vec<String> = self.bounds.iter().map(|one| one.in_words(angles)).collect();
        let without = match self.without.len() {
            0 => String::new(),
            1 => format!("With {} at its loosest value, another conflict remains. ", list(&self.without)),
            _ => format!("With {} at their loosest values, another conflict remains. ", list(&self.without)),
        };
        let (claim, tried, relief) = match quantities.as_slice() {
            [] => {
                let naturalness_terms = if self.naturalness_terms.is_empty() {
                    String::new()
                } else {
                    format!(" (among them {})", list(&self.naturalness_terms))
                };
                (
                    format!(
                        "The conflict does not depend on the bounds: fixed constraints conflict with each other{naturalness_terms}"
                    ),
                    ". With every bound at its loosest value".to_owned(),
                    "",
                )
            }
            [one] => (
                format!("With {one}"),
                " and the other bounds at their loosest values".to_owned(),
                " If this bound is at its loosest value as well, there is a gait.",
            ),
            [_, _] => (
                format!("{} conflict with each other", list(&quantities)),
                ": with both at these values and the other bounds at their loosest".to_owned(),
                " If either of them is at its loosest value as well, there is a gait.",
            ),
            _ => (
                format!("{} conflict with each other", list(&quantities)),
                ": with all of them at these values and the other bounds at their loosest".to_owned(),
                " If any one of them is at its loosest value as well, there is a gait.",
            ),
        };
        let missed = self.violations.first().map_or(String::new(), |worst| {
            let amount = worst.amount_in(angles);
            format!("; the nearest motion violates the limit of {} by {amount}", worst.constraint())
        });
        let (from, caveat) = (from_starts(self.starts), caveat(self.undecided));
        format!("{without}{claim}{tried}, no gait was found{from}{caveat}{missed}.{relief}")
    }
}

impl BoundValue {
    /// `a7 = 5° (hip angle)`.
    fn in_words(&self, angles: DisplayAngleUnit) -> String {
        quantity(&self.bound, self.value, angles)
    }
}

impl Relaxation {
    /// The effect of the relaxation, as a sentence.
    pub fn in_words(&self, angles: DisplayAngleUnit) -> String {
        let Self { bound, from, to, not_with, .. } = self;
        let limited = TunedBounds::quantity_of(bound);
        let in_unit = |value: f64| in_unit(bound, value, angles);
        let (loosest, tried) = (in_unit(*not_with), in_unit(*from));
        let (starts, caveat) = (from_starts(self.starts), caveat(self.undecided));
        if let Some(to) = to {
            return format!(
                "Relaxing {bound} ({limited}) alone, to {} instead of {tried}, gives a gait; with {loosest}, no gait was \
                 found{starts}{caveat}.",
                in_unit(*to)
            );
        }
        let direction = if not_with < from { "down" } else { "up" };
        format!(
            "Relaxing {bound} ({limited}) alone, {direction} to its loosest value, {loosest}, is not sufficient: no gait \
             was found{starts}{caveat}."
        )
    }
}

impl JointRelaxation {
    /// The effect of the relaxation, as a sentence.
    pub fn in_words(&self, angles: DisplayAngleUnit) -> String {
        let (starts, caveat) = (from_starts(self.starts), caveat(self.undecided));
        let named =
            |value: &dyn Fn(&super::RelaxedBound) -> String| list(&self.bounds.iter().map(value).collect::<Vec<_>>());
        let not_with = named(&|one| format!("{} = {}", one.bound, in_unit(&one.bound, one.not_with, angles)));
        if self.bounds.iter().any(|one| one.to.is_none()) {
            return format!(
                "Relaxing these bounds together is not sufficient: even at their loosest values, {not_with}, no gait was \
                 found{starts}{caveat}."
            );
        }
        let with = named(&|one| {
            let to = one.to.unwrap_or(one.not_with);
            let from = in_unit(&one.bound, one.from, angles);
            format!("{} instead of {from}", quantity(&one.bound, to, angles))
        });
        format!(
            "Relaxing these bounds together, to {with}, gives a gait; with {not_with}, no gait was found{starts}{caveat}."
        )
    }
}

impl BoundValue {
    /// The limit in words: `a hip angle of at most 15°`.
    fn limit_in_words(&self, angles: DisplayAngleUnit) -> String {
        let limited = TunedBounds::quantity_of(&self.bound);
        let value = in_unit(&self.bound, self.value, angles);
        let is_lower = TunedBounds::place_of(&self.bound).is_some_and(|place| TunedBounds::IS_LOWER[place]);
        let quantity = limited.strip_prefix("minimum ").or_else(|| limited.strip_prefix("maximum "));
        let quantity = quantity.unwrap_or(limited);
        let article = if quantity.starts_with(['a', 'e', 'i', 'o', 'u']) { "an" } else { "a" };
        format!("{article} {quantity} of at {} {value}", if is_lower { "least" } else { "most" })
    }
}

impl Explanation {
    /// The first conflict in one sentence, without details of the search; `None` if no conflict is known.
    pub fn headline(&self, angles: DisplayAngleUnit) -> Option<String> {
        if self.gait_found {
            return Some("The bounds of this trial do not conflict: the solve missed a gait.".to_owned());
        }
        let conflict = self.conflicts.first()?;
        let limits: Vec<String> = conflict.bounds.iter().map(|one| one.limit_in_words(angles)).collect();
        Some(match limits.as_slice() {
            [] => {
                "No gait was found even with every bound at its loosest value: fixed constraints conflict.".to_owned()
            }
            [one] if conflict.undecided => {
                format!(
                    "With {one}, no gait was found even with the other bounds at their loosest values, but one may exist."
                )
            }
            [one] => {
                format!("With {one}, no gait was found even with the other bounds at their loosest values.")
            }
            _ if conflict.undecided => format!("These bounds probably conflict: {}.", list(&limits)),
            _ => format!("These bounds conflict: {}.", list(&limits)),
        })
    }

    /// The conflicts as sentences, the first one first. If they are unknown, the largest violation.
    pub fn conflicts_in_words(&self, angles: DisplayAngleUnit) -> Vec<String> {
        if self.gait_found {
            let found = "The search for a conflict found a gait with exactly these bounds. They do not conflict; the solve missed \
                         this gait.";
            return vec![found.to_owned()];
        }
        if self.conflicts.is_empty() {
            return self.missed_most(angles).into_iter().collect();
        }
        self.conflicts.iter().map(|one| one.in_words(angles)).collect()
    }

    /// The largest violation, as a sentence; `None` if there is none.
    fn missed_most(&self, angles: DisplayAngleUnit) -> Option<String> {
        let worst = self.violations.first()?;
        Some(format!("Largest violation: {}, by {}.", worst.row, worst.amount_in(angles)))
    }

    /// The smallest relaxation of one bound that gives a gait.
    pub fn relief(&self) -> Option<&Relaxation> {
        self.relaxations.iter().find(|relaxation| relaxation.to.is_some())
    }

    /// The relaxations as sentences: single ones, joint ones, and those that are not sufficient.
    pub fn remedies_in_words(&self, angles: DisplayAngleUnit) -> Vec<String> {
        let helps = |joint: &&JointRelaxation| joint.bounds.iter().all(|one| one.to.is_some());
        let alone = self.relaxations.iter().map(|one| one.in_words(angles));
        let together = self.together.iter().filter(helps).map(|one| one.in_words(angles));
        let in_vain = self.together.iter().filter(|joint| !helps(joint)).map(|one| one.in_words(angles));
        alone.chain(together).chain(in_vain).collect()
    }

    /// Findings that an explanation may lack because it was stopped early, as a sentence.
    pub fn stopped_in_words(&self) -> Option<&'static str> {
        self.stopped_early.then_some(
            "This explanation was stopped early: further conflicts, and other or smaller relaxations, may exist.",
        )
    }

    /// The explanation as sentences, with angles in radians.
    pub fn sentences(&self) -> Vec<String> {
        let angles = DisplayAngleUnit::Radian;
        let status = status_in_words(self.status).map(str::to_owned);
        let at_limit = self.at_limit.iter().map(|at| at.in_words(angles));
        let conflicts = self.conflicts_in_words(angles).into_iter();
        let stopped = self.stopped_in_words().map(str::to_owned);
        status
            .into_iter()
            .chain(stopped)
            .chain(conflicts)
            .chain(self.remedies_in_words(angles))
            .chain(at_limit)
            .collect()
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests;
