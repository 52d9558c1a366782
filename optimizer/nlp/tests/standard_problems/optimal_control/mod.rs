//! Optimal control problems of the COPS collection (Dolan, Moré & Munson, *Benchmarking optimization software with COPS
//! 3.0*, ANL/MCS-TM-273, 2004), discretised as published.

mod gas_oil;
mod trapezoid;

use std::f64::consts::PI;

use self::trapezoid::{Cost, Equation, NodeVariable, Trapezoid};
use super::sparse::Sparse;
use super::{Dual, INF};

/// A problem with its published optimum.
pub struct ControlProblem {
    pub name: &'static str,
    pub program: Sparse,
    pub optimum: f64,
    /// Relative distance that the published digits allow.
    pub within: f64,
}

impl ControlProblem {
    pub fn is_optimum(&self, objective: f64) -> bool {
        (objective - self.optimum).abs() <= self.within * self.optimum.abs()
    }
}

/// Six digits, the last one possibly cut off.
const SIX_DIGITS: f64 = 1e-5;

/// Every problem with its published number of intervals. The optima with six digits are those of the COPS report, as
/// the tests of COPSBenchmark.jl (github.com/MadNLP/COPSBenchmark.jl, `test/runtests.jl`) repeat them; the others are
/// those of MINLPLib (minlplib.org: chain200, lnts200, catmix100), which has the same discretisations.
pub fn all() -> Vec<ControlProblem> {
    let problem = |name, program, optimum, within| ControlProblem { name, program, optimum, within };
    vec![
        problem("hanging chain", hanging_chain(200), 5.068_917_342, 1e-8),
        problem("particle steering", particle_steering(200), 0.554_577_016, 1e-8),
        // The barrier terms of 202 bounds at the last mu are 4e-6 of this.
        problem("catalyst mixing", catalyst_mixing(100), -0.048_069_43, 4e-6),
        problem("Goddard rocket", goddard_rocket(400), -1.012_83, SIX_DIGITS),
        problem("robot arm", robot_arm(200), 9.141_38, SIX_DIGITS),
        problem("hang glider", hang_glider(100), -1_255.05, SIX_DIGITS),
        problem("gas oil cracking", gas_oil::program(100), 5.236_6e-3, 2e-5),
    ]
}

fn anywhere(start: fn(f64) -> f64) -> NodeVariable {
    NodeVariable { bounds: (-INF, INF), ends: (None, None), start }
}

fn between(lower: f64, upper: f64, start: fn(f64) -> f64) -> NodeVariable {
    NodeVariable { bounds: (lower, upper), ..anywhere(start) }
}

impl NodeVariable {
    fn first(self, first: f64) -> Self {
        Self { ends: (Some(first), self.ends.1), ..self }
    }

    fn last(self, last: f64) -> Self {
        Self { ends: (self.ends.0, Some(last)), ..self }
    }
}

/// Chain of length 4 between heights 1 and 3 with the smallest potential energy. States: height, energy, length;
/// control: slope.
pub fn hanging_chain(intervals: usize) -> Sparse {
    fn stretch(slope: Dual) -> Dual {
        (slope * slope + 1.0).powf(0.5)
    }
    fn height(t: f64) -> f64 {
        8.0 * t * (0.5 * t - 0.25) + 1.0
    }
    fn slope(t: f64) -> f64 {
        8.0 * (t - 0.25)
    }
    Trapezoid {
        intervals,
        equations: vec![
            Equation { of: &[3], rate: |s| s[0] },
            Equation { of: &[0, 3], rate: |s| s[0] * stretch(s[1]) },
            Equation { of: &[3], rate: |s| stretch(s[0]) },
        ],
        variables: vec![
            anywhere(height).first(1.0).last(3.0),
            anywhere(|t| height(t) * slope(t)).first(0.0),
            anywhere(slope).first(0.0).last(4.0),
            anywhere(slope),
        ],
        duration: ((1.0, 1.0), 1.0),
        cost: Cost::Last(&[(1, 1.0)], 0.0),
    }
    .program()
}

/// Fastest transfer of a particle under a force of constant magnitude to a height of 5 and a horizontal speed of 45.
/// States: position and velocity; control: angle of the force.
pub fn particle_steering(intervals: usize) -> Sparse {
    Trapezoid {
        intervals,
        equations: vec![
            Equation { of: &[2], rate: |s| s[0] },
            Equation { of: &[3], rate: |s| s[0] },
            Equation { of: &[4], rate: |s| 100.0 * s[0].cos() },
            Equation { of: &[4], rate: |s| 100.0 * s[0].sin() },
        ],
        variables: vec![
            anywhere(|_| 0.0).first(0.0),
            anywhere(|t| 5.0 * t).first(0.0).last(5.0),
            anywhere(|t| 45.0 * t).first(0.0).last(45.0),
            anywhere(|_| 0.0).first(0.0).last(0.0),
            between(-0.5 * PI, 0.5 * PI, |_| 0.0),
        ],
        duration: ((0.0, INF), 1.0),
        cost: Cost::Duration,
    }
    .program()
}

/// Largest yield of a tubular reactor in which two catalysts are mixed. States: two substances; control: share of the
/// first catalyst.
pub fn catalyst_mixing(intervals: usize) -> Sparse {
    Trapezoid {
        intervals,
        equations: vec![
            Equation { of: &[0, 1, 2], rate: |s| s[2] * (s[1] * 10.0 - s[0]) },
            Equation { of: &[0, 1, 2], rate: |s| s[2] * (s[0] - s[1] * 10.0) - (1.0 - s[2]) * s[1] },
        ],
        variables: vec![anywhere(|_| 1.0).first(1.0), anywhere(|_| 0.0).first(0.0), between(0.0, 1.0, |_| 0.0)],
        duration: ((1.0, 1.0), 1.0),
        cost: Cost::Last(&[(0, 1.0), (1, 1.0)], -1.0),
    }
    .program()
}

/// Largest altitude of a rocket (R. Goddard). States: altitude, velocity, mass; control: thrust.
pub fn goddard_rocket(intervals: usize) -> Sparse {
    const MAX_THRUST: f64 = 3.5;
    const LAST_MASS: f64 = 0.6;
    fn acceleration(s: &[Dual]) -> Dual {
        let (altitude, velocity, mass, thrust) = (s[0], s[1], s[2], s[3]);
        let drag = 310.0 * velocity * velocity * (-500.0 * (altitude - 1.0)).exp();
        (thrust - drag) / mass - 1.0 / (altitude * altitude)
    }
    Trapezoid {
        intervals,
        equations: vec![
            Equation { of: &[1], rate: |s| s[0] },
            Equation { of: &[0, 1, 2, 3], rate: acceleration },
            Equation { of: &[3], rate: |s| s[0] * -2.0 },
        ],
        variables: vec![
            between(1.0, INF, |_| 1.0).first(1.0),
            between(0.0, INF, |t| t * (1.0 - t)).first(0.0),
            between(LAST_MASS, 1.0, |t| 1.0 + (LAST_MASS - 1.0) * t).first(1.0).last(LAST_MASS),
            between(0.0, MAX_THRUST, |_| 0.5 * MAX_THRUST),
        ],
        duration: ((0.0, INF), 1.0),
        cost: Cost::Last(&[(0, -1.0)], 0.0),
    }
    .program()
}

/// Fastest turn of a robot arm of length 5. States: extension and two angles, and their rates; controls: three forces.
pub fn robot_arm(intervals: usize) -> Sparse {
    const ARM: f64 = 5.0;
    fn inertia(extension: Dual) -> Dual {
        ((ARM - extension).powi(3) + extension.powi(3)) / 3.0
    }
    fn turning(s: &[Dual]) -> Dual {
        let sin = s[1].sin();
        s[2] / (inertia(s[0]) * sin * sin)
    }
    Trapezoid {
        intervals,
        equations: vec![
            Equation { of: &[3], rate: |s| s[0] },
            Equation { of: &[4], rate: |s| s[0] },
            Equation { of: &[5], rate: |s| s[0] },
            Equation { of: &[6], rate: |s| s[0] / ARM },
            Equation { of: &[0, 2, 7], rate: turning },
            Equation { of: &[0, 8], rate: |s| s[1] / inertia(s[0]) },
        ],
        variables: vec![
            between(0.0, ARM, |_| 4.5).first(4.5).last(4.5),
            between(-PI, PI, |t| 2.0 * PI / 3.0 * t * t).first(0.0).last(2.0 * PI / 3.0),
            between(0.0, PI, |_| 0.25 * PI).first(0.25 * PI).last(0.25 * PI),
            anywhere(|_| 0.0).first(0.0).last(0.0),
            anywhere(|t| 4.0 * PI / 3.0 * t).first(0.0).last(0.0),
            anywhere(|_| 0.0).first(0.0).last(0.0),
            between(-1.0, 1.0, |_| 0.0),
            between(-1.0, 1.0, |_| 0.0),
            between(-1.0, 1.0, |_| 0.0),
        ],
        duration: ((0.0, INF), 1.0),
        cost: Cost::Duration,
    }
    .program()
}

/// Longest flight of a hang glider through an updraught. States: position and velocity; control: lift coefficient.
pub fn hang_glider(intervals: usize) -> Sparse {
    /// Horizontal and vertical acceleration at (x, vx, vy, lift coefficient).
    fn accelerations(s: &[Dual]) -> (Dual, Dual) {
        let (vx, lift_coefficient) = (s[1], s[3]);
        let updraught = (s[0] / 100.0 - 2.5).powi(2);
        let sinking = s[2] - 2.5 * (1.0 - updraught) * (-updraught).exp();
        let speed = (vx * vx + sinking * sinking).powf(0.5);
        // Per unit of speed, kg/s, divided by the mass.
        let pressure = 0.5 * 1.13 * 14.0 / 100.0 * speed;
        let drag = (lift_coefficient * lift_coefficient * 0.069_662 + 0.034) * pressure;
        let lift = lift_coefficient * pressure;
        (-(lift * sinking) - drag * vx, lift * vx - drag * sinking - Dual::constant(9.81))
    }
    Trapezoid {
        intervals,
        equations: vec![
            Equation { of: &[2], rate: |s| s[0] },
            Equation { of: &[3], rate: |s| s[0] },
            Equation { of: &[0, 2, 3, 4], rate: |s| accelerations(s).0 },
            Equation { of: &[0, 2, 3, 4], rate: |s| accelerations(s).1 },
        ],
        variables: vec![
            between(0.0, INF, |t| 13.23 * t).first(0.0),
            anywhere(|t| 1000.0 - 100.0 * t).first(1000.0).last(900.0),
            between(0.0, INF, |_| 13.23).first(13.23).last(13.23),
            anywhere(|_| -1.288).first(-1.288).last(-1.288),
            between(0.0, 1.4, |_| 0.7),
        ],
        duration: ((0.0, INF), 1.0),
        cost: Cost::Last(&[(0, -1.0)], 0.0),
    }
    .program()
}
