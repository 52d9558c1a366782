//! Names of the rows of the gait problem: constraint, place and component.

use crate::body::{Axis, FootPoint, Side};
use crate::muscle::MUSCLES;
use crate::walking::{CYCLE, ContactRow};

/// Kind of a row.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[allow(missing_docs)]
pub enum RowKind {
    Dynamics,
    ContactAcceleration,
    ContactPosition,
    ContactVelocity,
    OutputPosition,
    OutputVelocity,
    OutputAcceleration,
    HipPhase,
    HipVelocity,
    HipAcceleration,
    MidpointPhase,
    EndpointPhase,
    MidpointPhaseRate,
    EndpointPhaseRate,
    PhaseEnd,
    PhaseRate,
    Friction,
    Height,
    Clearance,
    TouchdownSpeed,
    ImpactFriction,
    PositionReset,
    VelocityReset,
    Impact,
    FibreReset,
    MuscleForce,
    MuscleTorque,
    MidpointFibre,
    EndpointFibre,
    StepLength,
    Speed,
}

impl RowKind {
    /// Description, unit of the physical residual, and physical residual per unit of the scaled row.
    pub fn description(self) -> (&'static str, &'static str, f64) {
        match self {
            Self::Dynamics => ("equation of motion", "N or N m", 100.0),
            Self::ContactAcceleration => ("contact acceleration", "m/s²", 10.0),
            Self::ContactPosition => ("contact position", "m", 1.0),
            Self::ContactVelocity => ("contact velocity", "m/s", 1.0),
            Self::OutputPosition => ("virtual constraint", "rad", 1.0),
            Self::OutputVelocity => ("virtual constraint rate", "rad/s", 1.0),
            Self::OutputAcceleration => ("virtual constraint acceleration", "rad/s²", 10.0),
            Self::HipPhase => ("hip phase", "m", 1.0),
            Self::HipVelocity => ("hip velocity", "m/s", 1.0),
            Self::HipAcceleration => ("hip acceleration", "m/s²", 10.0),
            Self::MidpointPhase | Self::EndpointPhase => ("integration of the hip phase", "m", 1.0),
            Self::MidpointPhaseRate | Self::EndpointPhaseRate => ("integration of the hip velocity", "m/s", 1.0),
            Self::PhaseEnd => ("phase at the end of the domain", "m", 1.0),
            Self::PhaseRate => ("forward hip velocity", "m/s", 1.0),
            Self::Friction => ("friction cone", "N", 500.0),
            Self::Height => ("height above the ground", "m", 0.1),
            Self::Clearance => ("swing-foot clearance", "m", 0.1),
            Self::TouchdownSpeed => ("touchdown speed", "m/s", 1.0),
            Self::ImpactFriction => ("friction cone of the impact", "N s", 20.0),
            Self::PositionReset => ("continuity of position", "m or rad", 1.0),
            Self::VelocityReset => ("continuity of velocity", "m/s or rad/s", 3.0),
            Self::Impact => ("impact momentum balance", "N s or N m s", 5.0),
            Self::FibreReset => ("continuity of fibre length", "l_opt", 1.0),
            Self::MuscleForce => ("muscle-tendon force equilibrium", "F_max", 1.0),
            Self::MuscleTorque => ("joint torque from muscles", "N m", 100.0),
            Self::MidpointFibre | Self::EndpointFibre => ("integration of the fibre length", "l_opt", 1.0),
            Self::StepLength => ("step length", "m", 1.0),
            Self::Speed => ("walking speed", "m/s", 1.0),
        }
    }
}

/// Place of a row.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum RowPlace {
    /// Node `point` of domain `domain`.
    Point {
        /// 0..8.
        domain: usize,
        /// 0..K.
        point: usize,
    },
    /// From the end of `domain` to the start of the next one.
    Transition {
        /// 0..8.
        domain: usize,
    },
    /// The whole stride.
    Stride,
}

/// Name of a row.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct RowName {
    /// Place.
    pub place: RowPlace,
    /// Kind.
    pub kind: RowKind,
    /// Component; its meaning depends on the kind.
    pub component: usize,
}

/// Names of the coordinates, as they follow `velocity of the`.
pub(super) const COORDINATE_NAMES: [&str; 9] = [
    "horizontal hip position",
    "hip height",
    "torso",
    "left hip",
    "left knee",
    "left ankle",
    "right hip",
    "right knee",
    "right ankle",
];

fn contact_name(row: ContactRow) -> String {
    let point = match row.point {
        FootPoint::Heel => "heel",
        FootPoint::Toe => "toe",
    };
    let side = match row.side {
        Side::Left => "left",
        Side::Right => "right",
    };
    let axis = match row.axis {
        Axis::X => "horizontal",
        Axis::Z => "vertical",
    };
    format!("{side} {point}, {axis}")
}

/// Name of a domain; a number that no domain has is named as such.
fn domain_name(domain: usize) -> String {
    CYCLE.get(domain).map_or_else(|| format!("domain {domain}"), |domain| domain.name().to_owned())
}

impl RowName {
    /// Name of the component: a coordinate, a contact row, a muscle, ... A component that the kind does not have is named
    /// by its number, never as another one.
    pub fn component_name(&self) -> String {
        let component = self.component;
        let domain = match self.place {
            RowPlace::Point { domain, .. } | RowPlace::Transition { domain } => CYCLE.get(domain).copied(),
            RowPlace::Stride => None,
        };
        let of = |names: &[&str]| names.get(component).map(|name| (*name).to_owned());
        let name = match self.kind {
            RowKind::Dynamics | RowKind::PositionReset | RowKind::VelocityReset | RowKind::Impact => {
                of(&COORDINATE_NAMES)
            }
            RowKind::ContactAcceleration | RowKind::ContactPosition | RowKind::ContactVelocity => {
                domain.and_then(|d| d.contact_rows().get(component).copied()).map(contact_name)
            }
            RowKind::OutputPosition | RowKind::OutputVelocity | RowKind::OutputAcceleration => domain
                .and_then(|d| d.outputs().get(component).copied())
                .and_then(|i| COORDINATE_NAMES.get(i))
                .map(|name| (*name).to_owned()),
            RowKind::Friction => of(&[
                "stance foot, forward edge",
                "stance foot, backward edge",
                "trailing foot, forward edge",
                "trailing foot, backward edge",
            ]),
            RowKind::ImpactFriction => of(&["landing heel, forward edge", "landing heel, backward edge"]),
            RowKind::Height | RowKind::Clearance | RowKind::TouchdownSpeed => {
                of(&["left heel", "left toe", "right heel", "right toe"])
            }
            RowKind::FibreReset | RowKind::MuscleForce | RowKind::MidpointFibre | RowKind::EndpointFibre => {
                MUSCLES.get(component).map(|muscle| muscle.name.to_owned())
            }
            RowKind::MuscleTorque => of(&["left hip", "left knee", "left ankle", "right hip"]),
            RowKind::StepLength => of(&["right step", "left step"]),
            RowKind::HipPhase
            | RowKind::HipVelocity
            | RowKind::HipAcceleration
            | RowKind::MidpointPhase
            | RowKind::EndpointPhase
            | RowKind::MidpointPhaseRate
            | RowKind::EndpointPhaseRate
            | RowKind::PhaseEnd
            | RowKind::PhaseRate
            | RowKind::Speed => of(&[""]),
        };
        name.unwrap_or_else(|| format!("component {component}"))
    }

    /// `SS1_R node 3, swing-foot clearance, left heel`.
    pub fn label(&self) -> String {
        let place = match self.place {
            RowPlace::Point { domain, point } => format!("{} node {point}", domain_name(domain)),
            RowPlace::Transition { domain } => {
                let next = if domain + 1 == CYCLE.len() { 0 } else { domain + 1 };
                format!("{} to {}", domain_name(domain), domain_name(next))
            }
            RowPlace::Stride => "stride".to_owned(),
        };
        let component = self.component_name();
        let separator = if component.is_empty() { "" } else { ", " };
        format!("{place}, {}{separator}{component}", self.kind.description().0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn row_outside_the_tables_is_not_labelled_as_another_row() {
        let label = |place, kind, component| RowName { place, kind, component }.label();
        let node = RowPlace::Point { domain: 3, point: 70_000 };
        assert_eq!(
            label(node, RowKind::Dynamics, 8),
            format!("{} node 70000, equation of motion, right ankle", CYCLE[3].name())
        );
        for kind in [
            RowKind::Dynamics,
            RowKind::ContactPosition,
            RowKind::OutputPosition,
            RowKind::Friction,
            RowKind::ImpactFriction,
            RowKind::Clearance,
            RowKind::MuscleForce,
            RowKind::MuscleTorque,
            RowKind::StepLength,
            RowKind::Speed,
        ] {
            assert!(label(node, kind, 300).ends_with(", component 300"), "{}", label(node, kind, 300));
        }
        assert!(label(RowPlace::Point { domain: 9, point: 0 }, RowKind::Speed, 0).starts_with("domain 9 node 0"));
        let last = label(RowPlace::Transition { domain: 7 }, RowKind::Impact, 0);
        assert!(last.starts_with(&format!("{} to {}", CYCLE[7].name(), CYCLE[0].name())), "{last}");
        assert!(label(RowPlace::Transition { domain: 8 }, RowKind::Impact, 0).starts_with("domain 8 to domain 9"));
    }
}
