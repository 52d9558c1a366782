//! Residuals of C1 to C4 at the nodes and on a finer grid between them.

use super::checked_quantity::{Check, CheckLocation, WorstValues};
use super::contact_kinematics::Contact;
use super::findings::{Findings, GridPoint};
use super::limit_excess::{AllowedRanges, depth_below_ground};
use super::limits::{
    ACCELERATION, ANGLE, CLEARANCE, CONTACT_ACCELERATION, CONTACT_POSITION, CONTACT_VELOCITY, DEPTH, FORCE, FRICTION,
    HIP_POSITION, HIP_VELOCITY, IMPACT, IMPACT_FRICTION, IMPULSE, IMPULSE_SIZE, KEPT_LOAD, MOMENT, NORMAL_FORCE,
    OUTPUT, OUTPUT_RATE, PROGRESS, RESET, SPEED, STRIDE, TORQUE, TOUCHDOWN,
};
use super::muscle_residuals;
use super::virtual_constraints::VirtualConstraints;
use crate::body::{Axis, FootPoint, GRAVITY, InverseDynamics, PointState, Side, WalkerModel};
use crate::gait::Gait;
use crate::gait::between_nodes::{GaitInstant, instant};
use crate::walking::{CYCLE, ContactRow, Domain, DomainKind};

/// Number of grid points between adjacent nodes, in the middle of as many equal parts. The solve divides the same time
/// into ten parts and tightens bounds at their ends. No point of this grid is one of those, so that a gait is judged where
/// nothing was tightened.
const BETWEEN_NODES: usize = 24;

/// Largest absolute value.
fn largest(values: impl Iterator<Item = f64>) -> f64 {
    values.map(f64::abs).fold(0.0, f64::max)
}

/// Measures a well-formed gait without simulation.
pub(super) fn residuals(model: &WalkerModel, gait: &Gait) -> Vec<Check> {
    residuals_on(model, gait, BETWEEN_NODES)
}

/// [`residuals`] with this number of grid points between adjacent nodes.
pub(super) fn residuals_on(model: &WalkerModel, gait: &Gait, between_nodes: usize) -> Vec<Check> {
    let limits = AllowedRanges::new(gait);
    let table = gait.settings.muscles.muscles(&gait.subject);
    let mut worst = Findings::default();
    for (d, trajectory) in gait.domains.iter().enumerate() {
        let domain = DomainResiduals {
            model,
            gait,
            d,
            domain: CYCLE[d],
            limits: &limits,
            contacts: Contact::of_domain(model, CYCLE[d]),
            constraints: VirtualConstraints::new(model, gait, d),
        };
        for (share, node) in grid(trajectory.q.len(), between_nodes) {
            let mut here = instant(trajectory, share);
            let of_cubic = here.muscles.as_ref().map(|muscles| muscles.fibre_length);
            let written = trajectory.muscles.as_ref().zip(node).map(|(all, node)| all.fibre_length[node]);
            if let (Some(muscles), Some(written)) = (&mut here.muscles, written) {
                muscles.fibre_length = written;
            }
            let point =
                GridPoint { instant: &here, place: CheckLocation::within(trajectory, share), on_mesh: node.is_some() };
            if let (Some(written), Some(of_cubic)) = (written, of_cubic) {
                muscle_residuals::add_interpolation_error(&point, &written, &of_cubic, &mut worst);
            }
            domain.mechanics(&point, &mut worst);
            domain.outputs(&point, share, &mut worst);
            domain.limits(&point, share, &mut worst);
            if let Some(muscles) = &point.instant.muscles {
                muscle_residuals::add(&point, &table, muscles, &gait.settings.limits, &mut worst);
            }
        }
        domain.reset(&mut worst);
    }
    stride(gait, &mut worst);
    worst.into_checks()
}

/// Fractions of the duration of a domain, in order: every node with its number, and the points between.
fn grid(nodes: usize, between: usize) -> impl Iterator<Item = (f64, Option<usize>)> {
    let gaps = (nodes - 1) as f64;
    (0..nodes).flat_map(move |node| {
        let parts = if node + 1 < nodes { between } else { 0 };
        let middle = move |part: usize| (node as f64 + (part as f64 + 0.5) / between as f64) / gaps;
        std::iter::once((node as f64 / gaps, Some(node))).chain((0..parts).map(move |part| (middle(part), None)))
    })
}

struct DomainResiduals<'a> {
    model: &'a WalkerModel,
    gait: &'a Gait,
    d: usize,
    domain: Domain,
    limits: &'a AllowedRanges,
    contacts: Vec<Contact>,
    constraints: VirtualConstraints,
}

impl DomainResiduals<'_> {
    /// Position on the ground of the point of a contact row, m.
    fn foothold(&self, contact: &Contact) -> f64 {
        let gait = self.gait;
        // The right toe is at 0. The left toe is one step ahead or, trailing in right stance, that step minus a stride.
        let toe = match (contact.row.side, self.domain.stance) {
            (Side::Right, _) => 0.0,
            (Side::Left, Side::Left) => gait.right_step_length_m,
            (Side::Left, Side::Right) => gait.right_step_length_m - gait.stride_length_m,
        };
        let leg = self.model.leg(contact.row.side);
        match (contact.row.axis, contact.row.point) {
            (Axis::Z, _) => 0.0,
            (Axis::X, FootPoint::Toe) => toe,
            (Axis::X, FootPoint::Heel) => toe - leg.heel_behind_m - leg.toe_ahead_m,
        }
    }

    fn mechanics(&self, point: &GridPoint<'_>, worst: &mut Findings) {
        let GaitInstant { q, qd, qdd, u, forces, .. } = point.instant;
        let state = PointState::new(q, qd, qdd);
        let mut rest = InverseDynamics::new(self.model).rows(&state);
        for i in 0..6 {
            rest[3 + i] -= u[i];
        }
        for (contact, force) in self.contacts.iter().zip(forces) {
            for (i, gradient) in contact.gradient(&state).into_iter().enumerate() {
                rest[i] -= gradient * force;
            }
        }
        worst.add(point, &FORCE, largest(rest[..2].iter().copied()));
        worst.add(point, &MOMENT, largest(rest[2..].iter().copied()));
        let of_contacts = |value: &dyn Fn(&Contact) -> f64| largest(self.contacts.iter().map(value));
        worst.add(point, &CONTACT_POSITION, of_contacts(&|c| c.position(&state) - self.foothold(c)));
        worst.add(point, &CONTACT_VELOCITY, of_contacts(&|c| c.velocity(&state)));
        worst.add(point, &CONTACT_ACCELERATION, of_contacts(&|c| c.acceleration(&state)));
    }

    fn outputs(&self, point: &GridPoint<'_>, share: f64, worst: &mut Findings) {
        let GaitInstant { q, qd, qdd, .. } = point.instant;
        let phase = self.constraints.phase(q, qd, qdd);
        let errors = |order: usize| {
            let desired = self.constraints.desired(phase.s);
            largest(self.constraints.outputs.iter().zip(desired).map(|(&output, y)| match order {
                0 => q[output] - y[0],
                _ => qd[output] - y[1] * phase.rate,
            }))
        };
        worst.add(point, &OUTPUT, errors(0));
        worst.add(point, &OUTPUT_RATE, errors(1));
        if let Some(wanted) = self.constraints.hip_velocity {
            let trajectory = &self.gait.domains[self.d];
            let [position, velocity, _] = self.constraints.hip(q, qd, qdd);
            let planned = trajectory.phase_start_m + wanted * trajectory.duration_s * share;
            worst.add(point, &HIP_POSITION, (position - planned).abs());
            worst.add(point, &HIP_VELOCITY, (velocity - wanted).abs());
        }
    }

    fn limits(&self, point: &GridPoint<'_>, share: f64, worst: &mut Findings) {
        let GaitInstant { q, qd, qdd, u, forces, .. } = point.instant;
        let rows = self.domain.contact_rows();
        let state = PointState::new(q, qd, qdd);
        worst.add(point, &NORMAL_FORCE, self.limits.normal_force(&rows, forces));
        worst.add(point, &FRICTION, self.limits.friction(&rows, forces));
        for (c, (row, force)) in rows.iter().zip(forces).enumerate() {
            if let Some(kept) = self.kept_load(c, *row, share) {
                worst.add(point, &KEPT_LOAD, kept - force);
            }
        }
        if self.domain.kind == DomainKind::Ss1 {
            let velocity = self.constraints.hip(q, qd, qdd)[1];
            worst.add(point, &PROGRESS, self.gait.settings.limits.phase_rate_min_m_s - velocity);
        }
        worst.add(point, &DEPTH, depth_below_ground(self.model, self.domain, &state));
        if let Some(wanted) = self.wanted_clearance(share) {
            let swing = self.domain.stance.other();
            let lowest = [FootPoint::Heel, FootPoint::Toe]
                .map(|foot| state.contact_position(&self.model.contact_point(foot, swing))[1])
                .into_iter()
                .fold(f64::INFINITY, f64::min);
            worst.add(point, &CLEARANCE, wanted - lowest);
        }
        let excess = self.limits.motion(q, qd, qdd);
        worst.add(point, &ANGLE, excess.angle);
        worst.add(point, &SPEED, excess.speed);
        worst.add(point, &ACCELERATION, excess.acceleration);
        worst.add(point, &TORQUE, self.limits.torque(u));
    }

    /// Smallest allowed force of contact row `c`, N: the load of the trailing foot in gradual weight transfer, and the
    /// load of a contact before it lifts off.
    fn kept_load(&self, c: usize, row: ContactRow, share: f64) -> Option<f64> {
        let settings = &self.gait.settings;
        let at_heel_strike = settings.naturalness.trailing_load_share * self.model.total_mass * GRAVITY;
        let trails = row.axis == Axis::Z && row.side != self.domain.stance;
        // Linear from heel strike to toe-off; half of the decrease in each domain of double support.
        let transferred = match self.domain.kind {
            DomainKind::Ds2 if trails => Some(at_heel_strike * (1.0 - share / 2.0)),
            DomainKind::Ds3 if trails => Some(at_heel_strike * (1.0 - share) / 2.0),
            _ => None,
        };
        let unloads = self.domain.unloading_row() == Some(c);
        let until_lift_off = unloads.then_some(settings.limits.liftoff_force_n * (1.0 - share));
        transferred.into_iter().chain(until_lift_off).reduce(f64::max)
    }

    /// Checks the impulses of an impact: their limit, and the friction cone at heel strike.
    fn impulses(&self, kind: DomainKind, impulse: &[f64], place: CheckLocation<'_>, worst: &mut WorstValues) {
        let limits = &self.gait.settings.limits;
        worst.add(IMPULSE_SIZE, largest(impulse.iter().copied()) - limits.impulse_max_n_s, place);
        if let (DomainKind::Ds2, [tangential, normal, ..]) = (kind, impulse) {
            worst.add(IMPACT_FRICTION, tangential.abs() - limits.impact_friction * normal, place);
        }
    }

    /// Required height of the swing foot, `c (4 w (1 - w))^2` at the fraction w of the swing, m.
    fn wanted_clearance(&self, share: f64) -> Option<f64> {
        let duration = |d: usize| self.gait.domains[d].duration_s;
        let (before, swing) = match self.domain.kind {
            DomainKind::Ss2 => (0.0, duration(self.d) + duration(self.d + 1)),
            DomainKind::Ss1 => (duration(self.d - 1), duration(self.d - 1) + duration(self.d)),
            DomainKind::Ds2 | DomainKind::Ds3 => return None,
        };
        let w = (before + share * duration(self.d)) / swing;
        let clearance = self.gait.bounds.a5.max(self.gait.settings.limits.clearance_min_m);
        Some(clearance * (4.0 * w * (1.0 - w)).powi(2))
    }

    /// The discontinuity between the last node of the domain and the first node of the next one.
    fn reset(&self, worst: &mut Findings) {
        let next = (self.d + 1) % CYCLE.len();
        let (from, to) = (&self.gait.domains[self.d], &self.gait.domains[next]);
        let place = CheckLocation::within(from, 1.0);
        let (Some(q), Some(qd)) = (from.q.last(), from.qd.last()) else { return };
        let mut position_jump: [f64; 9] = std::array::from_fn(|i| to.q[0][i] - q[i]);
        if next == 0 {
            position_jump[0] += self.gait.stride_length_m;
        }
        worst.other.add(RESET, largest(position_jump.into_iter()), place);
        let expected = if CYCLE[next].opens_with_impact() {
            let impact = crate::walking::impact(self.model, CYCLE[next], q, qd);
            let by_physics = impact.as_ref().map_or(&[][..], |impact| &impact.impulse);
            let missed = to.impulse.iter().flatten().zip(by_physics).map(|(told, found)| told - found);
            worst.other.add(IMPULSE, if by_physics.is_empty() { f64::NAN } else { largest(missed) }, place);
            self.impulses(CYCLE[next].kind, by_physics, place, &mut worst.other);
            impact.map(|impact| impact.velocity_after)
        } else {
            Some(*qd)
        };
        let error = expected.map_or(f64::NAN, |after| largest((0..9).map(|i| to.qd[0][i] - after[i])));
        worst.other.add(IMPACT, error, place);
        let landing = match self.domain.kind {
            DomainKind::Ds2 => Some((FootPoint::Toe, self.domain.stance, self.gait.settings.limits.toe_touchdown_m_s)),
            DomainKind::Ss1 => {
                Some((FootPoint::Heel, self.domain.stance.other(), self.gait.settings.limits.heel_touchdown_m_s))
            }
            DomainKind::Ds3 | DomainKind::Ss2 => None,
        };
        if let Some((point, side, slowest)) = landing {
            let state = PointState::new(q, qd, &[0.0; 9]);
            let velocity = state.contact_velocity(&self.model.contact_point(point, side))[1];
            worst.other.add(TOUCHDOWN, velocity + slowest, place);
        }
        if let (Some(before), Some(after)) = (&from.muscles, &to.muscles) {
            muscle_residuals::add_reset(before, after, place, &mut worst.other);
        }
    }
}

/// C4 over the whole stride.
fn stride(gait: &Gait, worst: &mut Findings) {
    let (limits, bounds) = (&gait.settings.limits, &gait.bounds);
    let place = CheckLocation { domain: "stride", time_s: None };
    let mut range = |value: f64, low: f64, high: f64| worst.other.add(STRIDE, (low - value).max(value - high), place);
    for velocity in gait.hip_velocity_m_s {
        range(velocity, bounds.a3, bounds.a4);
    }
    for step in [gait.right_step_length_m, gait.stride_length_m - gait.right_step_length_m] {
        range(step, limits.step_min_m, limits.step_max_m);
    }
    let time: f64 = gait.domains.iter().map(|d| d.duration_s).sum();
    range(gait.stride_length_m / time, limits.speed_min_m_s, limits.speed_max_m_s);
    for (trajectory, domain) in gait.domains.iter().zip(CYCLE) {
        let (low, high) = (limits.duration_min_s, limits.duration_max_s);
        let (low, high) = match domain.kind {
            DomainKind::Ds2 => (low.ds2, high.ds2),
            DomainKind::Ds3 => (low.ds3, high.ds3),
            DomainKind::Ss2 => (low.ss2, high.ss2),
            DomainKind::Ss1 => (low.ss1, high.ss1),
        };
        range(trajectory.duration_s, low, high);
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::grid;

    #[test]
    fn no_point_between_nodes_is_one_where_the_solve_tightens_bounds() {
        let points: Vec<_> = grid(3, super::BETWEEN_NODES).collect();
        assert_eq!(points.iter().filter_map(|(_, node)| *node).collect::<Vec<_>>(), [0, 1, 2]);
        assert!(points.windows(2).all(|pair| pair[0].0 < pair[1].0) && points[0].0 == 0.0);
        assert_eq!(points.last().unwrap().0, 1.0);
        for (share, _) in points.iter().filter(|(_, node)| node.is_none()) {
            let tenths = 20.0 * share;
            assert!((tenths - tenths.round()).abs() > 0.04, "{share}");
        }
    }
}
