//! The planar seven-link model of a subject with a prosthesis: segment parameters, kinematics, and inverse dynamics
//! with exact first and second derivatives.
//!
//! Coordinates `q = (px, pz, torso, hip_L, knee_L, ankle_L, hip_R, knee_R, ankle_R)`: hip point in m, relative joint
//! angles in rad (forward lean, flexion and dorsiflexion positive). Absolute link angles
//! `psi = (torso, thigh_L, shank_L, foot_L, thigh_R, shank_R, foot_R)` are counter-clockwise in the (x forward, z up)
//! plane: `psi = A q[2..]` with the constant matrix A of [`coordinates`].

pub mod anthropometry;
pub mod coordinates;
pub mod dynamics;
mod link_kinematics;
pub mod point;
mod sides_and_axes;

pub use anthropometry::{Body, WalkerModel};
pub use coordinates::{COORDINATES, JOINTS, LINKS, link_angles, to_generalised};
pub use dynamics::InverseDynamics;
pub use link_kinematics::PointState;
pub use point::{Chain, ContactPoint, LegGeometry};
pub use sides_and_axes::{Axis, FootPoint, Side};

/// Gravitational acceleration of the model, m/s².
pub const GRAVITY: f64 = 9.81;
