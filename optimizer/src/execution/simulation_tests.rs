//! The plant against mechanics, and simulated walks against their contract.

use super::ground::YIELD_M;
use super::plant::{AppliedTorques, Plant, PlantMotion};
use super::random_disturbances::{Disturbance, MassChanges, Push};
use super::random_stream::RandomStream;
use super::simulated_walk::{PLANT_STEPS, SimulatedWalker, WalkEnd};
use super::terrain::Terrain;
use super::{ExecutionOptions, simulate};
use crate::body::{FootPoint, GRAVITY, Side, WalkerModel};
use crate::walking::kinetic_energy;
use crate::{CancelToken, Device, Gait, GaitProblem, SolveOptions, Subject, TunedBounds, solve};
use std::sync::atomic::{AtomicU32, Ordering};

const ANKLE_RANGE_RAD: (f64, f64) = (-0.4, 0.3);
/// Bent knees, away from the joint stops.
const POSTURE: [f64; 9] = [0.0, 2.0, 0.1, 0.3, 0.4, 0.05, -0.2, 0.5, 0.02];

fn walker_model() -> WalkerModel {
    WalkerModel::new(&Subject::builtin(1).unwrap(), &Device::ampro3().unwrap()).unwrap()
}

/// A gait that walks: an action of Table I that no published figure uses.
fn walkable_gait() -> Gait {
    let mut problem = GaitProblem::new(Subject::builtin(1).unwrap(), false).unwrap();
    problem.bounds = TunedBounds::from_array([20.0, 90.0, 0.5, 1.4, 0.026, 0.2, 20.0, 30.0]).unwrap();
    solve(&problem, None, &SolveOptions::default(), &mut |_| {}, &CancelToken::new()).unwrap().gait
}

fn energy(model: &WalkerModel, motion: &PlantMotion) -> f64 {
    let heights: f64 = model.bodies.iter().map(|body| body.mass * body.com.position(&motion.q)[1]).sum();
    kinetic_energy(model, &motion.q, &motion.qd) + GRAVITY * heights
}

#[test]
fn flight_without_torques_keeps_its_energy_up_to_the_order_of_the_step() {
    let (model, terrain) = (walker_model(), Terrain::level());
    let plant = Plant::new(&model, &terrain, YIELD_M, ANKLE_RANGE_RAD);
    let start = PlantMotion::new(POSTURE, [1.0, 3.0, 0.5, 1.0, 0.6, -0.3, -1.0, 0.5, 0.4]);
    let change = |parts: u32| {
        let mut motion = start;
        for _ in 0..200 * parts {
            motion = plant.step(&motion, &AppliedTorques::default(), 1e-3 / f64::from(parts)).unwrap();
        }
        assert_eq!(motion.ground, [[0.0; 2]; 4]);
        (energy(&model, &motion) - energy(&model, &start)).abs() / energy(&model, &start)
    };
    let (coarse, fine) = (change(1), change(2));
    assert!(coarse < 1e-3, "{coarse}");
    assert!((coarse / fine - 2.0).abs() < 0.1, "{coarse} {fine}");
}

#[test]
fn ground_carries_the_weight_of_a_standing_walker() {
    let (model, terrain) = (walker_model(), Terrain::level());
    let plant = Plant::new(&model, &terrain, YIELD_M, ANKLE_RANGE_RAD);
    // Both feet are flat, slightly above the ground. The torso leans forwards, so that the walker is balanced. The joints
    // are stiff.
    let posture = [0.0, 0.0, 0.2, 0.2, 0.0, 0.0, 0.2, 0.0, 0.0];
    let toe = model.contact_point(FootPoint::Toe, Side::Left).chain();
    let mut motion = PlantMotion::new(posture, [0.0; 9]);
    motion.q[1] = 0.002 - toe.position(&posture)[1];
    for _ in 0..80_000 {
        let torques = std::array::from_fn(|i| 3000.0 * (posture[3 + i] - motion.q[3 + i]) - 40.0 * motion.qd[3 + i]);
        motion = plant.step(&motion, &AppliedTorques { torques, push: 0.0 }, 1e-4).unwrap();
    }
    assert!(motion.qd.iter().all(|rate| rate.abs() < 1e-3), "{:?}", motion.qd);
    let carried: f64 = motion.ground.iter().map(|force| force[0]).sum();
    let weight = model.total_mass * GRAVITY;
    assert!((carried / weight - 1.0).abs() < 1e-3, "{carried} {weight}");
    let friction: f64 = motion.ground.iter().map(|force| force[1]).sum();
    assert!(friction.abs() < 1e-3 * weight, "{friction}");
}

#[test]
fn forces_of_the_ground_stay_in_the_friction_cone_when_a_walker_drops_and_slides() {
    let (model, terrain) = (walker_model(), Terrain::random(0.7, 0.01, &mut RandomStream::new(1, 1)));
    let plant = Plant::new(&model, &terrain, YIELD_M, ANKLE_RANGE_RAD);
    let mut motion = PlantMotion::new(POSTURE, [2.0, -1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    motion.q[1] = 0.95;
    let mut largest = 0.0_f64;
    for _ in 0..600 {
        motion = plant.step(&motion, &AppliedTorques::default(), 5e-4).unwrap();
        for [normal, friction] in motion.ground {
            assert!(normal >= 0.0 && friction.abs() <= 0.8 * normal, "{normal} {friction}");
            largest = largest.max(friction.abs());
        }
    }
    assert!(largest > 100.0, "{largest}");
}

#[test]
fn undisturbed_walk_repeats_itself_and_a_shorter_step_of_the_plant_hardly_changes_it() {
    let gait = walkable_gait();
    let mut walker = SimulatedWalker::new(&gait).unwrap();
    let walk = |walker: &SimulatedWalker<'_>| walker.walk(&Disturbance::none(), 2).unwrap();
    let first = walk(&walker);
    assert_eq!(first.end, WalkEnd::Completed);
    assert_eq!(first, walk(&walker));
    walker.plant_steps = 2 * PLANT_STEPS;
    let finer = walk(&walker);
    let difference = (2..9).map(|i| (finer.motion.q[i] - first.motion.q[i]).abs()).fold(0.0, f64::max);
    assert!(difference < 0.01, "{difference}");
    assert_eq!(finer.strides, first.strides);
}

#[test]
fn walk_with_a_push_beyond_every_remedy_is_a_fall() {
    let gait = walkable_gait();
    let walker = SimulatedWalker::new(&gait).unwrap();
    for impulse_n_s in [-150.0, 150.0] {
        let outcome = walker.walk(&Disturbance::only(Push { start_s: 0.5, impulse_n_s }), 20).unwrap();
        assert_eq!(outcome.end, WalkEnd::Fell);
        assert!(outcome.strides < 3);
    }
}

#[test]
fn report_does_not_depend_on_threads_and_depends_on_the_seed() {
    let gait = walkable_gait();
    let report = |threads: usize, seed: u64| {
        let options =
            ExecutionOptions { number_of_simulated_walks: 6, strides: 4, seed, threads, ..ExecutionOptions::default() };
        let done = AtomicU32::new(0);
        let report = simulate(&gait, &options, &done, &CancelToken::new()).unwrap().unwrap();
        assert_eq!((done.into_inner(), options.random_walks()), (18, 18));
        report
    };
    let one = report(1, 1);
    assert_eq!(one.body_mass_kg, [0.95 * 65.7, 1.05 * 65.7]);
    assert_eq!(one, report(2, 1));
    assert_ne!(one.grounds, report(1, 2).grounds);
    let all = |count: u32| one.grounds.iter().all(|g| g.completed + g.fell + g.halted == count);
    assert!(all(6));
    let text = serde_json::to_string(&one).unwrap();
    assert_eq!(one, serde_json::from_str(&text).unwrap());
}

#[test]
fn cancelled_simulation_has_no_report() {
    let (gait, done, cancel) = (walkable_gait(), AtomicU32::new(0), CancelToken::new());
    cancel.cancel();
    assert_eq!(simulate(&gait, &ExecutionOptions::default(), &done, &cancel).unwrap(), None);
    assert_eq!(done.load(Ordering::Relaxed), 0);
}

#[test]
fn sentence_counts_the_complete_walks_of_each_ground() {
    let options = ExecutionOptions { number_of_simulated_walks: 2, strides: 1, ..ExecutionOptions::default() };
    let report = simulate(&walkable_gait(), &options, &AtomicU32::new(0), &CancelToken::new()).unwrap().unwrap();
    let [level, low, high] = [0, 1, 2].map(|ground| report.grounds[ground].completed);
    let expected = format!(
        "{level} of 2 simulated walks on level ground, {low} of 2 simulated walks on ground uneven by ±5 mm and {high} of 2 \
         simulated walks on ground uneven by ±10 mm lasted 1 stride."
    );
    assert_eq!(report.sentence(), expected);
}

#[test]
fn body_masses_are_spread_over_the_range_of_the_model() {
    let (lightest, heaviest) = Subject::BODY_MASS_RANGE_KG;
    // In the middle of the range, at its ends, and one percent from an end.
    for (mass, lowest, highest) in
        [(70.0, 0.95, 1.05), (lightest, 1.0, 1.05), (heaviest, 0.95, 1.0), (heaviest / 1.01, 0.95, 1.01)]
    {
        let changes = MassChanges::of(mass);
        let range = changes.range_kg(mass).map(|kg| kg / mass);
        assert!((range[0] - lowest).abs() < 1e-12 && (range[1] - highest).abs() < 1e-12, "{mass} {range:?}");
        let factors: Vec<f64> =
            (0..400).map(|walk| Disturbance::random(1, walk, changes, 0.0, 0.7, 1.0).mass_factor).collect();
        assert!(factors.iter().all(|factor| (lowest - 1e-12..=highest + 1e-12).contains(factor)), "{mass}");
        for (side, largest) in [(-1.0, 1.0 - lowest), (1.0, highest - 1.0)] {
            let sizes = || factors.iter().map(|factor| side * (factor - 1.0)).filter(|size| *size > 0.0);
            if largest < 1e-12 {
                assert!(sizes().all(|size| size < 1e-12));
                continue;
            }
            // Half of the walks are on either side, and not at its end.
            assert!((160..240).contains(&sizes().count()), "{mass} {}", sizes().count());
            let far = sizes().filter(|size| *size > 0.5 * largest).count();
            assert!((60..140).contains(&far), "{mass} {far}");
            assert!(sizes().filter(|size| *size > 0.99 * largest).count() < 10, "{mass}");
        }
    }
}

#[test]
fn options_out_of_range_are_refused_by_name() {
    let refused = |options: ExecutionOptions| options.validate().unwrap_err().to_string();
    assert!(
        refused(ExecutionOptions { number_of_simulated_walks: 0, ..ExecutionOptions::default() })
            .starts_with("number_of_simulated_walks")
    );
    assert!(refused(ExecutionOptions { threads: 0, ..ExecutionOptions::default() }).starts_with("threads"));
    let heights = ExecutionOptions { ground_heights_m: vec![f64::NAN], ..ExecutionOptions::default() };
    assert!(refused(heights).starts_with("ground_heights_m"));
}
