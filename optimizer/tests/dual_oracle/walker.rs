//! The walker from its definition: sums over seven bodies on chains of links.

use crate::{Scalar, constant};

pub(crate) const GRAVITY: f64 = 9.81;

/// (link, ux, uz): vectors in link frames from the hip outwards. Links: torso, thigh, shank, foot of the left leg,
/// thigh, shank, foot of the right leg.
pub(crate) type Chain = Vec<(usize, f64, f64)>;

/// Absolute angle of each link (rows) by torso, hip, knee, ankle left, hip, knee, ankle right: counter-clockwise
/// positive.
const LINK_ANGLES: [[f64; 7]; 7] = [
    [-1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
    [-1.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0],
    [-1.0, 1.0, -1.0, 0.0, 0.0, 0.0, 0.0],
    [-1.0, 1.0, -1.0, 1.0, 0.0, 0.0, 0.0],
    [-1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0],
    [-1.0, 0.0, 0.0, 0.0, 1.0, -1.0, 0.0],
    [-1.0, 0.0, 0.0, 0.0, 1.0, -1.0, 1.0],
];

pub(crate) struct Body {
    pub(crate) mass: f64,
    pub(crate) inertia: f64,
    pub(crate) com: Chain,
}

pub(crate) struct Leg {
    pub(crate) thigh: f64,
    pub(crate) shank: f64,
    pub(crate) ankle_height: f64,
    pub(crate) heel_behind: f64,
    pub(crate) toe_ahead: f64,
}

pub(crate) struct Walker {
    pub(crate) bodies: Vec<Body>,
    /// Left (intact), right (prosthesis).
    pub(crate) legs: [Leg; 2],
}

impl Walker {
    /// Winter's fractions of height and mass for the human segments, the AMPRO3 numbers for the right shank and foot.
    pub(crate) fn new(height: f64, mass: f64) -> Self {
        let left = Leg {
            thigh: 0.245 * height,
            shank: 0.246 * height,
            ankle_height: 0.039 * height,
            heel_behind: 0.0333 * height,
            toe_ahead: 0.0833 * height,
        };
        let right = Leg {
            thigh: 0.530 * height - 0.42,
            shank: 0.35,
            ankle_height: 0.070,
            heel_behind: 0.060,
            toe_ahead: 0.150,
        };
        let hat = 0.288 * height;
        let human = |mass: f64, length: f64, gyration: f64, com: Chain| Body {
            mass,
            inertia: mass * (gyration * length).powi(2),
            com,
        };
        let (d, h) = (left.toe_ahead, left.ankle_height);
        let left_foot_mass = 0.0145 * mass;
        let bodies = vec![
            human(0.678 * mass, hat, 0.496, vec![(0, 0.0, 0.626 * hat)]),
            human(0.100 * mass, left.thigh, 0.323, vec![(1, 0.0, -0.433 * left.thigh)]),
            human(0.0465 * mass, left.shank, 0.302, vec![(1, 0.0, -left.thigh), (2, 0.0, -0.433 * left.shank)]),
            Body {
                mass: left_foot_mass,
                inertia: left_foot_mass * 0.475 * 0.475 * (d * d + h * h),
                com: vec![(1, 0.0, -left.thigh), (2, 0.0, -left.shank), (3, 0.5 * d, -0.5 * h)],
            },
            right_thigh(height, mass, right.thigh),
            Body {
                mass: 3.85,
                inertia: 3.85 * (0.33_f64 * 0.35).powi(2),
                com: vec![(4, 0.0, -right.thigh), (5, 0.0, -0.45 * 0.35)],
            },
            Body {
                mass: 1.10,
                inertia: 0.0048,
                com: vec![(4, 0.0, -right.thigh), (5, 0.0, -right.shank), (6, 0.04, -0.04)],
            },
        ];
        Self { bodies, legs: [left, right] }
    }

    pub(crate) fn total_mass(&self) -> f64 {
        self.bodies.iter().map(|body| body.mass).sum()
    }

    /// Chain to a foot point: 0 heel_L, 1 toe_L, 2 heel_R, 3 toe_R.
    pub(crate) fn foot_point(&self, index: usize) -> Chain {
        let side = index / 2;
        let (leg, thigh) = (&self.legs[side], 1 + 3 * side);
        let forward = if index == 2 * side { -leg.heel_behind } else { leg.toe_ahead };
        vec![(thigh, 0.0, -leg.thigh), (thigh + 1, 0.0, -leg.shank), (thigh + 2, forward, -leg.ankle_height)]
    }

    /// Forward hip position over the stance toe, linearised, of any nine numbers (q, qd or qdd).
    pub(crate) fn hip_phase<D: Scalar>(&self, stance: usize, q: &[D; 9]) -> D {
        let (leg, thigh) = (&self.legs[stance], 1 + 3 * stance);
        let psi = links(q);
        -(psi[thigh + 1] * leg.shank + psi[thigh] * leg.thigh + psi[thigh + 2] * leg.ankle_height)
    }

    /// `M(q) qdd + h(q, qd)`, with h = gravity and centrifugal terms; body by body.
    pub(crate) fn inverse_dynamics<D: Scalar>(&self, state: &State<D>, gravity: f64) -> [D; 9] {
        let mut total = [constant::<D>(0.0); 9];
        for body in &self.bodies {
            let a = state.acceleration(&body.com);
            let force = [a[0] * body.mass, (a[1] + gravity) * body.mass];
            let link = body.com[body.com.len() - 1].0;
            let mut torque = [constant::<D>(0.0); 7];
            torque[link] = state.link_acceleration[link] * body.inertia;
            let by_force = state.generalised_force(&body.com, &force);
            let by_torque = generalised(&torque);
            for i in 0..9 {
                total[i] += by_force[i];
            }
            for i in 0..7 {
                total[2 + i] += by_torque[i];
            }
        }
        total
    }

    /// Kinetic and potential energy.
    pub(crate) fn energy<D: Scalar>(&self, state: &State<D>) -> [D; 2] {
        let (mut kinetic, mut potential) = (constant::<D>(0.0), constant::<D>(0.0));
        for body in &self.bodies {
            let v = state.velocity(&body.com);
            let rate = state.link_rate[body.com[body.com.len() - 1].0];
            kinetic += (v[0] * v[0] + v[1] * v[1]) * (0.5 * body.mass) + rate * rate * (0.5 * body.inertia);
            potential += state.position(&body.com)[1] * (body.mass * GRAVITY);
        }
        [kinetic, potential]
    }

    /// Linear momentum and angular momentum about the world's origin (counter-clockwise positive).
    pub(crate) fn momentum<D: Scalar>(&self, state: &State<D>) -> [D; 3] {
        let mut result = [constant::<D>(0.0); 3];
        for body in &self.bodies {
            let (p, v) = (state.position(&body.com), state.velocity(&body.com));
            let rate = state.link_rate[body.com[body.com.len() - 1].0];
            result[0] += v[0] * body.mass;
            result[1] += v[1] * body.mass;
            result[2] += (p[0] * v[1] - p[1] * v[0]) * body.mass + rate * body.inertia;
        }
        result
    }

    /// Centre of mass.
    pub(crate) fn centre_of_mass<D: Scalar>(&self, state: &State<D>) -> [D; 2] {
        let mut result = [constant::<D>(0.0); 2];
        for body in &self.bodies {
            let p = state.position(&body.com);
            result[0] += p[0] * (body.mass / self.total_mass());
            result[1] += p[1] * (body.mass / self.total_mass());
        }
        result
    }
}

/// The right thigh lumps human thigh, knee housing, adapter, and the subject's own shank and foot with
/// the knee bent.
fn right_thigh(height: f64, mass: f64, length: f64) -> Body {
    let own_thigh = 0.245 * height;
    let limb = 0.061 * mass;
    let parts = [
        (0.1 * mass, 0.0, -0.433 * own_thigh, 0.1 * mass * (0.323 * own_thigh).powi(2)),
        (1.0, 0.0, -length, 0.0016),
        (1.5, 0.0, -0.5 * (own_thigh + length), 1.5 * 0.12 * 0.12),
        (limb, -0.606 * 0.246 * height, -own_thigh, limb * (0.416 * 0.246 * height).powi(2)),
    ];
    let total: f64 = parts.iter().map(|part| part.0).sum();
    let x = parts.iter().map(|part| part.0 * part.1).sum::<f64>() / total;
    let z = parts.iter().map(|part| part.0 * part.2).sum::<f64>() / total;
    let inertia = parts.iter().map(|part| part.3 + part.0 * ((part.1 - x).powi(2) + (part.2 - z).powi(2))).sum();
    Body { mass: total, inertia, com: vec![(4, x, z)] }
}

/// Link angles (or rates, or accelerations) of nine coordinates.
fn links<D: Scalar>(q: &[D; 9]) -> [D; 7] {
    std::array::from_fn(|link| {
        let mut sum = constant::<D>(0.0);
        for i in 0..7 {
            sum += q[2 + i] * LINK_ANGLES[link][i];
        }
        sum
    })
}

/// Joint-space components of torques about the links' absolute angles.
fn generalised<D: Scalar>(torque: &[D; 7]) -> [D; 7] {
    std::array::from_fn(|i| {
        let mut sum = constant::<D>(0.0);
        for link in 0..7 {
            sum += torque[link] * LINK_ANGLES[link][i];
        }
        sum
    })
}

/// Position, velocity and acceleration of all links.
pub(crate) struct State<D> {
    base: [[D; 2]; 3],
    cos: [D; 7],
    sin: [D; 7],
    pub(crate) link_rate: [D; 7],
    pub(crate) link_acceleration: [D; 7],
}

impl<D: Scalar> State<D> {
    pub(crate) fn new(q: &[D; 9], qd: &[D; 9], qdd: &[D; 9]) -> Self {
        let psi = links(q);
        Self {
            base: [[q[0], q[1]], [qd[0], qd[1]], [qdd[0], qdd[1]]],
            cos: psi.map(|angle| angle.cos()),
            sin: psi.map(|angle| angle.sin()),
            link_rate: links(qd),
            link_acceleration: links(qdd),
        }
    }

    /// R(psi) u of a chain element, and its derivative by psi.
    fn turned(&self, (link, ux, uz): (usize, f64, f64)) -> ([D; 2], [D; 2]) {
        let (c, s) = (self.cos[link], self.sin[link]);
        ([c * ux - s * uz, s * ux + c * uz], [-(s * ux) - c * uz, c * ux - s * uz])
    }

    pub(crate) fn position(&self, chain: &Chain) -> [D; 2] {
        let mut p = self.base[0];
        for &element in chain {
            let (along, _) = self.turned(element);
            p[0] += along[0];
            p[1] += along[1];
        }
        p
    }

    pub(crate) fn velocity(&self, chain: &Chain) -> [D; 2] {
        let mut v = self.base[1];
        for &element in chain {
            let (_, across) = self.turned(element);
            v[0] += across[0] * self.link_rate[element.0];
            v[1] += across[1] * self.link_rate[element.0];
        }
        v
    }

    pub(crate) fn acceleration(&self, chain: &Chain) -> [D; 2] {
        let mut a = self.base[2];
        for &element in chain {
            let (along, across) = self.turned(element);
            let (rate, acceleration) = (self.link_rate[element.0], self.link_acceleration[element.0]);
            a[0] += across[0] * acceleration - along[0] * rate * rate;
            a[1] += across[1] * acceleration - along[1] * rate * rate;
        }
        a
    }

    /// Generalised force of a force at the end of a chain: J^T f.
    pub(crate) fn generalised_force(&self, chain: &Chain, force: &[D; 2]) -> [D; 9] {
        let mut torque = [constant::<D>(0.0); 7];
        for &element in chain {
            let (_, across) = self.turned(element);
            torque[element.0] += force[0] * across[0] + force[1] * across[1];
        }
        let joints = generalised(&torque);
        std::array::from_fn(|i| if i < 2 { force[i] } else { joints[i - 2] })
    }
}
