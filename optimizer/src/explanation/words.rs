//! Infeasibility explanations as sentences, for the command line, pages and programs.

use super::given_bound::BoundValue;
use super::{BoundAtLimit, Conflict, Explanation, JointRelaxation, Relaxation};
use crate::number_format::figure;
use crate::solve::{SolveStatus, Violation};
use crate::tuned_bounds::TunedBounds;
use crate::walking::CYCLE;

/// The meaning of the status of a solve for its bounds; `None` if there is a gait.
pub fn status_in_words(status: SolveStatus) -> Option<&'static str> {
    match status {
        SolveStatus::Converged => None,
        SolveStatus::Infeasible => Some(
            "No motion near the last iterate satisfies every constraint: tuned bounds conflict with each other or with another constraint.",
        ),
        SolveStatus::Cancelled => Some("The solve was cancelled."),
        SolveStatus::Stalled | SolveStatus::IterationLimit | SolveStatus::TimeLimit => Some(
            "The optimiser stopped before every constraint was satisfied. A gait with these bounds may still exist.",
        ),
    }
}

/// A bound with its value: `a7 = 5° (hip angle)` for the meaning `hip angle, °`.
pub fn quantity(bound: &str, meaning: &str, value: f64) -> String {
    let (limited, unit) = parts(meaning);
    format!("{bound} = {value}{unit} ({limited})")
}

/// The unit of a bound as it follows a number: ` m/s` or `°`, for the meaning `hip velocity, m/s` or `hip angle, °`.
pub fn unit_after_number(meaning: &str) -> String {
    parts(meaning).1
}

/// The quantity of a bound, and its unit as it follows a number.
fn parts(meaning: &str) -> (&str, String) {
    match meaning.rsplit_once(", ") {
        None => (meaning, String::new()),
        Some((limited, "°")) => (limited, "°".to_owned()),
        Some((limited, unit)) => (limited, format!(" {unit}")),
    }
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
    /// The constraint without place and component, such as `C3 forward hip velocity`.
    pub fn constraint(&self) -> &str {
        self.row.split(", ").nth(1).unwrap_or(&self.row)
    }
}

impl BoundAtLimit {
    /// The domains in which the bound is reached, as a sentence.
    pub fn in_words(&self) -> String {
        let quantity = quantity(&self.bound, &self.meaning, self.value);
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
    pub fn in_words(&self) -> String {
        let quantities: Vec<String> = self.bounds.iter().map(BoundValue::in_words).collect();
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
                        "The conflict does not depend on tuned bounds: fixed constraints conflict with each other{naturalness_terms}"
                    ),
                    ". With every tuned bound at its loosest value".to_owned(),
                    "",
                )
            }
            [one] => (
                format!("With {one}"),
                " and the other tuned bounds at their loosest values".to_owned(),
                " With it at its loosest value as well, there is a gait.",
            ),
            [_, _] => (
                format!("{} conflict with each other", list(&quantities)),
                ": with both, and the other tuned bounds at their loosest values".to_owned(),
                " With either of them at its loosest value as well, there is a gait.",
            ),
            _ => (
                format!("{} conflict with each other", list(&quantities)),
                ": with all of them, and the other tuned bounds at their loosest values".to_owned(),
                " With any one of them at its loosest value as well, there is a gait.",
            ),
        };
        let missed = self.violations.first().map_or(String::new(), |worst| {
            format!("; the nearest motion violates {} by {} {}", worst.row, figure(worst.amount), worst.unit)
        });
        let (from, caveat) = (from_starts(self.starts), caveat(self.undecided));
        format!("{without}{claim}{tried}, no gait was found{from}{caveat}{missed}.{relief}")
    }
}

impl BoundValue {
    /// `a7 = 5° (hip angle)`.
    fn in_words(&self) -> String {
        quantity(&self.bound, &self.meaning, self.value)
    }
}

impl Relaxation {
    /// The effect of the relaxation, as a sentence.
    pub fn in_words(&self) -> String {
        let Self { bound, meaning, from, to, not_with, .. } = self;
        let (limited, unit) = parts(meaning);
        let (starts, caveat) = (from_starts(self.starts), caveat(self.undecided));
        if let Some(to) = to {
            return format!(
                "Relaxing {bound} ({limited}) alone, to {to}{unit} instead of {from}{unit}, gives a gait; with {not_with}{unit}, \
                 no gait was found{starts}{caveat}."
            );
        }
        let direction = if not_with < from { "down" } else { "up" };
        format!(
            "Relaxing {bound} ({limited}) alone, {direction} to its loosest value, {not_with}{unit}, is not sufficient: no gait \
             was found{starts}{caveat}."
        )
    }
}

impl JointRelaxation {
    /// The effect of the relaxation, as a sentence.
    pub fn in_words(&self) -> String {
        let (starts, caveat) = (from_starts(self.starts), caveat(self.undecided));
        let named =
            |value: &dyn Fn(&super::RelaxedBound) -> String| list(&self.bounds.iter().map(value).collect::<Vec<_>>());
        let in_unit = |meaning: &str, value: f64| format!("{value}{}", parts(meaning).1);
        let not_with = named(&|one| format!("{} = {}", one.bound, in_unit(&one.meaning, one.not_with)));
        if self.bounds.iter().any(|one| one.to.is_none()) {
            return format!(
                "Relaxing these bounds together is not sufficient: even at their loosest values, {not_with}, no gait was \
                 found{starts}{caveat}."
            );
        }
        let with = named(&|one| {
            let to = one.to.unwrap_or(one.not_with);
            let from = in_unit(&one.meaning, one.from);
            format!("{} instead of {from}", quantity(&one.bound, &one.meaning, to))
        });
        format!(
            "Relaxing these bounds together, to {with}, gives a gait; with {not_with}, no gait was found{starts}{caveat}."
        )
    }
}

impl BoundValue {
    /// The limit in words: `a hip angle of at most 15°`.
    fn limit_in_words(&self) -> String {
        let (limited, unit) = parts(&self.meaning);
        let place = TunedBounds::NAMES.iter().position(|name| *name == self.bound);
        let is_lower = place.is_some_and(|place| TunedBounds::IS_LOWER[place]);
        let quantity = limited.strip_suffix(" lower bound").or_else(|| limited.strip_suffix(" upper bound"));
        let quantity = quantity.unwrap_or(limited);
        format!("a {quantity} of at {} {}{unit}", if is_lower { "least" } else { "most" }, self.value)
    }
}

impl Explanation {
    /// The first conflict in one sentence, without details of the search; `None` if no conflict is known.
    pub fn headline(&self) -> Option<String> {
        if self.gait_found {
            return Some("The bounds of this trial do not conflict: the solve missed a gait.".to_owned());
        }
        let conflict = self.conflicts.first()?;
        let limits: Vec<String> = conflict.bounds.iter().map(BoundValue::limit_in_words).collect();
        Some(match limits.as_slice() {
            [] => "No value of the tuned bounds gives a gait: fixed constraints conflict.".to_owned(),
            [one] if conflict.undecided => format!("With {one}, there is probably no gait, whatever the other bounds."),
            [one] => format!("With {one}, there is no gait, whatever the other bounds."),
            _ if conflict.undecided => format!("These bounds probably conflict: {}.", list(&limits)),
            _ => format!("These bounds conflict: {}.", list(&limits)),
        })
    }

    /// The conflicts as sentences, the first one first. If they are unknown, the largest violation.
    pub fn conflicts_in_words(&self) -> Vec<String> {
        if self.gait_found {
            let found = "The search for a conflict found a gait with exactly these bounds. They do not conflict; the solve missed \
                         this gait.";
            return vec![found.to_owned()];
        }
        if self.conflicts.is_empty() {
            return self.missed_most().into_iter().collect();
        }
        self.conflicts.iter().map(Conflict::in_words).collect()
    }

    /// The largest violation, as a sentence; `None` if there is none.
    fn missed_most(&self) -> Option<String> {
        let worst = self.violations.first()?;
        Some(format!("Largest violation: {}, by {} {}.", worst.row, figure(worst.amount), worst.unit))
    }

    /// The smallest relaxation of one bound that gives a gait.
    pub fn relief(&self) -> Option<&Relaxation> {
        self.relaxations.iter().find(|relaxation| relaxation.to.is_some())
    }

    /// The relaxations as sentences: single ones, joint ones, and those that are not sufficient.
    pub fn remedies_in_words(&self) -> Vec<String> {
        let helps = |joint: &&JointRelaxation| joint.bounds.iter().all(|one| one.to.is_some());
        let alone = self.relaxations.iter().map(Relaxation::in_words);
        let together = self.together.iter().filter(helps).map(JointRelaxation::in_words);
        let in_vain = self.together.iter().filter(|joint| !helps(joint)).map(JointRelaxation::in_words);
        alone.chain(together).chain(in_vain).collect()
    }

    /// The explanation as sentences.
    pub fn sentences(&self) -> Vec<String> {
        let status = status_in_words(self.status).map(str::to_owned);
        let at_limit = self.at_limit.iter().map(BoundAtLimit::in_words);
        let conflicts = self.conflicts_in_words().into_iter();
        status.into_iter().chain(conflicts).chain(self.remedies_in_words()).chain(at_limit).collect()
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::super::RelaxedBound;
    use super::*;

    fn named(bound: usize) -> (String, String) {
        (TunedBounds::NAMES[bound].to_owned(), TunedBounds::MEANINGS[bound].to_owned())
    }

    fn at_limit(bound: usize, value: f64, domains: &[&str]) -> BoundAtLimit {
        let (bound, meaning) = named(bound);
        BoundAtLimit { bound, meaning, value, domains: domains.iter().map(|name| (*name).to_owned()).collect() }
    }

    fn relaxation(bound: usize, (from, to, not_with): (f64, Option<f64>, f64)) -> Relaxation {
        let (bound, meaning) = named(bound);
        Relaxation { bound, meaning, from, to, not_with, undecided: false, solves: 8, starts: 3, warm_start: None }
    }

    fn missed(row: &str) -> Vec<Violation> {
        vec![Violation { row: row.to_owned(), amount: 0.107_23, unit: "m/s".to_owned() }]
    }

    fn conflict(bounds: &[(usize, f64)]) -> Conflict {
        let given = |(bound, value): &(usize, f64)| {
            let (bound, meaning) = named(*bound);
            BoundValue { bound, meaning, value: *value }
        };
        Conflict {
            bounds: bounds.iter().map(given).collect(),
            without: Vec::new(),
            naturalness_terms: Vec::new(),
            violations: missed("SS1_R node 12, C3 forward hip velocity"),
            starts: 5,
            undecided: false,
        }
    }

    fn together(to: Option<[f64; 2]>) -> JointRelaxation {
        let one = |place: usize, bound: usize, from: f64, not_with: f64| {
            let (bound, meaning) = named(bound);
            RelaxedBound { bound, meaning, from, to: to.map(|to| to[place]), not_with }
        };
        JointRelaxation {
            bounds: vec![one(0, 3, 0.5, 0.61), one(1, 7, 5.0, 8.6)],
            undecided: false,
            solves: 20,
            starts: 3,
            warm_start: None,
        }
    }

    fn explanation() -> Explanation {
        Explanation {
            status: SolveStatus::Infeasible,
            violations: missed("stride, C4 walking speed"),
            conflicts: vec![conflict(&[(3, 0.5), (6, 5.0)])],
            gait_found: false,
            at_limit: vec![at_limit(1, 20.0, &["DS2_L", "SS1_L"]), at_limit(3, 0.5, &["stride"])],
            relaxations: vec![relaxation(6, (5.0, Some(15.0), 14.6)), relaxation(3, (0.5, None, 3.0))],
            together: Vec::new(),
            missed: None,
        }
    }

    #[test]
    fn headline_names_limits_with_their_direction() {
        let of = |bounds: &[(usize, f64)]| {
            let empty = Explanation {
                status: SolveStatus::Infeasible,
                violations: Vec::new(),
                conflicts: vec![conflict(bounds)],
                gait_found: false,
                at_limit: Vec::new(),
                relaxations: Vec::new(),
                together: Vec::new(),
                missed: None,
            };
            empty.headline().unwrap()
        };
        assert_eq!(
            of(&[(6, 15.0), (4, 0.1)]),
            "These bounds conflict: a hip angle of at most 15° and a swing-foot clearance of at least 0.1 m."
        );
        assert_eq!(
            of(&[(2, 1.5)]),
            "With a hip velocity of at least 1.5 m/s, there is no gait, whatever the other bounds."
        );
        assert_eq!(of(&[]), "No value of the tuned bounds gives a gait: fixed constraints conflict.");
    }

    #[test]
    fn sentences_of_an_explanation_come_in_order() {
        let sentences = explanation().sentences();
        assert!(sentences[0].starts_with("No motion near the last iterate"));
        assert_eq!(
            sentences[1..],
            [
                "a4 = 0.5 m/s (hip velocity upper bound) and a7 = 5° (hip angle) conflict with each other: with both, and \
                 the other tuned bounds at their loosest values, no gait was found from 5 starts; the nearest motion violates \
                 SS1_R node 12, C3 forward hip velocity by 0.107 m/s. With either of them at its loosest value as well, \
                 there is a gait.",
                "Relaxing a7 (hip angle) alone, to 15° instead of 5°, gives a gait; with 14.6°, no gait was found from 3 \
                 starts.",
                "Relaxing a4 (hip velocity upper bound) alone, up to its loosest value, 3 m/s, is not sufficient: no gait was \
                 found from 3 starts.",
                "a2 = 20 rad/s² (coordinate acceleration) is reached in DS2_L and SS1_L.",
                "a4 = 0.5 m/s (hip velocity upper bound) is reached in the stride as a whole.",
            ]
        );
    }

    #[test]
    fn conflicts_of_any_number_of_bounds_have_sentences() {
        let alone = conflict(&[(1, 10.0)]).in_words();
        // Only the solves that were done, no proof.
        assert!(
            alone.starts_with(
                "With a2 = 10 rad/s² (coordinate acceleration) and the other tuned bounds at their loosest values, no gait was \
                 found from 5 starts; the nearest motion violates"
            ),
            "{alone}"
        );
        assert!(alone.ends_with("With it at its loosest value as well, there is a gait."), "{alone}");
        let three = conflict(&[(1, 20.0), (4, 0.1), (6, 5.0)]).in_words();
        assert!(three.contains("(coordinate acceleration), a5 = 0.1 m (swing-foot clearance) and a7 = 5°"), "{three}");
        assert!(three.ends_with("With any one of them at its loosest value as well, there is a gait."), "{three}");
        let fixed = Conflict { naturalness_terms: vec!["a slow start".to_owned()], ..conflict(&[]) }.in_words();
        assert_eq!(
            fixed,
            "The conflict does not depend on tuned bounds: fixed constraints conflict with each other (among them a slow start). \
             With every tuned bound at its loosest value, no gait was found from 5 starts; the nearest motion violates SS1_R \
             node 12, C3 forward hip velocity by 0.107 m/s."
        );
        let further = Conflict { without: vec!["a4".to_owned()], ..conflict(&[(7, 5.0)]) }.in_words();
        assert!(
            further.starts_with("With a4 at its loosest value, another conflict remains. With a8 = 5°"),
            "{further}"
        );
    }

    #[test]
    fn joint_relaxations_name_their_bounds_together() {
        assert_eq!(
            together(Some([0.65, 9.1])).in_words(),
            "Relaxing these bounds together, to a4 = 0.65 m/s (hip velocity upper bound) instead of 0.5 m/s and a8 = 9.1° \
             (ankle angle) instead of 5°, gives a gait; with a4 = 0.61 m/s and a8 = 8.6°, no gait was found from 3 starts."
        );
        let in_vain = together(None).in_words();
        assert!(
            in_vain.contains("is not sufficient") && in_vain.ends_with("no gait was found from 3 starts."),
            "{in_vain}"
        );
        let both = Explanation { together: vec![together(None), together(Some([0.65, 9.1]))], ..explanation() };
        let remedies = both.remedies_in_words();
        assert!(remedies[2].contains("gives a gait") && remedies[3].contains("is not sufficient"), "{remedies:?}");
    }

    #[test]
    fn missed_gait_is_not_a_conflict() {
        let found = Explanation { gait_found: true, conflicts: Vec::new(), ..explanation() };
        let words = found.conflicts_in_words();
        assert!(words.len() == 1 && words[0].contains("the solve missed this gait"), "{words:?}");
    }

    #[test]
    fn explanation_without_conflicts_names_the_largest_violation() {
        let earlier = Explanation { conflicts: Vec::new(), ..explanation() };
        assert_eq!(earlier.conflicts_in_words(), ["Largest violation: stride, C4 walking speed, by 0.107 m/s."]);
        let nothing = Explanation { violations: Vec::new(), ..earlier };
        assert!(nothing.conflicts_in_words().is_empty());
        let unknown = Relaxation { starts: 0, ..relaxation(6, (5.0, Some(15.0), 14.6)) }.in_words();
        assert!(unknown.ends_with("with 14.6°, no gait was found."), "{unknown}");
    }

    #[test]
    fn bound_at_limit_in_all_domains_is_summarised() {
        let everywhere = CYCLE.map(crate::walking::Domain::name);
        assert_eq!(
            at_limit(1, 20.0, &everywhere).in_words(),
            "a2 = 20 rad/s² (coordinate acceleration) is reached in every domain."
        );
    }

    #[test]
    fn undecided_solves_get_a_caveat() {
        for words in [
            Relaxation { undecided: true, ..relaxation(6, (5.0, Some(15.0), 14.6)) }.in_words(),
            Relaxation { undecided: true, ..relaxation(3, (0.5, None, 3.0)) }.in_words(),
            JointRelaxation { undecided: true, ..together(None) }.in_words(),
            Conflict { undecided: true, ..conflict(&[(1, 10.0)]) }.in_words(),
        ] {
            assert!(words.contains("so a gait may exist"), "{words}");
        }
        for status in [SolveStatus::Stalled, SolveStatus::IterationLimit, SolveStatus::TimeLimit] {
            assert!(status_in_words(status).unwrap().contains("may still exist"), "{status:?}");
        }
        assert_eq!(status_in_words(SolveStatus::Converged), None);
    }

    #[test]
    fn violation_gives_the_name_of_its_constraint() {
        let constraint = |row: &str| missed(row)[0].constraint().to_owned();
        assert_eq!(constraint("SS2_R to SS1_R, C2 continuity of velocity, hip_R"), "C2 continuity of velocity");
        assert_eq!(constraint("stride length"), "stride length");
    }

    #[test]
    fn relief_is_the_smallest_sufficient_relaxation() {
        let mut found = explanation();
        assert_eq!(found.relief().map(|relaxation| relaxation.bound.as_str()), Some("a7"));
        found.relaxations.remove(0);
        assert_eq!(found.relief(), None);
    }
}
