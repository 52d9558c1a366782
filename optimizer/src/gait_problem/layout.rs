//! Index and scale of each variable of the gait problem.
//!
//! The nodes of all domains come first (domain by domain, node by node), then four v_hip, then x_L and D, then for each
//! domain the duration T, the phase limits, the Bezier coefficients (column-major) and the impulse. Variables are
//! stored divided by their scale.

use super::row_names::COORDINATE_NAMES;
use crate::body::{COORDINATES, JOINTS};
use crate::muscle::MUSCLE_COUNT;
use crate::quadrature::simpson;
use crate::settings::Mesh;
use crate::walking::{BEZIER_COEFFICIENTS, CYCLE, Domain, DomainKind};

/// Largest number of contact rows of a domain.
pub const MAX_CONTACTS: usize = 5;
/// Largest number of outputs of a domain.
pub const MAX_OUTPUTS: usize = 6;

/// Offset of the coordinates in the variables of a node.
pub const Q: usize = 0;
/// Offset of the velocities.
pub const QD: usize = COORDINATES;
/// Offset of the accelerations.
pub const QDD: usize = 2 * COORDINATES;
/// Offset of the torques.
pub const U: usize = 3 * COORDINATES;
/// Offset of the contact forces.
pub const FORCE: usize = U + JOINTS;

const SCALE_QD: f64 = 3.0;
const SCALE_QDD: f64 = 30.0;
const SCALE_U: f64 = 100.0;
const SCALE_FORCE: f64 = 500.0;
const SCALE_FIBRE_VELOCITY: f64 = 3.0;
const SCALE_DURATION: f64 = 0.2;
const SCALE_IMPULSE: f64 = 20.0;

/// Indices of the variables of a domain.
#[derive(Debug, Clone, PartialEq)]
pub struct DomainLayout {
    /// The domain.
    pub domain: Domain,
    /// Number of mesh intervals N.
    pub intervals: usize,
    /// Number of nodes K = 2N + 1.
    pub points: usize,
    /// First variable of the first node.
    pub start: usize,
    /// Number of variables of a node.
    pub per_point: usize,
    /// Number of contact rows nc.
    pub contacts: usize,
    /// Outputs, as indices into q.
    pub outputs: Vec<usize>,
    /// Duration variable.
    pub duration: usize,
    /// Phase at the start.
    pub phase_start: usize,
    /// Phase at the end (a variable in SS1 only).
    pub phase_end: Option<usize>,
    /// First Bezier coefficient; coefficient i of output j is at `bezier + i * outputs.len() + j`.
    pub bezier: usize,
    /// First component of the impulse, in domains that begin with an impact.
    pub impulse: Option<usize>,
    /// Hip-velocity variable.
    pub hip_velocity: Option<usize>,
}

impl DomainLayout {
    /// First variable of node k.
    #[inline]
    pub fn point(&self, k: usize) -> usize {
        self.start + k * self.per_point
    }
    /// Offset of the fibre lengths in the variables of a node.
    #[inline]
    pub fn fibre_length(&self) -> usize {
        FORCE + self.contacts
    }
    /// Offset of the fibre velocities in the variables of a node.
    #[inline]
    pub fn fibre_velocity(&self) -> usize {
        self.fibre_length() + MUSCLE_COUNT
    }
    /// Offset of the activations in the variables of a node.
    #[inline]
    pub fn activation(&self) -> usize {
        self.fibre_velocity() + MUSCLE_COUNT
    }
    /// Variable of Bezier coefficient i of output j.
    #[inline]
    pub fn bezier_coefficient(&self, j: usize, i: usize) -> usize {
        self.bezier + i * self.outputs.len() + j
    }
    /// Relative time of node k: sigma_k = k / (K - 1).
    #[inline]
    pub fn sigma(&self, k: usize) -> f64 {
        k as f64 / (self.points - 1) as f64
    }
    /// Composite Simpson weight of node k; the weights of a domain sum to 1.
    #[inline]
    pub fn simpson(&self, k: usize) -> f64 {
        simpson(k, self.points)
    }
    /// Index of the last node.
    #[inline]
    pub fn last(&self) -> usize {
        self.points - 1
    }
}

/// Layout of the variables of the gait problem.
#[derive(Debug, Clone, PartialEq)]
pub struct Layout {
    /// Whether the problem has muscles.
    pub muscles: bool,
    /// The eight domains.
    pub domains: Vec<DomainLayout>,
    /// Index of the first of the four hip velocities.
    pub hip_velocities: usize,
    /// Index of the right step length x_L; the stride length D follows.
    pub right_step_length: usize,
    /// Index of the stride length D.
    pub stride_length: usize,
    /// Number of variables.
    pub variables: usize,
    /// Scale of each variable: physical value = stored value * scale.
    pub scale: Vec<f64>,
}

/// The variables of one node in physical units.
#[derive(Debug, Clone, Copy)]
pub struct PointVariables {
    /// Coordinates.
    pub q: [f64; 9],
    /// Velocities.
    pub qd: [f64; 9],
    /// Accelerations.
    pub qdd: [f64; 9],
    /// Torques, N m.
    pub u: [f64; 6],
    /// Contact forces, N; unused entries are 0.
    pub force: [f64; MAX_CONTACTS],
    /// Fibre length, optimal fibre lengths.
    pub fibre_length: [f64; MUSCLE_COUNT],
    /// Fibre velocity, optimal fibre lengths per second.
    pub fibre_velocity: [f64; MUSCLE_COUNT],
    /// Activation.
    pub activation: [f64; MUSCLE_COUNT],
}

impl Layout {
    /// Layout for a mesh, with or without muscles.
    pub fn new(mesh: &Mesh, muscles: bool) -> Self {
        let mut next = 0;
        let mut domains: Vec<DomainLayout> = CYCLE
            .iter()
            .map(|&domain| {
                let intervals = match domain.kind {
                    DomainKind::Ds2 => mesh.ds2,
                    DomainKind::Ds3 => mesh.ds3,
                    DomainKind::Ss2 => mesh.ss2,
                    DomainKind::Ss1 => mesh.ss1,
                };
                let contacts = domain.contact_rows().len();
                let per_point = FORCE + contacts + if muscles { 3 * MUSCLE_COUNT } else { 0 };
                let points = 2 * intervals + 1;
                let start = next;
                next += points * per_point;
                DomainLayout {
                    domain,
                    intervals,
                    points,
                    start,
                    per_point,
                    contacts,
                    outputs: domain.outputs(),
                    duration: 0,
                    phase_start: 0,
                    phase_end: None,
                    bezier: 0,
                    impulse: None,
                    hip_velocity: None,
                }
            })
            .collect();
        let hip_velocities = next;
        let right_step_length = next + 4;
        let stride_length = next + 5;
        next += 6;
        for layout in &mut domains {
            layout.duration = next;
            layout.phase_start = next + 1;
            next += 2;
            if layout.domain.kind == DomainKind::Ss1 {
                layout.phase_end = Some(next);
                next += 1;
            }
            layout.bezier = next;
            next += layout.outputs.len() * BEZIER_COEFFICIENTS;
            if layout.domain.opens_with_impact() {
                layout.impulse = Some(next);
                next += layout.contacts;
            }
            layout.hip_velocity = layout.domain.hip_velocity_index().map(|i| hip_velocities + i);
        }
        let mut scale = vec![1.0; next];
        for layout in &domains {
            for k in 0..layout.points {
                let p = layout.point(k);
                scale[p + QD..p + QDD].fill(SCALE_QD);
                scale[p + QDD..p + U].fill(SCALE_QDD);
                scale[p + U..p + FORCE].fill(SCALE_U);
                scale[p + FORCE..p + FORCE + layout.contacts].fill(SCALE_FORCE);
                if muscles {
                    scale[p + layout.fibre_velocity()..p + layout.activation()].fill(SCALE_FIBRE_VELOCITY);
                }
            }
            scale[layout.duration] = SCALE_DURATION;
            if let Some(impulse) = layout.impulse {
                scale[impulse..impulse + layout.contacts].fill(SCALE_IMPULSE);
            }
        }
        Self { muscles, domains, hip_velocities, right_step_length, stride_length, variables: next, scale }
    }

    /// Name and unit of a variable: `SS1_R node 3, velocity of the right knee`.
    pub fn variable_label(&self, index: usize) -> (String, &'static str) {
        for layout in &self.domains {
            let name = layout.domain.name();
            if index >= layout.start && index < layout.start + layout.points * layout.per_point {
                let (k, offset) =
                    ((index - layout.start) / layout.per_point, (index - layout.start) % layout.per_point);
                let (what, unit) = point_variable_label(layout, offset);
                return (format!("{name} node {k}, {what}"), unit);
            }
            if index == layout.duration {
                return (format!("{name} duration"), "s");
            }
            if index == layout.phase_start || Some(index) == layout.phase_end {
                return (format!("{name} phase limit"), "m");
            }
            if index >= layout.bezier && index < layout.bezier + layout.outputs.len() * BEZIER_COEFFICIENTS {
                return (format!("{name} Bezier coefficient"), "rad");
            }
            if layout.impulse.is_some_and(|first| index >= first && index < first + layout.contacts) {
                return (format!("{name} impact impulse"), "N s");
            }
        }
        if index >= self.hip_velocities && index < self.hip_velocities + 4 {
            let name = ["DS2_R", "DS3_R and SS2_R", "DS2_L", "DS3_L and SS2_L"][index - self.hip_velocities];
            return (format!("{name}, hip velocity"), "m/s");
        }
        let name = if index == self.right_step_length { "right step length" } else { "stride length" };
        (name.to_owned(), "m")
    }

    /// Physical value of variable `index`.
    #[inline]
    pub fn value(&self, x: &[f64], index: usize) -> f64 {
        x[index] * self.scale[index]
    }

    /// The variables of node k of domain d in physical units.
    #[inline]
    pub fn point_variables(&self, x: &[f64], d: usize, k: usize) -> PointVariables {
        let layout = &self.domains[d];
        let p = layout.point(k);
        let mut result = PointVariables {
            q: [0.0; 9],
            qd: [0.0; 9],
            qdd: [0.0; 9],
            u: [0.0; 6],
            force: [0.0; MAX_CONTACTS],
            fibre_length: [0.0; MUSCLE_COUNT],
            fibre_velocity: [0.0; MUSCLE_COUNT],
            activation: [0.0; MUSCLE_COUNT],
        };
        for i in 0..COORDINATES {
            result.q[i] = x[p + i];
            result.qd[i] = x[p + QD + i] * SCALE_QD;
            result.qdd[i] = x[p + QDD + i] * SCALE_QDD;
        }
        for i in 0..JOINTS {
            result.u[i] = x[p + U + i] * SCALE_U;
        }
        for i in 0..layout.contacts {
            result.force[i] = x[p + FORCE + i] * SCALE_FORCE;
        }
        if self.muscles {
            for m in 0..MUSCLE_COUNT {
                result.fibre_length[m] = x[p + layout.fibre_length() + m];
                result.fibre_velocity[m] = x[p + layout.fibre_velocity() + m] * SCALE_FIBRE_VELOCITY;
                result.activation[m] = x[p + layout.activation() + m];
            }
        }
        result
    }

    /// Writes the variables of node k of domain d from physical units.
    pub fn set_point_variables(&self, x: &mut [f64], d: usize, k: usize, point: &PointVariables) {
        let layout = &self.domains[d];
        let p = layout.point(k);
        for i in 0..COORDINATES {
            x[p + i] = point.q[i];
            x[p + QD + i] = point.qd[i] / SCALE_QD;
            x[p + QDD + i] = point.qdd[i] / SCALE_QDD;
        }
        for i in 0..JOINTS {
            x[p + U + i] = point.u[i] / SCALE_U;
        }
        for i in 0..layout.contacts {
            x[p + FORCE + i] = point.force[i] / SCALE_FORCE;
        }
        if self.muscles {
            for m in 0..MUSCLE_COUNT {
                x[p + layout.fibre_length() + m] = point.fibre_length[m];
                x[p + layout.fibre_velocity() + m] = point.fibre_velocity[m] / SCALE_FIBRE_VELOCITY;
                x[p + layout.activation() + m] = point.activation[m];
            }
        }
    }
}

fn point_variable_label(layout: &DomainLayout, offset: usize) -> (String, &'static str) {
    let angle = |i: usize, linear: &'static str, angular: &'static str| if i < 2 { linear } else { angular };
    if offset < QD {
        (COORDINATE_NAMES[offset].to_owned(), angle(offset, "m", "rad"))
    } else if offset < QDD {
        (format!("velocity of the {}", COORDINATE_NAMES[offset - QD]), angle(offset - QD, "m/s", "rad/s"))
    } else if offset < U {
        (format!("acceleration of the {}", COORDINATE_NAMES[offset - QDD]), angle(offset - QDD, "m/s²", "rad/s²"))
    } else if offset < FORCE {
        (format!("torque of the {}", COORDINATE_NAMES[offset - U + 3]), "N m")
    } else if offset < layout.fibre_length() {
        (format!("contact force {}", offset - FORCE), "N")
    } else {
        let muscle = (offset - layout.fibre_length()) % MUSCLE_COUNT;
        let name = crate::muscle::MUSCLES[muscle].name;
        if offset < layout.fibre_velocity() {
            (format!("fibre length of {name}"), "l_opt")
        } else if offset < layout.activation() {
            (format!("fibre velocity of {name}"), "l_opt/s")
        } else {
            (format!("activation of {name}"), "1")
        }
    }
}
