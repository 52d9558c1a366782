//! Validation of gaits from files: dimensions, order, times and ranges.

use super::{DomainTrajectory, Gait};
use crate::model_error::ModelError;
use crate::walking::{BEZIER_COEFFICIENTS, CYCLE, Domain};

/// Tolerance for redundant quantities, s or m/s.
const ROUNDING: f64 = 1e-6;

impl Gait {
    /// Checks the ranges of subject, device, bounds and settings, and the order, lengths, times and numbers of the
    /// eight domains.
    ///
    /// # Errors
    /// [`ModelError`] with the field and the reason.
    pub fn validate(&self) -> Result<(), ModelError> {
        let version = f64::from(self.format_version);
        ModelError::check_range("format_version", version, 1.0, f64::from(crate::gait::FORMAT_VERSION))?;
        self.subject.validate()?;
        self.device.validate()?;
        self.bounds.validate()?;
        self.settings.validate()?;
        ModelError::check_range("number of domains", self.domains.len() as f64, 8.0, 8.0)?;
        ModelError::check_range("stride_length_m", self.stride_length_m, 0.01, 10.0)?;
        let mut elapsed = 0.0;
        for (trajectory, domain) in self.domains.iter().zip(CYCLE) {
            check(trajectory, domain, self.muscles)
                .and_then(|()| check_times(trajectory, elapsed))
                .map_err(|reason| ModelError::Malformed { what: format!("gait, domain {}", domain.name()), reason })?;
            elapsed += trajectory.duration_s;
        }
        for (field, found, expected, of) in [
            ("stride_time_s", self.stride_time_s, elapsed, ("s", "the sum of the durations of the domains")),
            (
                "speed_m_s",
                self.speed_m_s,
                self.stride_length_m / elapsed,
                ("m/s", "the stride length divided by the stride time"),
            ),
        ] {
            ModelError::check_related_range(field, found, (expected - ROUNDING, expected + ROUNDING), of)?;
        }
        Ok(())
    }
}

/// Checks that the nodes are evenly spaced from the end of the previous domain. The error is the reason.
fn check_times(trajectory: &DomainTrajectory, start_s: f64) -> Result<(), String> {
    let gaps = (trajectory.time_s.len() - 1) as f64;
    let planned = |k: usize| start_s + trajectory.duration_s * k as f64 / gaps;
    let in_time = |(k, time): (usize, &f64)| (time - planned(k)).abs() <= ROUNDING;
    match trajectory.time_s.iter().enumerate().position(|point| !in_time(point)) {
        Some(k) => Err(format!(
            "time_s[{k}] is {}; it must be {:.6}, computed from the durations",
            trajectory.time_s[k],
            planned(k)
        )),
        None => Ok(()),
    }
}

/// Checks that a trajectory belongs to the domain. The error is the reason.
fn check(trajectory: &DomainTrajectory, domain: Domain, muscles: bool) -> Result<(), String> {
    if trajectory.name != domain.name() {
        return Err(format!("the name is {:?}; it must be {:?}", trajectory.name, domain.name()));
    }
    let points = trajectory.q.len();
    if points < 3 || points.is_multiple_of(2) {
        return Err(format!("the number of nodes is {points}; it must be odd and at least 3"));
    }
    let contacts = domain.contact_rows();
    let outputs = domain.outputs();
    let same_rows = trajectory.contact_rows.len() == contacts.len()
        && trajectory
            .contact_rows
            .iter()
            .zip(&contacts)
            .all(|(name, row)| (name.point, name.side, name.axis) == (row.point, row.side, row.axis));
    if !same_rows {
        return Err("contact_rows do not match the domain".to_owned());
    }
    if trajectory.outputs != outputs {
        return Err(format!("outputs are {:?}; they must be {outputs:?}", trajectory.outputs));
    }
    let mut lengths = vec![
        ("time_s", trajectory.time_s.len(), points),
        ("qd", trajectory.qd.len(), points),
        ("qdd", trajectory.qdd.len(), points),
        ("u", trajectory.u.len(), points),
        ("contact_forces", trajectory.contact_forces.len(), points),
        ("bezier", trajectory.bezier.len(), outputs.len()),
    ];
    lengths.extend(trajectory.contact_forces.iter().map(|f| ("contact_forces", f.len(), contacts.len())));
    lengths.extend(trajectory.bezier.iter().map(|row| ("bezier", row.len(), BEZIER_COEFFICIENTS)));
    if muscles != trajectory.muscles.is_some() {
        let reason = if muscles {
            "muscle states are missing, although `muscles` is true"
        } else {
            "muscle states are present, although `muscles` is false"
        };
        return Err(reason.to_owned());
    }
    if let Some(states) = &trajectory.muscles {
        lengths.push(("fibre_length", states.fibre_length.len(), points));
        lengths.push(("fibre_velocity", states.fibre_velocity.len(), points));
        lengths.push(("activation", states.activation.len(), points));
    }
    if let Some((name, found, expected)) = lengths.into_iter().find(|(_, found, expected)| found != expected) {
        return Err(format!("{name} has {found} entries; it must have {expected}"));
    }
    let impulses = trajectory.impulse.as_ref().map(Vec::len);
    let expected = domain.opens_with_impact().then_some(contacts.len());
    if impulses != expected {
        let found = impulses.map_or_else(|| "is absent".to_owned(), |count| format!("has {count} entries"));
        let wanted = expected.map_or_else(|| "be absent".to_owned(), |count| format!("have {count} entries"));
        return Err(format!("impulse {found}; it must {wanted}"));
    }
    let forward = trajectory.phase_end_m > trajectory.phase_start_m;
    if !(forward && trajectory.duration_s > 0.0 && trajectory.duration_s.is_finite()) {
        return Err("duration_s and phase_end_m - phase_start_m must be positive".to_owned());
    }
    let angles = trajectory.q.iter().chain(&trajectory.qd).chain(&trajectory.qdd).flatten();
    let efforts = trajectory.u.iter().flatten().chain(trajectory.contact_forces.iter().flatten());
    let curves = trajectory.bezier.iter().flatten().chain(trajectory.impulse.iter().flatten());
    if angles.chain(efforts).chain(curves).all(|value| value.is_finite()) {
        Ok(())
    } else {
        Err("a number is not finite".to_owned())
    }
}
