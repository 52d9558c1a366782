//! Segment parameters: Winter's fractions for the human segments, the device file for the prosthesis.
//!
//! Winter, Biomechanics and Motor Control of Human Movement, 4th ed. 2009, tables 4.1 and figure 4.1 (masses and
//! gyration radii as fractions of body mass and segment length, lengths as fractions of height).

use super::coordinates::{LINKS, THIGH_L, THIGH_R, TORSO};
use super::point::{Chain, ContactPoint, LegGeometry};
use super::sides_and_axes::{FootPoint, Side};
use crate::device::Device;
use crate::model_error::ModelError;
use crate::subject::Subject;

/// Thigh length / height.
const THIGH_LENGTH: f64 = 0.245;
/// Shank length / height.
const SHANK_LENGTH: f64 = 0.246;
/// Hip height / height in upright standing.
const HIP_HEIGHT: f64 = 0.530;
/// Length of head, arms and trunk (hip to shoulder) / height.
const HAT_LENGTH: f64 = 0.288;
/// Ankle height / height.
const ANKLE_HEIGHT: f64 = 0.039;
/// Distance of the heel contact behind the ankle / height (0.060 m at 1.80 m, as in the model gait2d).
const HEEL_BEHIND: f64 = 0.0333;
/// Distance of the toe contact ahead of the ankle / height (0.150 m at 1.80 m, as in the model gait2d).
const TOE_AHEAD: f64 = 0.0833;

/// A rigid body.
#[derive(Debug, Clone, PartialEq)]
pub struct Body {
    /// Name of the link, and of the part if a link has several bodies.
    pub name: &'static str,
    /// kg.
    pub mass: f64,
    /// Moment of inertia about the centre of mass, kg m².
    pub inertia: f64,
    /// Chain from the hip to the centre of mass. The body rotates with the last link of the chain.
    pub com: Chain,
}

/// The walker: bodies, legs, and the constant coefficients of the equations of motion.
#[derive(Debug, Clone, PartialEq)]
pub struct WalkerModel {
    /// The seven bodies, in link order.
    pub bodies: Vec<Body>,
    /// Intact leg.
    pub left: LegGeometry,
    /// Prosthetic leg.
    pub right: LegGeometry,
    /// Distance from hip to shoulder, m; for drawings only.
    pub torso_length_m: f64,
    /// kg.
    pub total_mass: f64,
    /// For each link, the first mass moment of all masses that it carries, in its frame, kg m: `sum m u_j`.
    pub first_moment: [[f64; 2]; LINKS],
    /// For each link, the moment of inertia of all masses that it carries about its origin, kg m².
    pub link_inertia: [f64; LINKS],
    /// Couplings of the pairs of links that carry a common mass.
    pub pairs: Vec<LinkPair>,
}

/// Coupling of two links i < j of one leg: `cosine = sum m u_i . u_j`, `sine = sum m u_i . (J u_j)`, kg m², with J the
/// quarter turn (ux, uz) -> (-uz, ux).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LinkPair {
    /// Upper link.
    pub i: usize,
    /// Lower link.
    pub j: usize,
    /// Coefficient of cos(psi_j - psi_i).
    pub cosine: f64,
    /// Coefficient of sin(psi_j - psi_i).
    pub sine: f64,
}

impl WalkerModel {
    /// The walker of a subject with a device on the right leg.
    ///
    /// # Errors
    /// [`ModelError`] if a number is out of range or the device is too tall for the subject.
    pub fn new(subject: &Subject, device: &Device) -> Result<Self, ModelError> {
        subject.validate()?;
        device.validate()?;
        let (height, mass) = (subject.height_m, subject.body_mass_kg);
        let left = LegGeometry {
            thigh_length_m: THIGH_LENGTH * height,
            shank_length_m: SHANK_LENGTH * height,
            ankle_height_m: ANKLE_HEIGHT * height,
            heel_behind_m: HEEL_BEHIND * height,
            toe_ahead_m: TOE_AHEAD * height,
        };
        let right = LegGeometry {
            thigh_length_m: HIP_HEIGHT * height - device.shank_length_m - device.ankle_height_m,
            shank_length_m: device.shank_length_m,
            ankle_height_m: device.ankle_height_m,
            heel_behind_m: device.heel_behind_m,
            toe_ahead_m: device.toe_ahead_m,
        };
        // The prosthetic thigh link must reach the human knee at least.
        ModelError::check_range("prosthetic thigh length (m)", right.thigh_length_m, 0.2, 1.0)?;

        let hat_length = HAT_LENGTH * height;
        let mut bodies = vec![Body {
            name: "torso",
            mass: 0.678 * mass,
            inertia: 0.678 * mass * (0.496 * hat_length).powi(2),
            com: Chain { segments: vec![(TORSO, 0.0, 0.626 * hat_length)] },
        }];
        bodies.extend(human_leg(mass, &left));
        bodies.extend(prosthetic_leg(subject, device, &right));
        Ok(Self::from_bodies(bodies, left, right, hat_length))
    }

    fn from_bodies(bodies: Vec<Body>, left: LegGeometry, right: LegGeometry, torso_length_m: f64) -> Self {
        let total_mass = bodies.iter().map(|b| b.mass).sum();
        let mut first_moment = [[0.0; 2]; LINKS];
        let mut link_inertia = [0.0; LINKS];
        let mut pairs: Vec<LinkPair> = Vec::new();
        for body in &bodies {
            for (k, &(i, ux, uz)) in body.com.segments.iter().enumerate() {
                first_moment[i][0] += body.mass * ux;
                first_moment[i][1] += body.mass * uz;
                link_inertia[i] += body.mass * (ux * ux + uz * uz);
                for &(j, vx, vz) in &body.com.segments[k + 1..] {
                    let cosine = body.mass * (ux * vx + uz * vz);
                    let sine = body.mass * (-ux * vz + uz * vx);
                    match pairs.iter_mut().find(|p| p.i == i && p.j == j) {
                        Some(pair) => {
                            pair.cosine += cosine;
                            pair.sine += sine;
                        }
                        None => pairs.push(LinkPair { i, j, cosine, sine }),
                    }
                }
            }
            if let Some(&(last, _, _)) = body.com.segments.last() {
                link_inertia[last] += body.inertia;
            }
        }
        Self { bodies, left, right, torso_length_m, total_mass, first_moment, link_inertia, pairs }
    }

    /// Geometry of a leg.
    pub fn leg(&self, side: Side) -> &LegGeometry {
        match side {
            Side::Left => &self.left,
            Side::Right => &self.right,
        }
    }

    /// A contact point of a foot.
    pub fn contact_point(&self, point: FootPoint, side: Side) -> ContactPoint {
        ContactPoint::new(point, side, self.leg(side))
    }
}

fn human_leg(mass: f64, leg: &LegGeometry) -> [Body; 3] {
    let (thigh, shank) = (leg.thigh_length_m, leg.shank_length_m);
    let (height, toe) = (leg.ankle_height_m, leg.toe_ahead_m);
    let to_knee = (THIGH_L, 0.0, -thigh);
    let to_ankle = (THIGH_L + 1, 0.0, -shank);
    [
        Body {
            name: "thigh_L",
            mass: 0.100 * mass,
            inertia: 0.100 * mass * (0.323 * thigh).powi(2),
            com: Chain { segments: vec![(THIGH_L, 0.0, -0.433 * thigh)] },
        },
        Body {
            name: "shank_L",
            mass: 0.0465 * mass,
            inertia: 0.0465 * mass * (0.302 * shank).powi(2),
            com: Chain { segments: vec![to_knee, (THIGH_L + 1, 0.0, -0.433 * shank)] },
        },
        Body {
            name: "foot_L",
            mass: 0.0145 * mass,
            inertia: 0.0145 * mass * 0.475_f64.powi(2) * (toe * toe + height * height),
            com: Chain { segments: vec![to_knee, to_ankle, (THIGH_L + 2, 0.5 * toe, -0.5 * height)] },
        },
    ]
}

/// The right thigh link: human thigh, knee housing, adapter and, if `carried_limb`, the subject's own shank and
/// foot with the knee bent, lumped into one body.
fn prosthetic_leg(subject: &Subject, device: &Device, leg: &LegGeometry) -> [Body; 3] {
    let (height, mass) = (subject.height_m, subject.body_mass_kg);
    let human_thigh = THIGH_LENGTH * height;
    let human_shank = SHANK_LENGTH * height;
    let thigh = leg.thigh_length_m;
    // Mass, x and z in the frame of the thigh, moment of inertia about its own centre.
    let mut parts = vec![
        (0.100 * mass, 0.0, -0.433 * human_thigh, 0.100 * mass * (0.323 * human_thigh).powi(2)),
        (device.knee_housing_mass_kg, 0.0, -thigh, device.knee_housing_inertia_kg_m2),
        (
            device.adapter_mass_kg,
            0.0,
            -0.5 * (human_thigh + thigh),
            device.adapter_mass_kg * device.adapter_gyration_radius_m.powi(2),
        ),
    ];
    if device.carried_limb {
        let limb = 0.061 * mass;
        parts.push((limb, -0.606 * human_shank, -human_thigh, limb * (0.416 * human_shank).powi(2)));
    }
    let lump: f64 = parts.iter().map(|p| p.0).sum();
    let x = parts.iter().map(|p| p.0 * p.1).sum::<f64>() / lump;
    let z = parts.iter().map(|p| p.0 * p.2).sum::<f64>() / lump;
    let inertia = parts.iter().map(|p| p.3 + p.0 * ((p.1 - x).powi(2) + (p.2 - z).powi(2))).sum();
    let shank = device.shank_length_m;
    let to_knee = (THIGH_R, 0.0, -thigh);
    [
        Body { name: "thigh_R", mass: lump, inertia, com: Chain { segments: vec![(THIGH_R, x, z)] } },
        Body {
            name: "shank_R",
            mass: device.shank_mass_kg,
            inertia: device.shank_mass_kg * (device.shank_gyration_fraction * shank).powi(2),
            com: Chain { segments: vec![to_knee, (THIGH_R + 1, 0.0, -device.shank_com_fraction * shank)] },
        },
        Body {
            name: "foot_R",
            mass: device.foot_mass_kg,
            inertia: device.foot_inertia_kg_m2,
            com: Chain {
                segments: vec![
                    to_knee,
                    (THIGH_R + 1, 0.0, -shank),
                    (THIGH_R + 2, device.foot_com_forward_m, -device.foot_com_down_m),
                ],
            },
        },
    ]
}
