//! Tests of the sentences of an explanation.

use super::super::RelaxedBound;
use super::*;
use DisplayAngleUnit::{Degree, Radian};

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
        violations: missed("SS1_R node 12, forward hip velocity"),
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
        violations: missed("stride, walking speed"),
        conflicts: vec![conflict(&[(3, 0.5), (6, 5.0)])],
        gait_found: false,
        at_limit: vec![at_limit(1, 20.0, &["DS2_L", "SS1_L"]), at_limit(3, 0.5, &["stride"])],
        relaxations: vec![relaxation(6, (5.0, Some(15.0), 14.6)), relaxation(3, (0.5, None, 3.0))],
        together: Vec::new(),
        stopped_early: false,
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
            stopped_early: false,
            missed: None,
        };
        empty.headline(Radian).unwrap()
    };
    assert_eq!(
        of(&[(6, 15.0), (4, 0.1)]),
        "These bounds conflict: a hip angle of at most 15° and a swing-foot clearance of at least 0.1 m."
    );
    assert_eq!(
        of(&[(2, 1.5)]),
        "With a hip velocity of at least 1.5 m/s, no gait was found even with the other bounds at their loosest values."
    );
    assert_eq!(of(&[]), "No gait was found even with every bound at its loosest value: fixed constraints conflict.");
}

#[test]
fn sentences_of_an_explanation_come_in_order() {
    let sentences = explanation().sentences();
    assert!(sentences[0].starts_with("No motion near the last one tried"));
    assert_eq!(
        sentences[1..],
        [
            "a4 = 0.5 m/s (maximum hip velocity) and a7 = 5° (hip angle) conflict with each other: with both at these values and \
             the other bounds at their loosest, no gait was found from 5 starts; the nearest motion violates \
             the limit of forward hip velocity by 0.107 m/s. If either of them is at its loosest value as well, \
             there is a gait.",
            "Relaxing a7 (hip angle) alone, to 15° instead of 5°, gives a gait; with 14.6°, no gait was found from 3 \
             starts.",
            "Relaxing a4 (maximum hip velocity) alone, up to its loosest value, 3 m/s, is not sufficient: no gait was \
             found from 3 starts.",
            "a2 = 20 rad/s² (coordinate acceleration) is reached in DS2_L and SS1_L.",
            "a4 = 0.5 m/s (maximum hip velocity) is reached in the stride as a whole.",
        ]
    );
}

#[test]
fn conflicts_of_any_number_of_bounds_have_sentences() {
    let alone = conflict(&[(1, 10.0)]).in_words(Radian);
    // Only the solves that were done, no proof.
    assert!(
        alone.starts_with(
            "With a2 = 10 rad/s² (coordinate acceleration) and the other bounds at their loosest values, no gait was \
             found from 5 starts; the nearest motion violates"
        ),
        "{alone}"
    );
    assert!(alone.ends_with("If this bound is at its loosest value as well, there is a gait."), "{alone}");
    let three = conflict(&[(1, 20.0), (4, 0.1), (6, 5.0)]).in_words(Radian);
    assert!(three.contains("(coordinate acceleration), a5 = 0.1 m (swing-foot clearance) and a7 = 5°"), "{three}");
    assert!(three.ends_with("If any one of them is at its loosest value as well, there is a gait."), "{three}");
    let fixed = Conflict { naturalness_terms: vec!["a slow start".to_owned()], ..conflict(&[]) }.in_words(Radian);
    assert_eq!(
        fixed,
        "The conflict does not depend on the bounds: fixed constraints conflict with each other (among them a slow start). \
         With every bound at its loosest value, no gait was found from 5 starts; the nearest motion violates the limit \
         of forward hip velocity by 0.107 m/s."
    );
    let further = Conflict { without: vec!["a4".to_owned()], ..conflict(&[(7, 5.0)]) }.in_words(Radian);
    assert!(further.starts_with("With a4 at its loosest value, another conflict remains. With a8 = 5°"), "{further}");
}

#[test]
fn joint_relaxations_name_their_bounds_together() {
    assert_eq!(
        together(Some([0.65, 9.1])).in_words(Radian),
        "Relaxing these bounds together, to a4 = 0.65 m/s (maximum hip velocity) instead of 0.5 m/s and a8 = 9.1° \
         (ankle angle) instead of 5°, gives a gait; with a4 = 0.61 m/s and a8 = 8.6°, no gait was found from 3 starts."
    );
    let in_vain = together(None).in_words(Radian);
    assert!(
        in_vain.contains("is not sufficient") && in_vain.ends_with("no gait was found from 3 starts."),
        "{in_vain}"
    );
    let both = Explanation { together: vec![together(None), together(Some([0.65, 9.1]))], ..explanation() };
    let remedies = both.remedies_in_words(Radian);
    assert!(remedies[2].contains("gives a gait") && remedies[3].contains("is not sufficient"), "{remedies:?}");
}

#[test]
fn missed_gait_is_not_a_conflict() {
    let found = Explanation { gait_found: true, conflicts: Vec::new(), ..explanation() };
    let words = found.conflicts_in_words(Radian);
    assert!(words.len() == 1 && words[0].contains("the solve missed this gait"), "{words:?}");
}

#[test]
fn explanation_without_conflicts_names_the_largest_violation() {
    let earlier = Explanation { conflicts: Vec::new(), ..explanation() };
    assert_eq!(earlier.conflicts_in_words(Radian), ["Largest violation: stride, walking speed, by 0.107 m/s."]);
    let nothing = Explanation { violations: Vec::new(), ..earlier };
    assert!(nothing.conflicts_in_words(Radian).is_empty());
    let unknown = Relaxation { starts: 0, ..relaxation(6, (5.0, Some(15.0), 14.6)) }.in_words(Radian);
    assert!(unknown.ends_with("with 14.6°, no gait was found."), "{unknown}");
}

#[test]
fn bound_at_limit_in_all_domains_is_summarised() {
    let everywhere = CYCLE.map(crate::walking::Domain::name);
    assert_eq!(
        at_limit(1, 20.0, &everywhere).in_words(Radian),
        "a2 = 20 rad/s² (coordinate acceleration) is reached in every domain."
    );
}

#[test]
fn undecided_solves_get_a_caveat() {
    for words in [
        Relaxation { undecided: true, ..relaxation(6, (5.0, Some(15.0), 14.6)) }.in_words(Radian),
        Relaxation { undecided: true, ..relaxation(3, (0.5, None, 3.0)) }.in_words(Radian),
        JointRelaxation { undecided: true, ..together(None) }.in_words(Radian),
        Conflict { undecided: true, ..conflict(&[(1, 10.0)]) }.in_words(Radian),
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
    assert_eq!(constraint("SS2_R to SS1_R, continuity of velocity, right hip"), "continuity of velocity");
    assert_eq!(constraint("stride length"), "stride length");
}

#[test]
fn relief_is_the_smallest_sufficient_relaxation() {
    let mut found = explanation();
    assert_eq!(found.relief().map(|relaxation| relaxation.bound.as_str()), Some("a7"));
    found.relaxations.remove(0);
    assert_eq!(found.relief(), None);
}

#[test]
fn angles_in_sentences_are_in_radians_or_in_degrees() {
    let lean = conflict(&[(5, 0.3)]);
    assert!(lean.in_words(Radian).starts_with("With a6 = 0.3 rad (torso lean)"));
    assert!(lean.in_words(Degree).starts_with("With a6 = 17.2° (torso lean)"));
    let relaxed = relaxation(5, (0.3, Some(0.4), 0.35)).in_words(Degree);
    assert!(relaxed.contains("to 22.9° instead of 17.2°") && relaxed.contains("with 20.1°"), "{relaxed}");
}
