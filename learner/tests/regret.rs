//! The learner beats random search on seeds that the published benchmark does not use. The `regret` example runs the
//! benchmark.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, missing_docs, unreachable_pub, dead_code)]

#[path = "../examples/regret/joint_angles.rs"]
mod joint_angles;
#[path = "../examples/regret/problems.rs"]
mod problems;
#[path = "../examples/regret/simulation.rs"]
mod simulation;
#[path = "../examples/regret/table.rs"]
mod table;

use gait_learner::{LearnerSettings, Method};
use problems::{Knowledge, Problem};
use simulation::{Person, champion, run};
use table::{DEFAULT_COLUMNS, People, Table};

const COMPARISONS: usize = 25;

/// Mean regret after the last comparison. Without settings, that of random search.
fn mean_regret(name: &str, noise: f64, settings: Option<&LearnerSettings>) -> f64 {
    let seeds = 40..52;
    let count = (seeds.end - seeds.start) as f64;
    let last = |seed| {
        let problem = Problem::named(name, seed, None).unwrap();
        let person = Person::new(&problem, noise, seed);
        let regrets = match settings {
            Some(settings) => run(person, settings, COMPARISONS, 1, Knowledge::default()).unwrap(),
            None => champion(person, COMPARISONS),
        };
        assert_eq!(regrets.len(), COMPARISONS + 1);
        regrets[COMPARISONS]
    };
    seeds.map(last).sum::<f64>() / count
}

#[test]
fn methods_beat_random_search_with_exact_answers() {
    let random = mean_regret("table1", 0.0, None);
    let line = mean_regret("table1", 0.0, Some(&LearnerSettings::of(Method::LineCoSpar)));
    let eubo = mean_regret("table1", 0.0, Some(&LearnerSettings::of(Method::Eubo)));
    assert!(line < 0.75 * random && eubo < 0.5 * random, "random {random} linecospar {line} eubo {eubo}");
}

#[test]
fn methods_beat_random_search_with_noisy_answers() {
    let random = mean_regret("table1", 0.05, None);
    for settings in [LearnerSettings::of(Method::LineCoSpar), LearnerSettings::for_uncertain_answers()] {
        let regret = mean_regret("table1", 0.05, Some(&settings));
        assert!(regret < 0.8 * random, "{regret} random {random} {settings:?}");
    }
}

#[test]
fn eubo_beats_random_search_on_hartmann_3() {
    let random = mean_regret("hart3", 0.0, None);
    let eubo = mean_regret("hart3", 0.0, Some(&LearnerSettings::of(Method::Eubo)));
    assert!(eubo < 0.6 * random, "random {random} eubo {eubo}");
}

#[test]
fn eubo_beats_random_search_on_the_gaits_of_an_atlas() {
    for (name, gaits) in [("atlas1", 254), ("atlas1m", 171)] {
        let table = Table::built_in(name, DEFAULT_COLUMNS).unwrap().unwrap();
        let person = |seed| table.person(People::LowResults, seed);
        let problem = person(40);
        assert!(problem.space.len() == 11_664 && problem.converged.iter().all(|converged| *converged), "{name}");
        let mut utilities: Vec<u64> = problem.utility.iter().map(|utility| utility.to_bits()).collect();
        utilities.sort_unstable();
        utilities.dedup();
        assert!(utilities.len() > gaits / 2 && utilities.len() <= gaits, "{name}: {} utilities", utilities.len());
        let (mut random, mut eubo) = (0.0, 0.0);
        for seed in 40..52 {
            let problem = person(seed);
            let last = |regrets: Vec<f64>| *regrets.last().unwrap();
            random += last(champion(Person::new(&problem, 0.0, seed), 10));
            let settings = LearnerSettings::of(Method::Eubo);
            eubo += last(run(Person::new(&problem, 0.0, seed), &settings, 10, 1, Knowledge::default()).unwrap());
        }
        assert!(eubo < random, "{name}: random {random} eubo {eubo}");
    }
}

#[test]
fn descriptors_help_people_with_an_ideal_motion() {
    let table = || Table::built_in("atlas1", DEFAULT_COLUMNS).unwrap().unwrap();
    let (levels, joint_angles) = (table(), table().described_by_joint_angles(0.5).unwrap());
    let settings = LearnerSettings::of(Method::Eubo);
    let known = Knowledge { gaits: true, ..Knowledge::default() };
    let mean = |table: &Table, knowledge| {
        let last = |seed| {
            let problem = table.person(People::IdealMotion, seed);
            let regrets = run(Person::new(&problem, 0.0, seed), &settings, 15, 1, knowledge).unwrap();
            *regrets.last().unwrap()
        };
        (40..52).map(last).sum::<f64>() / 12.0
    };
    let (of_levels, of_angles) = (mean(&levels, known), mean(&joint_angles, Knowledge::default()));
    assert!(of_angles < 0.5 * of_levels, "levels {of_levels} joint angles {of_angles}");
    // With muscles, the angles are not part of the project.
    let with_muscles = Table::built_in("atlas1m", DEFAULT_COLUMNS).unwrap().unwrap();
    assert!(with_muscles.described_by_joint_angles(0.5).is_err());
}
