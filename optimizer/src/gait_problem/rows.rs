//! The rows of the gait problem: bounds, and the index of each group of rows.

use super::layout::Layout;
use super::row_names::{RowKind, RowName, RowPlace};
use crate::body::{FootPoint, Side};
use crate::muscle::MUSCLE_COUNT;
use crate::walking::{CYCLE, DomainKind};

/// First row of each group of a node. Missing groups are `None` or empty.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct PointRows {
    /// 9 rows.
    pub dynamics: usize,
    /// One per contact.
    pub contact_acceleration: usize,
    /// (contact, row).
    pub contact_position: Vec<(usize, usize)>,
    /// One per contact.
    pub contact_velocity: Option<usize>,
    /// One per output.
    pub output_position: usize,
    /// One per output.
    pub output_velocity: usize,
    /// One per output.
    pub output_acceleration: usize,
    /// dp = pa + v_hip T sigma, or dp = pa at the first node.
    pub hip_phase: Option<usize>,
    /// dp_dot = v_hip.
    pub hip_velocity: Option<usize>,
    /// dp_ddot = 0.
    pub hip_acceleration: Option<usize>,
    /// 10 rows.
    pub muscle_force: Option<usize>,
    /// 4 rows.
    pub muscle_torque: Option<usize>,
    /// Two rows for each foot on the ground, stance foot first.
    pub friction: usize,
    /// Number of these rows.
    pub friction_edges: usize,
    /// Heights of the points in the air.
    pub heights: Vec<HeightRow>,
    /// dp_dot >= minimum.
    pub phase_rate: Option<usize>,
    /// Foot point and row of the vertical velocity of the landing point.
    pub touchdown: Option<(usize, usize)>,
}

/// A height row. Foot points are 0 heel_L, 1 toe_L, 2 heel_R, 3 toe_R.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct HeightRow {
    /// Foot point.
    pub foot_point: usize,
    /// Row.
    pub row: usize,
    /// Whether the swing clearance a5 applies.
    pub clearance: bool,
}

/// Rows of a domain, including those of the transition to the next one.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct DomainRows {
    /// Rows of each node.
    pub points: Vec<PointRows>,
    /// In SS1, four rows for each interval: midpoint phase, endpoint phase, midpoint rate, endpoint rate.
    pub zero_dynamics: Option<usize>,
    /// In SS1, pb = dp at the last node.
    pub phase_end: Option<usize>,
    /// 20 rows for each interval: 10 of the midpoint, 10 of the endpoint.
    pub fibres: Option<usize>,
    /// 9 rows into the next domain.
    pub position_reset: usize,
    /// 9 rows into the next domain (impact or continuity).
    pub velocity_reset: usize,
    /// 2 rows into the next domain.
    pub impact_friction: Option<usize>,
    /// 10 rows into the next domain.
    pub fibre_reset: Option<usize>,
}

/// All rows.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct RowTable {
    /// Name of each row.
    pub names: Vec<RowName>,
    /// Lower bound of each row.
    pub lower: Vec<f64>,
    /// Upper bound of each row.
    pub upper: Vec<f64>,
    /// By domain.
    pub domains: Vec<DomainRows>,
    /// Two rows: x_L, D - x_L.
    pub step_length: usize,
    /// One row: D / sum T.
    pub speed: usize,
}

/// Index of a foot point: heel_L, toe_L, heel_R, toe_R.
pub fn foot_point_index(point: FootPoint, side: Side) -> usize {
    let base = match side {
        Side::Left => 0,
        Side::Right => 2,
    };
    base + match point {
        FootPoint::Heel => 0,
        FootPoint::Toe => 1,
    }
}

impl RowTable {
    fn add(&mut self, place: RowPlace, kind: RowKind, count: usize, lower: f64, upper: f64) -> usize {
        let first = self.names.len();
        for component in 0..count {
            self.names.push(RowName { place, kind, component });
            self.lower.push(lower);
            self.upper.push(upper);
        }
        first
    }

    fn add_one(&mut self, place: RowPlace, kind: RowKind, component: usize, lower: f64, upper: f64) -> usize {
        let row = self.add(place, kind, 1, lower, upper);
        self.names[row].component = component;
        row
    }

    /// The rows of a layout. Inequality rows are `>= 0`; [`super::variable_bounds`] later sets the limits of speed,
    /// steps, touchdown and phase rate.
    pub fn new(layout: &Layout) -> Self {
        let mut table = Self::default();
        for (domain, domain_layout) in layout.domains.iter().enumerate() {
            let mut rows = DomainRows::default();
            for k in 0..domain_layout.points {
                let point = table.point_rows(layout, domain, k);
                rows.points.push(point);
            }
            let last = RowPlace::Point { domain, point: domain_layout.last() };
            let interval_end = |i: usize| RowPlace::Point { domain, point: 2 * i + 2 };
            let interval_mid = |i: usize| RowPlace::Point { domain, point: 2 * i + 1 };
            if domain_layout.domain.kind == DomainKind::Ss1 {
                rows.zero_dynamics = Some(table.names.len());
                for i in 0..domain_layout.intervals {
                    table.add(interval_mid(i), RowKind::MidpointPhase, 1, 0.0, 0.0);
                    table.add(interval_end(i), RowKind::EndpointPhase, 1, 0.0, 0.0);
                    table.add(interval_mid(i), RowKind::MidpointPhaseRate, 1, 0.0, 0.0);
                    table.add(interval_end(i), RowKind::EndpointPhaseRate, 1, 0.0, 0.0);
                }
                rows.phase_end = Some(table.add(last, RowKind::PhaseEnd, 1, 0.0, 0.0));
            }
            if layout.muscles {
                rows.fibres = Some(table.names.len());
                for i in 0..domain_layout.intervals {
                    table.add(interval_mid(i), RowKind::MidpointFibre, MUSCLE_COUNT, 0.0, 0.0);
                    table.add(interval_end(i), RowKind::EndpointFibre, MUSCLE_COUNT, 0.0, 0.0);
                }
            }
            let transition = RowPlace::Transition { domain };
            rows.position_reset = table.add(transition, RowKind::PositionReset, 9, 0.0, 0.0);
            let next = CYCLE[(domain + 1) % CYCLE.len()];
            if next.opens_with_impact() {
                rows.velocity_reset = table.add(transition, RowKind::Impact, 9, 0.0, 0.0);
                if next.kind == DomainKind::Ds2 {
                    rows.impact_friction = Some(table.add(transition, RowKind::ImpactFriction, 2, 0.0, f64::INFINITY));
                }
            } else {
                rows.velocity_reset = table.add(transition, RowKind::VelocityReset, 9, 0.0, 0.0);
            }
            if layout.muscles {
                rows.fibre_reset = Some(table.add(transition, RowKind::FibreReset, MUSCLE_COUNT, 0.0, 0.0));
            }
            table.domains.push(rows);
        }
        table.step_length = table.add(RowPlace::Stride, RowKind::StepLength, 2, 0.0, f64::INFINITY);
        table.speed = table.add(RowPlace::Stride, RowKind::Speed, 1, 0.0, f64::INFINITY);
        table
    }

    fn point_rows(&mut self, layout: &Layout, d: usize, k: usize) -> PointRows {
        let domain_layout = &layout.domains[d];
        let domain = domain_layout.domain;
        let (nc, ny) = (domain_layout.contacts, domain_layout.outputs.len());
        let place = RowPlace::Point { domain: d, point: k };
        let first = k == 0;
        let mut equality = |kind, count| self.add(place, kind, count, 0.0, 0.0);
        let mut rows = PointRows {
            dynamics: equality(RowKind::Dynamics, 9),
            contact_acceleration: equality(RowKind::ContactAcceleration, nc),
            output_position: equality(RowKind::OutputPosition, ny),
            output_velocity: equality(RowKind::OutputVelocity, ny),
            output_acceleration: equality(RowKind::OutputAcceleration, ny),
            ..PointRows::default()
        };
        if domain.has_hip_velocity() {
            rows.hip_acceleration = Some(equality(RowKind::HipAcceleration, 1));
            rows.hip_phase = Some(equality(RowKind::HipPhase, 1));
            if !first || domain.opens_with_impact() {
                rows.hip_velocity = Some(equality(RowKind::HipVelocity, 1));
            }
        } else if first {
            rows.hip_phase = Some(equality(RowKind::HipPhase, 1));
        }
        if !first || domain.opens_with_impact() {
            rows.contact_velocity = Some(equality(RowKind::ContactVelocity, nc));
        }
        // At the first node, only rows that the reset does not imply.
        let positions: Vec<usize> = match (first, domain.kind) {
            (false, _) => (0..nc).collect(),
            (true, DomainKind::Ds2) => vec![0, 1],
            (true, DomainKind::Ds3) => vec![2],
            (true, DomainKind::Ss2 | DomainKind::Ss1) => Vec::new(),
        };
        for contact in positions {
            let row = self.add_one(place, RowKind::ContactPosition, contact, 0.0, 0.0);
            rows.contact_position.push((contact, row));
        }
        if layout.muscles {
            rows.muscle_force = Some(self.add(place, RowKind::MuscleForce, MUSCLE_COUNT, 0.0, 0.0));
            rows.muscle_torque = Some(self.add(place, RowKind::MuscleTorque, 4, 0.0, 0.0));
        }
        let feet = if matches!(domain.kind, DomainKind::Ds2 | DomainKind::Ds3) { 2 } else { 1 };
        rows.friction_edges = 2 * feet;
        rows.friction = self.add(place, RowKind::Friction, rows.friction_edges, 0.0, f64::INFINITY);
        if domain.kind == DomainKind::Ds3 && k == domain_layout.last() {
            // At lift-off the friction cone of the trailing foot degenerates to its vertex. Bounds of the forces
            // impose it, because rows without an interior would have unbounded multipliers.
            self.lower[rows.friction + 2..].fill(f64::NEG_INFINITY);
        }
        self.height_rows(domain_layout, place, k, &mut rows);
        if domain.kind == DomainKind::Ss1 {
            rows.phase_rate = Some(self.add(place, RowKind::PhaseRate, 1, 0.0, f64::INFINITY));
        }
        if k == domain_layout.last() {
            let landing = match domain.kind {
                DomainKind::Ds2 => Some((FootPoint::Toe, domain.stance)),
                DomainKind::Ss1 => Some((FootPoint::Heel, domain.stance.other())),
                DomainKind::Ds3 | DomainKind::Ss2 => None,
            };
            if let Some((point, side)) = landing {
                let index = foot_point_index(point, side);
                let row = self.add_one(place, RowKind::TouchdownSpeed, index, f64::NEG_INFINITY, 0.0);
                rows.touchdown = Some((index, row));
            }
        }
        rows
    }

    fn height_rows(
        &mut self,
        domain_layout: &super::layout::DomainLayout,
        place: RowPlace,
        k: usize,
        rows: &mut PointRows,
    ) {
        let domain = domain_layout.domain;
        let contacts = domain.contact_rows();
        let (first, last) = (k == 0, k == domain_layout.last());
        for side in [domain.stance, domain.stance.other()] {
            for point in [FootPoint::Heel, FootPoint::Toe] {
                if contacts.iter().any(|c| c.point == point && c.side == side) {
                    continue;
                }
                let swing = side != domain.stance;
                // A contact before, or the guard after, makes these rows zero.
                let implied = match (domain.kind, swing, point) {
                    (DomainKind::Ss2, true, FootPoint::Toe) | (DomainKind::Ss1, false, FootPoint::Heel) => first,
                    (DomainKind::Ss1, true, FootPoint::Heel) | (DomainKind::Ds2, false, FootPoint::Toe) => last,
                    _ => false,
                };
                if implied {
                    continue;
                }
                let clearance = swing && matches!(domain.kind, DomainKind::Ss2 | DomainKind::Ss1);
                let kind = if clearance { RowKind::Clearance } else { RowKind::Height };
                let foot_point = foot_point_index(point, side);
                let row = self.add_one(place, kind, foot_point, 0.0, f64::INFINITY);
                rows.heights.push(HeightRow { foot_point, row, clearance });
            }
        }
    }
}
