//! An explanation in sentences: the same at the command line, on pages and for programs.

use super::{BoundAtLimit, Explanation, Relaxation};
use crate::in_words::figure;
use crate::solve::{SolveStatus, Violation};
use crate::walking::CYCLE;

/// What the end of a solve says of its bounds; none where there is a gait.
pub fn verdict(status: SolveStatus) -> Option<&'static str> {
    match status {
        SolveStatus::Converged => None,
        SolveStatus::Infeasible => Some(
            "No motion near the last one keeps every constraint: the bounds contradict each other, or another constraint.",
        ),
        SolveStatus::Cancelled => Some("Somebody ended the solve before it was done."),
        SolveStatus::Stalled | SolveStatus::IterationLimit | SolveStatus::TimeLimit => Some(
            "The optimiser ended before every constraint was met. That is no proof that these bounds have no gait.",
        ),
    }
}

/// `a7 = 5 ° (hip angle)`, the meaning being `hip angle, °`.
fn quantity(bound: &str, meaning: &str, value: f64) -> String {
    let (limited, unit) = parts(meaning);
    format!("{bound} = {value}{unit} ({limited})")
}

/// What a bound limits, and its unit after a space.
fn parts(meaning: &str) -> (&str, String) {
    meaning.rsplit_once(", ").map_or_else(|| (meaning, String::new()), |(limited, unit)| (limited, format!(" {unit}")))
}

/// `a, b and c`.
fn list(items: &[String]) -> String {
    match items {
        [] => String::new(),
        [one] => one.clone(),
        [first @ .., last] => format!("{} and {last}", first.join(", ")),
    }
}

impl Violation {
    /// Where: `SS1_R point 12`, `SS2_R to SS1_R`, `stride`.
    fn place(&self) -> &str {
        self.row.split(", ").next().unwrap_or(&self.row)
    }

    /// The constraint without place and component: `C3 forward hip velocity`.
    pub fn constraint(&self) -> &str {
        self.row.split(", ").nth(1).unwrap_or(&self.row)
    }
}

impl BoundAtLimit {
    /// Whether it is reached in a domain that `place` names; what holds of the whole stride is everywhere.
    fn takes_part_in(&self, place: &str) -> bool {
        let mut named = place.split(' ').filter(|word| CYCLE.iter().any(|domain| domain.name() == *word)).peekable();
        let reached_in = |domain: &str| self.domains.iter().any(|known| known == domain || known == "stride");
        named.peek().is_none() || named.any(reached_in)
    }

    /// Where it is reached.
    pub fn in_words(&self) -> String {
        let quantity = quantity(&self.bound, &self.meaning, self.value);
        if self.domains.len() == CYCLE.len() {
            return format!("{quantity} is reached in every domain.");
        }
        let domains: Vec<String> = self
            .domains
            .iter()
            .map(|name| if name == "stride" { "the whole stride" } else { name }.to_owned())
            .collect();
        format!("{quantity} is reached in {}.", list(&domains))
    }
}

impl Relaxation {
    /// What it achieves.
    pub fn in_words(&self) -> String {
        let Self { bound, meaning, from, to, not_with, undecided, .. } = self;
        let (limited, unit) = parts(meaning);
        if let Some(to) = to {
            let with = quantity(bound, meaning, *to);
            let none = if *undecided { "none was found" } else { "none does" };
            return format!(
                "With {with} in place of {from}{unit} alone, a gait converges; with {not_with}{unit} {none}."
            );
        }
        let direction = if not_with < from { "down" } else { "up" };
        let tried = format!("{bound} ({limited}) alone, {direction} to {not_with}{unit}");
        if *undecided {
            format!("{tried}: no gait was found within the limits of the solves; that there is none is not known.")
        } else {
            format!("{tried}, does not help.")
        }
    }
}

impl Explanation {
    /// What is missed most, and which tuned bounds are at their limits there; none where nothing is missed.
    pub fn conflict(&self) -> Option<String> {
        let worst = self.violations.first()?;
        let part: Vec<String> = self
            .at_limit
            .iter()
            .filter(|bound| bound.takes_part_in(worst.place()))
            .map(|bound| quantity(&bound.bound, &bound.meaning, bound.value))
            .collect();
        let bounds = match part.len() {
            0 => "no tuned bound at its limit there".to_owned(),
            1 => format!("{} at its limit there", list(&part)),
            _ => format!("{} at their limits there", list(&part)),
        };
        Some(format!("Missed most: {}, by {} {}, with {bounds}.", worst.row, figure(worst.amount), worst.unit))
    }

    /// The smallest relaxation that gives a gait.
    pub fn relief(&self) -> Option<&Relaxation> {
        self.relaxations.iter().find(|relaxation| relaxation.to.is_some())
    }

    /// All of it, sentence by sentence.
    pub fn sentences(&self) -> Vec<String> {
        let verdict = verdict(self.status).map(str::to_owned);
        let at_limit = self.at_limit.iter().map(BoundAtLimit::in_words);
        let relaxations = self.relaxations.iter().map(Relaxation::in_words);
        verdict.into_iter().chain(self.conflict()).chain(at_limit).chain(relaxations).collect()
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    fn at_limit(bound: &str, meaning: &str, value: f64, domains: &[&str]) -> BoundAtLimit {
        let domains = domains.iter().map(|name| (*name).to_owned()).collect();
        BoundAtLimit { bound: bound.to_owned(), meaning: meaning.to_owned(), value, domains }
    }

    fn relaxation(bound: &str, meaning: &str, (from, to, not_with): (f64, Option<f64>, f64)) -> Relaxation {
        let (bound, meaning) = (bound.to_owned(), meaning.to_owned());
        Relaxation { bound, meaning, from, to, not_with, undecided: false, solves: 8, warm_start: None }
    }

    fn explanation(row: &str) -> Explanation {
        Explanation {
            status: SolveStatus::Infeasible,
            violations: vec![Violation { row: row.to_owned(), amount: 0.101_23, unit: "m/s".to_owned() }],
            at_limit: vec![
                at_limit("a2", "coordinate acceleration, rad/s²", 20.0, &["DS2_L", "SS1_L"]),
                at_limit("a4", "hip velocity upper bound, m/s", 0.5, &["stride"]),
                at_limit("a7", "hip angle, °", 5.0, &["SS1_R", "DS2_L", "SS1_L"]),
            ],
            relaxations: vec![
                relaxation("a7", "hip angle, °", (5.0, Some(16.9), 16.5)),
                relaxation("a2", "coordinate acceleration, rad/s²", (20.0, None, 1000.0)),
                relaxation("a5", "swing-foot clearance, m", (0.1, None, 0.0)),
            ],
        }
    }

    #[test]
    fn the_bounds_that_take_part_are_those_at_their_limits_where_most_is_missed() {
        assert_eq!(
            explanation("SS1_R point 12, C3 forward hip velocity").conflict().unwrap(),
            "Missed most: SS1_R point 12, C3 forward hip velocity, by 0.101 m/s, with a4 = 0.5 m/s (hip velocity upper \
             bound) and a7 = 5 ° (hip angle) at their limits there."
        );
        assert_eq!(
            explanation("SS1_L to DS2_R, C2 continuity of velocity, hip_R").conflict().unwrap(),
            "Missed most: SS1_L to DS2_R, C2 continuity of velocity, hip_R, by 0.101 m/s, with a2 = 20 rad/s² (coordinate \
             acceleration), a4 = 0.5 m/s (hip velocity upper bound) and a7 = 5 ° (hip angle) at their limits there."
        );
        let of_stride = explanation("stride, C4 walking speed");
        assert!(of_stride.conflict().unwrap().contains("a2 = 20 rad/s²"), "a row of the stride is missed everywhere");
        let alone = Explanation { at_limit: Vec::new(), ..of_stride };
        assert!(alone.conflict().unwrap().ends_with("with no tuned bound at its limit there."));
        assert_eq!(Explanation { violations: Vec::new(), ..alone }.conflict(), None);
    }

    #[test]
    fn every_sentence_of_an_explanation_comes_in_order() {
        let sentences = explanation("SS1_R point 12, C3 forward hip velocity").sentences();
        assert_eq!(sentences.len(), 8);
        assert!(sentences[0].starts_with("No motion near the last one") && sentences[1].starts_with("Missed most"));
        assert_eq!(
            sentences[2..],
            [
                "a2 = 20 rad/s² (coordinate acceleration) is reached in DS2_L and SS1_L.",
                "a4 = 0.5 m/s (hip velocity upper bound) is reached in the whole stride.",
                "a7 = 5 ° (hip angle) is reached in SS1_R, DS2_L and SS1_L.",
                "With a7 = 16.9 ° (hip angle) in place of 5 ° alone, a gait converges; with 16.5 ° none does.",
                "a2 (coordinate acceleration) alone, up to 1000 rad/s², does not help.",
                "a5 (swing-foot clearance) alone, down to 0 m, does not help.",
            ]
        );
    }

    #[test]
    fn eight_domains_are_not_listed() {
        let everywhere = CYCLE.map(crate::walking::Domain::name);
        let bound = at_limit("a2", "coordinate acceleration, rad/s²", 20.0, &everywhere);
        assert_eq!(bound.in_words(), "a2 = 20 rad/s² (coordinate acceleration) is reached in every domain.");
    }

    #[test]
    fn what_is_not_decided_is_not_said_to_be() {
        let undecided = |relaxation: Relaxation| Relaxation { undecided: true, ..relaxation }.in_words();
        let mut relaxations = explanation("stride, C4 walking speed").relaxations;
        assert!(undecided(relaxations.remove(1)).ends_with("that there is none is not known."));
        assert!(undecided(relaxations.remove(0)).ends_with("with 16.5 ° none was found."));
        for status in [SolveStatus::Stalled, SolveStatus::IterationLimit, SolveStatus::TimeLimit] {
            assert!(verdict(status).unwrap().contains("no proof"), "{status:?}");
        }
        assert_eq!(verdict(SolveStatus::Converged), None);
    }

    #[test]
    fn a_violation_is_split_into_place_and_constraint() {
        let violation = |row: &str| Violation { row: row.to_owned(), amount: 1.0, unit: "m".to_owned() };
        let row = violation("SS2_R to SS1_R, C2 continuity of velocity, hip_R");
        assert_eq!((row.place(), row.constraint()), ("SS2_R to SS1_R", "C2 continuity of velocity"));
        assert_eq!(violation("stride length").constraint(), "stride length");
    }

    #[test]
    fn the_relief_is_the_smallest_relaxation_that_helps() {
        let mut found = explanation("stride, C4 walking speed");
        assert_eq!(found.relief().map(|relaxation| relaxation.bound.as_str()), Some("a7"));
        found.relaxations.remove(0);
        assert_eq!(found.relief(), None);
    }
}
