//! The time within the planned stride at which a controller is.
//!
//! The clock advances with time. Where a measured phase variable moves with the planned one, the clock is corrected until
//! they agree; where the phase variable stands still or turns round, time alone advances the clock. It never runs
//! backwards, and it waits at the end of a section for the event that starts the next one. A heel strike restarts it.

use super::foot_contact::FootContact;
use crate::body::LegGeometry;

/// Rate at which an error of the phase decays, 1/s.
const CORRECTION_RATE_1_S: f64 = 30.0;
/// Largest correction, in seconds per second.
const MAX_CORRECTION: f64 = 1.0;

/// Smallest planned rate of the hip position that tells the time, m/s.
const MIN_HIP_M_S: f64 = 0.3;
/// Smallest planned rate of the thigh angle that tells the time, rad/s.
const MIN_THIGH_RAD_S: f64 = 1.0;
/// Share of a section after which a loaded swing foot has landed.
const LANDING: f64 = 0.5;

/// A phase variable: as measured, and as planned at the time of the clock.
#[derive(Debug, Clone, Copy)]
pub(super) struct StridePhase {
    pub(super) measured: f64,
    pub(super) planned: f64,
    pub(super) planned_rate: f64,
    /// Magnitude of the planned rate below which the variable does not tell the time.
    pub(super) slowest: f64,
}

impl StridePhase {
    /// The linearised hip position over the toe of the prosthesis, m, from its thigh and its knee and ankle. The planned
    /// angles come with their rates.
    pub(super) fn of_hip_position(
        leg: &LegGeometry,
        measured: (f64, [f64; 2]),
        (thigh, thigh_rate): (f64, f64),
        (joints, joint_rates): ([f64; 2], [f64; 2]),
    ) -> Self {
        Self {
            measured: hip_position(leg, measured.0, measured.1),
            planned: hip_position(leg, thigh, joints),
            planned_rate: hip_position(leg, thigh_rate, joint_rates),
            slowest: MIN_HIP_M_S,
        }
    }

    /// The angle of the thigh of the prosthesis, rad. The planned angle comes with its rate.
    pub(super) fn of_thigh_angle(measured: f64, (planned, planned_rate): (f64, f64)) -> Self {
        Self { measured, planned, planned_rate, slowest: MIN_THIGH_RAD_S }
    }
}

/// Linearised hip position over the toe of the prosthesis, m, from its thigh, knee and ankle; also its rate.
fn hip_position(leg: &LegGeometry, thigh: f64, [knee, ankle]: [f64; 2]) -> f64 {
    let shank = thigh - knee;
    let foot = shank + ankle;
    -(leg.thigh_length_m * thigh + leg.shank_length_m * shank + leg.ankle_height_m * foot)
}

/// The clock of a controller.
#[derive(Debug, Clone, Copy)]
pub(super) struct StrideClock {
    pub(super) time_s: f64,
}

impl StrideClock {
    /// Restarts at `planned_s`, where the plan has this heel strike, if the foot strikes late in the section in which it
    /// swings. Returns whether it does.
    pub(super) fn restart_at(&mut self, planned_s: f64, (start_s, end_s): (f64, f64), foot: &mut FootContact) -> bool {
        let is_late = self.time_s >= start_s + LANDING * (end_s - start_s);
        let strikes = is_late && foot.take_heel_strike();
        if strikes {
            self.time_s = planned_s;
        }
        strikes
    }

    /// Advances by `period_s`, at most to `end_s`.
    pub(super) fn advance(&mut self, period_s: f64, end_s: f64, phase: Option<StridePhase>) {
        let correction = phase.filter(|phase| phase.planned_rate.abs() >= phase.slowest).map_or(0.0, |phase| {
            let late_s = (phase.measured - phase.planned) / phase.planned_rate;
            (CORRECTION_RATE_1_S * late_s).clamp(-MAX_CORRECTION, MAX_CORRECTION)
        });
        self.time_s = (self.time_s + period_s * (1.0 + correction)).min(end_s).max(self.time_s);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn run(rate: f64, slowest: f64) -> f64 {
        let mut clock = StrideClock { time_s: 0.0 };
        for k in 0..1000 {
            let planned = clock.time_s;
            let measured = rate * f64::from(k + 1) * 1e-3;
            let phase = StridePhase { measured, planned, planned_rate: 1.0, slowest };
            clock.advance(1e-3, 2.0, Some(phase));
        }
        clock.time_s
    }

    #[test]
    fn clock_follows_a_phase_variable_that_moves_and_time_otherwise() {
        assert!((run(0.8, 0.1) - 0.8).abs() < 0.01);
        assert!((run(1.2, 0.1) - 1.2).abs() < 0.01);
        assert!((run(1.2, 1.1) - 1.0).abs() < 1e-9);
    }

    #[test]
    fn heel_strike_restarts_the_clock_in_the_second_half_of_swing_only() {
        let mut foot = FootContact::new(false);
        foot.update(500.0);
        let mut clock = StrideClock { time_s: 0.7 };
        assert!(!clock.restart_at(0.0, (0.5, 1.0), &mut foot) && clock.time_s == 0.7);
        clock.time_s = 0.8;
        assert!(clock.restart_at(0.0, (0.5, 1.0), &mut foot) && clock.time_s == 0.0);
        // The foot stays on the ground.
        clock.time_s = 0.9;
        assert!(!clock.restart_at(0.0, (0.5, 1.0), &mut foot) && clock.time_s == 0.9);
    }

    #[test]
    fn clock_stops_at_the_end_of_its_section_and_never_runs_backwards() {
        let mut clock = StrideClock { time_s: 0.5 };
        let back = StridePhase { measured: -9.0, planned: 0.0, planned_rate: 1.0, slowest: 0.1 };
        clock.advance(1e-3, 0.6, Some(back));
        assert_eq!(clock.time_s, 0.5);
        for _ in 0..1000 {
            clock.advance(1e-3, 0.6, None);
        }
        assert_eq!(clock.time_s, 0.6);
    }
}
