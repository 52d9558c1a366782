//! A gait as one series of nodes over the stride, for tables and charts.

use gait_optimizer::Gait;
use gait_optimizer::body::{Axis, FootPoint, Side};

/// Ground force components: point, side, axis.
pub const FORCE_NAMES: [&str; 8] = [
    "heel_left_x",
    "heel_left_z",
    "toe_left_x",
    "toe_left_z",
    "heel_right_x",
    "heel_right_z",
    "toe_right_x",
    "toe_right_z",
];

/// Names of the ten muscles, in the order of the optimizer.
pub const MUSCLES: [&str; 10] =
    ["HAM_L", "GLU_L", "HFL_L", "GAS_L", "VAS_L", "SOL_L", "TA_L", "HAM_R", "GLU_R", "HFL_R"];

/// A node of a gait.
#[derive(Debug)]
pub struct Point<'a> {
    /// Time since right heel strike, s.
    pub time_s: f64,
    /// Name of the domain.
    pub domain: &'a str,
    /// Coordinates.
    pub q: &'a [f64; 9],
    /// Velocities.
    pub qd: &'a [f64; 9],
    /// Accelerations.
    pub qdd: &'a [f64; 9],
    /// Torques, N m.
    pub u: &'a [f64; 6],
    /// Ground forces in the order of [`FORCE_NAMES`], N.
    pub forces: [f64; 8],
    /// Activations.
    pub activation: Option<&'a [f64; 10]>,
    /// Fibre lengths over optimal lengths.
    pub fibre_length: Option<&'a [f64; 10]>,
}

/// The nodes of all domains, by time. The last node of a domain and the first one of the next have the same time,
/// because velocities and forces may jump there.
pub fn points(gait: &Gait) -> Vec<Point<'_>> {
    let mut points = Vec::new();
    for domain in &gait.domains {
        let motion = domain.q.iter().zip(&domain.qd).zip(&domain.qdd);
        let rows = motion.zip(&domain.u).zip(&domain.contact_forces);
        for (i, ((((q, qd), qdd), u), given)) in rows.enumerate() {
            let mut forces = [0.0; 8];
            for (name, value) in domain.contact_rows.iter().zip(given) {
                let side = if name.side == Side::Left { 0 } else { 4 };
                let point = if name.point == FootPoint::Heel { 0 } else { 2 };
                let axis = usize::from(name.axis == Axis::Z);
                forces[side + point + axis] = *value;
            }
            let muscles = domain.muscles.as_ref();
            let activation = muscles.and_then(|muscles| muscles.activation.get(i));
            let fibre_length = muscles.and_then(|muscles| muscles.fibre_length.get(i));
            let time_s = domain.time_s.get(i).copied().unwrap_or_default();
            points.push(Point { time_s, domain: &domain.name, q, qd, qdd, u, forces, activation, fibre_length });
        }
    }
    points
}
