//! The walker of the simulated walks: floating base, compliant ground under heel and toe of both feet, joint stops.
//!
//! A step is semi-implicit: gravity, Coriolis forces and torques are those at its start; the forces of the ground and of
//! the stops are those at its end, because they are stiff. Newton's method solves for the velocities at the end. So every
//! force that acts is a force of the ground model: it does not pull, and friction stays within its cone.

use super::ground::{Ground, GroundForce};
use super::terrain::Terrain;
use crate::body::coordinates::{LINKS, to_generalised};
use crate::body::{ContactPoint, FootPoint, InverseDynamics, PointState, Side, WalkerModel};
use nalgebra::{SMatrix, SVector};

/// Velocities or generalised forces.
type Vector = SVector<f64, 9>;

/// Change of the velocities below which Newton's method ends, m/s and rad/s.
const CONVERGED: f64 = 1e-9;
/// Largest number of iterations of a step.
const ITERATIONS: usize = 30;
/// Largest number of halvings of a step whose iterations do not converge.
const HALVINGS: u32 = 8;
/// Smallest fraction of an iteration of Newton's method.
const MIN_NEWTON_FRACTION: f64 = 1e-3;

/// Stiffness of a joint stop, N m/rad (assumption: 1 degree under 50 N m).
const STOP_STIFFNESS_N_M_RAD: f64 = 3000.0;
/// Damping of a joint stop, N m s/rad (assumption).
const STOP_DAMPING_N_M_S_RAD: f64 = 30.0;

/// Positions and velocities, and the forces that the ground applied in the last step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct PlantMotion {
    pub(super) q: [f64; 9],
    pub(super) qd: [f64; 9],
    /// Normal force and friction of left heel, left toe, right heel and right toe, N.
    pub(super) ground: [[f64; 2]; 4],
}

impl PlantMotion {
    /// At rest in the air, or in contact without force yet.
    pub(super) fn new(q: [f64; 9], qd: [f64; 9]) -> Self {
        Self { q, qd, ground: [[0.0; 2]; 4] }
    }

    /// Normal force on a foot, N.
    pub(super) fn foot_load(&self, side: Side) -> f64 {
        let heel = match side {
            Side::Left => 0,
            Side::Right => 2,
        };
        self.ground[heel][0] + self.ground[heel + 1][0]
    }
}

/// Torques and forces during a step.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct AppliedTorques {
    /// hip_L, knee_L, ankle_L, hip_R, knee_R, ankle_R, N m.
    pub(super) torques: [f64; 6],
    /// Forward force on the hip, N.
    pub(super) push: f64,
}

/// A joint stop, which pushes back to one side.
#[derive(Debug, Clone, Copy)]
struct JointStop {
    coordinate: usize,
    /// 1 for a lower limit, -1 for an upper one.
    direction: f64,
    limit_rad: f64,
}

/// A contact point at the start of a step.
struct Touch {
    depth: f64,
    normal: Vector,
    tangent: Vector,
}

/// A walker on a terrain.
#[derive(Debug, Clone)]
pub(super) struct Plant<'a> {
    model: &'a WalkerModel,
    ground: Ground,
    terrain: &'a Terrain,
    points: [ContactPoint; 4],
    stops: [JointStop; 4],
}

impl<'a> Plant<'a> {
    /// The prosthetic ankle has the given range. Knees do not extend beyond straight (assumption for the device).
    pub(super) fn new(model: &'a WalkerModel, terrain: &'a Terrain, yield_m: f64, ankle_range_rad: (f64, f64)) -> Self {
        let point = |point, side| model.contact_point(point, side);
        let stop = |coordinate, direction, limit_rad| JointStop { coordinate, direction, limit_rad };
        Self {
            model,
            ground: Ground::under(model.total_mass, yield_m),
            terrain,
            points: [
                point(FootPoint::Heel, Side::Left),
                point(FootPoint::Toe, Side::Left),
                point(FootPoint::Heel, Side::Right),
                point(FootPoint::Toe, Side::Right),
            ],
            stops: [
                stop(4, 1.0, 0.0),
                stop(7, 1.0, 0.0),
                stop(8, 1.0, ankle_range_rad.0),
                stop(8, -1.0, ankle_range_rad.1),
            ],
        }
    }

    /// Height of the ground under the hip, m.
    pub(super) fn ground_height(&self, motion: &PlantMotion) -> f64 {
        self.terrain.at(motion.q[0]).0
    }

    /// The motion after a step of `duration_s`. `None` if it is not finite, or if no forces of the ground fit.
    pub(super) fn step(&self, motion: &PlantMotion, effort: &AppliedTorques, duration_s: f64) -> Option<PlantMotion> {
        self.step_or_halves(motion, effort, duration_s, HALVINGS)
    }

    fn step_or_halves(
        &self,
        motion: &PlantMotion,
        effort: &AppliedTorques,
        duration_s: f64,
        halvings: u32,
    ) -> Option<PlantMotion> {
        if let Some(next) = self.whole_step(motion, effort, duration_s) {
            return Some(next);
        }
        let rest = halvings.checked_sub(1)?;
        let middle = self.step_or_halves(motion, effort, 0.5 * duration_s, rest)?;
        self.step_or_halves(&middle, effort, 0.5 * duration_s, rest)
    }

    fn whole_step(&self, motion: &PlantMotion, effort: &AppliedTorques, h: f64) -> Option<PlantMotion> {
        let state = PointState::new(&motion.q, &motion.qd, &[0.0; 9]);
        let dynamics = InverseDynamics::new(self.model);
        let bias = dynamics.rows(&state);
        let mass_rows = dynamics.jacobian(&state).mass;
        let mass = SMatrix::<f64, 9, 9>::from_fn(|i, j| mass_rows[i][j]);
        let touches: [Touch; 4] = std::array::from_fn(|c| self.touch(&state, &self.points[c]));
        let mut smooth = -Vector::from(bias);
        smooth[0] += effort.push;
        for (i, torque) in effort.torques.iter().enumerate() {
            smooth[3 + i] += torque;
        }
        let before = Vector::from(motion.qd);
        // M (v - before) - h (smooth + stiff), of a velocity v at the end, N s.
        let residual = |v: &Vector| {
            let mut r = mass * (v - before) - smooth * h;
            for touch in &touches {
                let force = self.ground_force(touch, v, h);
                r -= (touch.normal * force.normal + touch.tangent * force.friction) * h;
            }
            for stop in &self.stops {
                r[stop.coordinate] -= h * stop.direction * stop.torque(&motion.q, v, h).0;
            }
            r
        };
        let mut v = before;
        let mut r = residual(&v);
        for _ in 0..ITERATIONS {
            let mut matrix = mass;
            for touch in &touches {
                let force = self.ground_force(touch, &v, h);
                if force.normal > 0.0 {
                    let normal = force.normal_by_depth * h + force.normal_by_depth_rate;
                    matrix += touch.normal * touch.normal.transpose() * (h * normal);
                    matrix -= touch.tangent * touch.tangent.transpose() * (h * force.friction_by_slip);
                    matrix += touch.tangent * touch.normal.transpose() * (h * force.friction_by_normal * normal);
                }
            }
            for stop in &self.stops {
                matrix[(stop.coordinate, stop.coordinate)] += h * stop.torque(&motion.q, &v, h).1;
            }
            let change = matrix.lu().solve(&-r)?;
            let mut fraction = 1.0;
            let (mut next, mut next_r) = (v + change, residual(&(v + change)));
            while next_r.norm() > r.norm() && fraction > MIN_NEWTON_FRACTION {
                fraction *= 0.5;
                next = v + change * fraction;
                next_r = residual(&next);
            }
            (v, r) = (next, next_r);
            if !v.iter().all(|value| value.is_finite()) {
                return None;
            }
            if change.amax() < CONVERGED {
                let mut ground = [[0.0; 2]; 4];
                for (touch, ground) in touches.iter().zip(&mut ground) {
                    let force = self.ground_force(touch, &v, h);
                    *ground = [force.normal, force.friction];
                }
                let qd: [f64; 9] = v.into();
                return Some(PlantMotion { q: std::array::from_fn(|i| motion.q[i] + h * qd[i]), qd, ground });
            }
        }
        None
    }

    fn touch(&self, state: &PointState, point: &ContactPoint) -> Touch {
        let [x, z] = state.contact_position(point);
        let (height, slope) = self.terrain.at(x);
        let mut per_link = [[0.0; LINKS]; 2];
        for (k, vector) in point.vectors.iter().enumerate() {
            let link = point.first_link + k;
            let rotated = state.rotated(link, vector);
            per_link[0][link] = -rotated[1];
            per_link[1][link] = rotated[0];
        }
        let gradient = |axis: usize| {
            let angles = to_generalised(&per_link[axis]);
            Vector::from_fn(|i, _| if i < 2 { f64::from(u8::from(i == axis)) } else { angles[i - 2] })
        };
        let (along, up) = (gradient(0), gradient(1));
        // To first order in the slope, which is at most 0.2.
        Touch { depth: height - z, normal: up - along * slope, tangent: along + up * slope }
    }

    fn ground_force(&self, touch: &Touch, v: &Vector, h: f64) -> GroundForce {
        let depth_rate = -touch.normal.dot(v);
        self.ground.force(touch.depth + h * depth_rate, depth_rate, touch.tangent.dot(v))
    }
}

impl JointStop {
    /// Torque away from the stop at the end of a step, and its derivative with respect to the velocity, both positive.
    fn torque(&self, q: &[f64; 9], v: &Vector, h: f64) -> (f64, f64) {
        let rate = self.direction * v[self.coordinate];
        let excess = self.direction * (self.limit_rad - q[self.coordinate]) - h * rate;
        let torque = STOP_STIFFNESS_N_M_RAD * excess - STOP_DAMPING_N_M_S_RAD * rate;
        if excess > 0.0 && torque > 0.0 {
            (torque, h * STOP_STIFFNESS_N_M_RAD + STOP_DAMPING_N_M_S_RAD)
        } else {
            (0.0, 0.0)
        }
    }
}
