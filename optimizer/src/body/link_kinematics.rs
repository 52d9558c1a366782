//! Kinematics of the links in absolute angles: positions, velocities and accelerations of links and contact points.

use super::coordinates::{LINKS, link_angles};
use super::point::{ContactPoint, angles_of};

/// Positions, velocities and accelerations at one instant, in link space.
#[derive(Debug, Clone, Copy)]
pub struct PointState {
    /// Cosine of each link angle.
    pub cos: [f64; LINKS],
    /// Sine of each link angle.
    pub sin: [f64; LINKS],
    /// Link rates, rad/s.
    pub rate: [f64; LINKS],
    /// Link accelerations, rad/s².
    pub acceleration: [f64; LINKS],
    /// Position of the hip point, m.
    pub base: [f64; 2],
    /// Velocity of the hip point, m/s.
    pub base_rate: [f64; 2],
    /// Acceleration of the hip point, m/s², without gravity.
    pub base_acceleration: [f64; 2],
}

impl PointState {
    /// From generalised coordinates, velocities and accelerations.
    #[inline]
    pub fn new(q: &[f64; 9], qd: &[f64; 9], qdd: &[f64; 9]) -> Self {
        let psi = link_angles(&angles_of(q));
        let mut cos = [0.0; LINKS];
        let mut sin = [0.0; LINKS];
        for j in 0..LINKS {
            (sin[j], cos[j]) = psi[j].sin_cos();
        }
        Self {
            cos,
            sin,
            rate: link_angles(&angles_of(qd)),
            acceleration: link_angles(&angles_of(qdd)),
            base: [q[0], q[1]],
            base_rate: [qd[0], qd[1]],
            base_acceleration: [qdd[0], qdd[1]],
        }
    }

    /// A vector of a link in the world frame: `R(psi_link) u`.
    #[inline]
    pub fn rotated(&self, link: usize, u: &[f64; 2]) -> [f64; 2] {
        let (c, s) = (self.cos[link], self.sin[link]);
        [c * u[0] - s * u[1], s * u[0] + c * u[1]]
    }

    /// Position of a contact point, m.
    #[inline]
    pub fn contact_position(&self, point: &ContactPoint) -> [f64; 2] {
        let mut p = self.base;
        for (k, u) in point.vectors.iter().enumerate() {
            let a = self.rotated(point.first_link + k, u);
            p[0] += a[0];
            p[1] += a[1];
        }
        p
    }

    /// Velocity of a contact point, m/s.
    #[inline]
    pub fn contact_velocity(&self, point: &ContactPoint) -> [f64; 2] {
        let mut v = self.base_rate;
        for (k, u) in point.vectors.iter().enumerate() {
            let link = point.first_link + k;
            let a = self.rotated(link, u);
            v[0] -= self.rate[link] * a[1];
            v[1] += self.rate[link] * a[0];
        }
        v
    }

    /// Acceleration of a contact point, m/s².
    #[inline]
    pub fn contact_acceleration(&self, point: &ContactPoint) -> [f64; 2] {
        let mut acceleration = self.base_acceleration;
        for (k, u) in point.vectors.iter().enumerate() {
            let link = point.first_link + k;
            let a = self.rotated(link, u);
            let squared = self.rate[link] * self.rate[link];
            acceleration[0] += -self.acceleration[link] * a[1] - squared * a[0];
            acceleration[1] += self.acceleration[link] * a[0] - squared * a[1];
        }
        acceleration
    }
}
