//! Disturbances of a simulated walk.

use super::ground::YIELD_M;
use super::random_stream::RandomStream;
use super::terrain::Terrain;
use crate::subject::Subject;

/// Largest relative change of the body mass, unless the model ends before.
const MASS_CHANGE: f64 = 0.05;
/// Largest relative change of the speed at the start.
pub(super) const SPEED_CHANGE: f64 = 0.05;
/// Largest push of a random walk, N s: 0.07 m/s for a walker of 75 kg.
pub(super) const PUSH_N_S: f64 = 5.0;
/// Largest delay of the sensors of the prosthesis, periods of the controller: 10 ms.
const DELAY_PERIODS: f64 = 10.0;
/// Duration of a push, s.
pub(super) const PUSH_DURATION_S: f64 = 0.1;
/// Pushes of the ladder, N s.
pub(super) const LADDER_N_S: [f64; 8] = [2.0, 5.0, 10.0, 15.0, 20.0, 30.0, 40.0, 60.0];

/// A forward push at the hip.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Push {
    pub(super) start_s: f64,
    /// Negative backwards.
    pub(super) impulse_n_s: f64,
}

/// Largest relative decrease and increase of the body mass. Each is 5 %, less where the model has no such body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct MassChanges {
    decrease: f64,
    increase: f64,
}

impl MassChanges {
    /// The changes that keep the body mass of a subject within its range.
    pub(super) fn of(body_mass_kg: f64) -> Self {
        let (lightest, heaviest) = Subject::BODY_MASS_RANGE_KG;
        Self {
            decrease: MASS_CHANGE.min(1.0 - lightest / body_mass_kg),
            increase: MASS_CHANGE.min(heaviest / body_mass_kg - 1.0),
        }
    }

    /// The range of body masses, kg.
    pub(super) fn range_kg(self, body_mass_kg: f64) -> [f64; 2] {
        [body_mass_kg * (1.0 - self.decrease), body_mass_kg * (1.0 + self.increase)]
    }

    /// A factor, uniform on either side of 1.
    fn draw(self, random: &mut RandomStream) -> f64 {
        let change = random.within(1.0);
        1.0 + change * if change < 0.0 { self.decrease } else { self.increase }
    }
}

/// Everything that is random in a simulated walk.
#[derive(Debug, Clone)]
pub(super) struct Disturbance {
    pub(super) mass_factor: f64,
    pub(super) speed_factor: f64,
    pub(super) push: Push,
    pub(super) delay_periods: usize,
    pub(super) terrain: Terrain,
    /// How far the ground yields under body weight, m.
    pub(super) yield_m: f64,
    /// Noise of the sensors: the constant error of the thigh angle in rad, and a stream.
    pub(super) noise: Option<(f64, RandomStream)>,
}

impl Disturbance {
    /// Level ground, exact sensors with half the largest delay, and no other disturbance but a push.
    pub(super) fn only(push: Push) -> Self {
        Self {
            mass_factor: 1.0,
            speed_factor: 1.0,
            push,
            delay_periods: 5,
            terrain: Terrain::level(),
            yield_m: YIELD_M,
            noise: None,
        }
    }

    /// Undisturbed.
    pub(super) fn none() -> Self {
        Self::only(Push { start_s: 0.0, impulse_n_s: 0.0 })
    }

    /// The disturbances of a walk. Walks with the same seed and number share all draws on every ground: heights scale.
    pub(super) fn random(
        seed: u64,
        walk: u32,
        mass_changes: MassChanges,
        ground_m: f64,
        step_m: f64,
        pushed_within_s: f64,
    ) -> Self {
        let mut random = RandomStream::new(seed, u64::from(walk));
        let mass_factor = mass_changes.draw(&mut random);
        let speed_factor = 1.0 + random.within(SPEED_CHANGE);
        let push = Push { start_s: pushed_within_s * random.uniform(), impulse_n_s: random.within(PUSH_N_S) };
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // 0 to 10
        let delay_periods = (DELAY_PERIODS * random.uniform()).round() as usize;
        let thigh_offset = super::sensors::THIGH_OFFSET_RAD * random.normal();
        let terrain = Terrain::random(step_m, ground_m, &mut random);
        Self {
            mass_factor,
            speed_factor,
            push,
            delay_periods,
            terrain,
            yield_m: YIELD_M,
            noise: Some((thigh_offset, random)),
        }
    }
}
