//! Inverse dynamics `M(q) qdd + h(q, qd)` with exact first and second derivatives, in link space.
//!
//! In absolute link angles, each term of the equations of motion belongs to one link or to one pair of links with a
//! constant coefficient. All derivatives are therefore closed forms in the sines and cosines of link angles and of
//! their differences. `A^T ( ) A` transforms them to generalised coordinates.

use super::GRAVITY;
use super::anthropometry::WalkerModel;
use super::coordinates::{LINKS, congruence, link_angles, to_generalised, transform_rows};
use super::link_kinematics::PointState;
use super::point::angles_of;

/// First derivatives of the inverse dynamics in generalised coordinates.
#[derive(Debug, Clone, Copy)]
pub struct DynamicsJacobian {
    /// d(row)/d(angle): nine rows, seven angles.
    pub angle: [[f64; LINKS]; 9],
    /// d(row)/d(angle rate).
    pub rate: [[f64; LINKS]; 9],
    /// d(row)/d(acceleration) = M(q), for all nine accelerations.
    pub mass: [[f64; 9]; 9],
}

/// Second derivatives of a sum of rows weighted by multipliers, in link space. Elements add to it;
/// [`LinkHessian::generalised`] transforms it to generalised coordinates.
#[derive(Debug, Clone, Copy, Default)]
pub struct LinkHessian {
    /// Angle by angle.
    pub angle_angle: [[f64; LINKS]; LINKS],
    /// Angle (row) by rate (column).
    pub angle_rate: [[f64; LINKS]; LINKS],
    /// Rate by rate.
    pub rate_rate: [[f64; LINKS]; LINKS],
    /// Angle (row) by acceleration of the hip point (column x, z).
    pub angle_base: [[f64; 2]; LINKS],
    /// Angle (row) by link acceleration (column).
    pub angle_acceleration: [[f64; LINKS]; LINKS],
}

/// [`LinkHessian`] in generalised coordinates (seven angles each).
#[derive(Debug, Clone, Copy)]
pub struct GeneralisedHessian {
    /// Angle by angle.
    pub angle_angle: [[f64; LINKS]; LINKS],
    /// Angle by rate.
    pub angle_rate: [[f64; LINKS]; LINKS],
    /// Rate by rate.
    pub rate_rate: [[f64; LINKS]; LINKS],
    /// Angle by acceleration of the hip point.
    pub angle_base: [[f64; 2]; LINKS],
    /// Angle by angular acceleration.
    pub angle_acceleration: [[f64; LINKS]; LINKS],
}

impl LinkHessian {
    /// Transforms to generalised coordinates.
    #[inline]
    pub fn generalised(&self) -> GeneralisedHessian {
        GeneralisedHessian {
            angle_angle: congruence(&self.angle_angle),
            angle_rate: congruence(&self.angle_rate),
            rate_rate: congruence(&self.rate_rate),
            angle_base: transform_rows(&self.angle_base),
            angle_acceleration: congruence(&self.angle_acceleration),
        }
    }
}

/// The inverse dynamics `M(q) qdd + h(q, qd)` of a walker. With zero gravity and zero rates it gives the change of
/// momentum `M(q) dv` in an impact.
#[derive(Debug, Clone, Copy)]
pub struct InverseDynamics<'a> {
    /// The walker.
    pub model: &'a WalkerModel,
    /// Gravity, m/s².
    pub gravity: f64,
}

impl<'a> InverseDynamics<'a> {
    /// With standard gravity.
    pub fn new(model: &'a WalkerModel) -> Self {
        Self { model, gravity: GRAVITY }
    }

    /// Without gravity, for impacts.
    pub fn without_gravity(model: &'a WalkerModel) -> Self {
        Self { model, gravity: 0.0 }
    }

    /// The nine generalised forces, N and N m.
    #[inline]
    pub fn rows(&self, state: &PointState) -> [f64; 9] {
        let model = self.model;
        let acc = [state.base_acceleration[0], state.base_acceleration[1] + self.gravity];
        let mut base = [model.total_mass * acc[0], model.total_mass * acc[1]];
        let mut link = [0.0; LINKS];
        for j in 0..LINKS {
            let a = state.rotated(j, &model.first_moment[j]);
            let squared = state.rate[j] * state.rate[j];
            base[0] += -state.acceleration[j] * a[1] - squared * a[0];
            base[1] += state.acceleration[j] * a[0] - squared * a[1];
            link[j] = model.link_inertia[j] * state.acceleration[j] - a[1] * acc[0] + a[0] * acc[1];
        }
        for pair in &model.pairs {
            let (i, j) = (pair.i, pair.j);
            let (p, q) = pair_terms(state, pair.i, pair.j, pair.cosine, pair.sine);
            link[i] += p * state.acceleration[j] + q * state.rate[j] * state.rate[j];
            link[j] += p * state.acceleration[i] - q * state.rate[i] * state.rate[i];
        }
        assemble_rows(base, &link)
    }

    /// First derivatives of [`Self::rows`].
    #[inline]
    pub fn jacobian(&self, state: &PointState) -> DynamicsJacobian {
        let model = self.model;
        let acc = [state.base_acceleration[0], state.base_acceleration[1] + self.gravity];
        let mut base_angle = [[0.0; LINKS]; 2];
        let mut base_rate = [[0.0; LINKS]; 2];
        let mut base_link = [[0.0; LINKS]; 2];
        let mut link_angle = [[0.0; LINKS]; LINKS];
        let mut link_rate = [[0.0; LINKS]; LINKS];
        let mut link_mass = [[0.0; LINKS]; LINKS];
        for j in 0..LINKS {
            let a = state.rotated(j, &model.first_moment[j]);
            let t = [-a[1], a[0]];
            let squared = state.rate[j] * state.rate[j];
            for axis in 0..2 {
                base_angle[axis][j] = -state.acceleration[j] * a[axis] - squared * t[axis];
                base_rate[axis][j] = -2.0 * state.rate[j] * a[axis];
                base_link[axis][j] = t[axis];
            }
            link_angle[j][j] = -(a[0] * acc[0] + a[1] * acc[1]);
            link_mass[j][j] = model.link_inertia[j];
        }
        for pair in &model.pairs {
            let (i, j) = (pair.i, pair.j);
            let (p, q) = pair_terms(state, i, j, pair.cosine, pair.sine);
            let di = q * state.acceleration[j] - p * state.rate[j] * state.rate[j];
            let dj = q * state.acceleration[i] + p * state.rate[i] * state.rate[i];
            link_angle[i][j] += di;
            link_angle[i][i] -= di;
            link_angle[j][j] += dj;
            link_angle[j][i] -= dj;
            link_rate[i][j] += 2.0 * q * state.rate[j];
            link_rate[j][i] -= 2.0 * q * state.rate[i];
            link_mass[i][j] += p;
            link_mass[j][i] += p;
        }
        let mut result = DynamicsJacobian { angle: [[0.0; LINKS]; 9], rate: [[0.0; LINKS]; 9], mass: [[0.0; 9]; 9] };
        for axis in 0..2 {
            result.angle[axis] = to_generalised(&base_angle[axis]);
            result.rate[axis] = to_generalised(&base_rate[axis]);
            let coupling = to_generalised(&base_link[axis]);
            result.mass[axis][axis] = model.total_mass;
            for j in 0..LINKS {
                result.mass[axis][2 + j] = coupling[j];
                result.mass[2 + j][axis] = coupling[j];
            }
        }
        let angle = congruence(&link_angle);
        let rate = congruence(&link_rate);
        let mass = congruence(&link_mass);
        for i in 0..LINKS {
            result.angle[2 + i] = angle[i];
            result.rate[2 + i] = rate[i];
            result.mass[2 + i][2..].copy_from_slice(&mass[i]);
        }
        result
    }

    /// Adds the second derivatives of `multipliers . rows` to `hessian`; one multiplier for each row.
    #[inline]
    pub fn add_hessian(&self, state: &PointState, multipliers: &[f64; 9], hessian: &mut LinkHessian) {
        let model = self.model;
        let acc = [state.base_acceleration[0], state.base_acceleration[1] + self.gravity];
        let base = [multipliers[0], multipliers[1]];
        // (A^T r) . mu = r . (A mu)
        let link = link_angles(&angles_of(multipliers));
        for j in 0..LINKS {
            let a = state.rotated(j, &model.first_moment[j]);
            let along = base[0] * a[0] + base[1] * a[1];
            let across = -base[0] * a[1] + base[1] * a[0];
            let (rate, acceleration) = (state.rate[j], state.acceleration[j]);
            hessian.angle_angle[j][j] +=
                -acceleration * across + rate * rate * along - link[j] * (-a[1] * acc[0] + a[0] * acc[1]);
            hessian.angle_rate[j][j] -= 2.0 * rate * across;
            hessian.rate_rate[j][j] -= 2.0 * along;
            hessian.angle_acceleration[j][j] -= along;
            hessian.angle_base[j][0] -= link[j] * a[0];
            hessian.angle_base[j][1] -= link[j] * a[1];
        }
        for pair in &model.pairs {
            let (i, j) = (pair.i, pair.j);
            let (p, q) = pair_terms(state, i, j, pair.cosine, pair.sine);
            let x = link[i] * state.acceleration[j] + link[j] * state.acceleration[i];
            let y = link[i] * state.rate[j] * state.rate[j] - link[j] * state.rate[i] * state.rate[i];
            let second = -p * x - q * y;
            hessian.angle_angle[i][i] += second;
            hessian.angle_angle[j][j] += second;
            hessian.angle_angle[i][j] -= second;
            hessian.angle_angle[j][i] -= second;
            let by_rate_j = -2.0 * p * link[i] * state.rate[j];
            let by_rate_i = 2.0 * p * link[j] * state.rate[i];
            hessian.angle_rate[j][j] += by_rate_j;
            hessian.angle_rate[i][j] -= by_rate_j;
            hessian.angle_rate[j][i] += by_rate_i;
            hessian.angle_rate[i][i] -= by_rate_i;
            hessian.rate_rate[j][j] += 2.0 * q * link[i];
            hessian.rate_rate[i][i] -= 2.0 * q * link[j];
            hessian.angle_acceleration[j][j] += q * link[i];
            hessian.angle_acceleration[i][j] -= q * link[i];
            hessian.angle_acceleration[j][i] += q * link[j];
            hessian.angle_acceleration[i][i] -= q * link[j];
        }
    }

    /// Mass matrix M(q): kg, kg m and kg m².
    pub fn mass_matrix(&self, q: &[f64; 9]) -> [[f64; 9]; 9] {
        self.jacobian(&PointState::new(q, &[0.0; 9], &[0.0; 9])).mass
    }
}

/// `P = C cos d + D sin d` and its derivative `Q = D cos d - C sin d` for d = psi_j - psi_i.
#[inline]
fn pair_terms(state: &PointState, i: usize, j: usize, cosine: f64, sine: f64) -> (f64, f64) {
    let c = state.cos[j] * state.cos[i] + state.sin[j] * state.sin[i];
    let s = state.sin[j] * state.cos[i] - state.cos[j] * state.sin[i];
    (cosine * c + sine * s, sine * c - cosine * s)
}

#[inline]
fn assemble_rows(base: [f64; 2], link: &[f64; LINKS]) -> [f64; 9] {
    let general = to_generalised(link);
    let mut rows = [0.0; 9];
    rows[..2].copy_from_slice(&base);
    rows[2..].copy_from_slice(&general);
    rows
}
