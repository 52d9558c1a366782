//! Points fixed to links, and the contact points of the feet: position, velocity and acceleration.

use super::coordinates::{LINKS, THIGH_L, THIGH_R, link_angles};
use super::sides_and_axes::{FootPoint, Side};

/// A point as a chain of vectors fixed to links: `p = (px, pz) + sum_j R(psi_j) (ux_j, uz_j)`.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Chain {
    /// Link and its vector (ux, uz) in the frame of the link, m.
    pub segments: Vec<(usize, f64, f64)>,
}

impl Chain {
    /// Position of the point, m.
    pub fn position(&self, q: &[f64; 9]) -> [f64; 2] {
        let psi = link_angles(&angles_of(q));
        let mut p = [q[0], q[1]];
        for &(link, ux, uz) in &self.segments {
            let (s, c) = psi[link].sin_cos();
            p[0] += c * ux - s * uz;
            p[1] += s * ux + c * uz;
        }
        p
    }

    /// Velocity of the point, m/s.
    pub fn velocity(&self, q: &[f64; 9], qd: &[f64; 9]) -> [f64; 2] {
        let psi = link_angles(&angles_of(q));
        let rate = link_angles(&angles_of(qd));
        let mut v = [qd[0], qd[1]];
        for &(link, ux, uz) in &self.segments {
            let (s, c) = psi[link].sin_cos();
            v[0] += rate[link] * (-s * ux - c * uz);
            v[1] += rate[link] * (c * ux - s * uz);
        }
        v
    }

    /// Jacobian of the position with respect to q: rows x and z; m/rad for the angles.
    pub fn jacobian(&self, q: &[f64; 9]) -> [[f64; 9]; 2] {
        let psi = link_angles(&angles_of(q));
        let mut per_link = [[0.0; LINKS]; 2];
        for &(link, ux, uz) in &self.segments {
            let (s, c) = psi[link].sin_cos();
            per_link[0][link] += -s * ux - c * uz;
            per_link[1][link] += c * ux - s * uz;
        }
        let mut jacobian = [[0.0; 9]; 2];
        for axis in 0..2 {
            jacobian[axis][axis] = 1.0;
            jacobian[axis][2..].copy_from_slice(&super::coordinates::to_generalised(&per_link[axis]));
        }
        jacobian
    }
}

/// The seven angles of a coordinate vector.
#[inline]
pub fn angles_of(q: &[f64; 9]) -> [f64; LINKS] {
    [q[2], q[3], q[4], q[5], q[6], q[7], q[8]]
}

/// Lengths of one leg, m.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LegGeometry {
    /// Distance from hip to knee.
    pub thigh_length_m: f64,
    /// Distance from knee to ankle.
    pub shank_length_m: f64,
    /// Height of the ankle above the sole.
    pub ankle_height_m: f64,
    /// Distance of the heel behind the ankle.
    pub heel_behind_m: f64,
    /// Distance of the toe ahead of the ankle.
    pub toe_ahead_m: f64,
}

/// A contact point: heel or toe of one leg, with its vector on each link of the leg.
#[derive(Debug, Clone, PartialEq)]
pub struct ContactPoint {
    /// Heel or toe.
    pub point: FootPoint,
    /// Which foot.
    pub side: Side,
    /// Index of the thigh link of that leg; shank and foot follow.
    pub first_link: usize,
    /// Vectors on thigh, shank and foot, metres.
    pub vectors: [[f64; 2]; 3],
}

impl ContactPoint {
    /// The contact point of a leg.
    pub fn new(point: FootPoint, side: Side, leg: &LegGeometry) -> Self {
        let ux = match point {
            FootPoint::Heel => -leg.heel_behind_m,
            FootPoint::Toe => leg.toe_ahead_m,
        };
        Self {
            point,
            side,
            first_link: first_link(side),
            vectors: [[0.0, -leg.thigh_length_m], [0.0, -leg.shank_length_m], [ux, -leg.ankle_height_m]],
        }
    }

    /// The point as a chain.
    pub fn chain(&self) -> Chain {
        Chain { segments: (0..3).map(|k| (self.first_link + k, self.vectors[k][0], self.vectors[k][1])).collect() }
    }
}

/// Index of the thigh link of a leg; shank and foot follow.
pub fn first_link(side: Side) -> usize {
    match side {
        Side::Left => THIGH_L,
        Side::Right => THIGH_R,
    }
}
