//! The continuous motion of a gait between its nodes.
//!
//! - Coordinates: the quintic through position, velocity and acceleration of adjacent nodes.
//! - Torques and forces: the parabola through the three nodes of a mesh interval.
//! - Fibre lengths: the cubic of Hermite-Simpson collocation, whose slope is the parabola through the fibre velocities.

use crate::gait::{DomainTrajectory, Gait, MuscleTrajectory};

/// The gait at one instant of a domain.
#[derive(Debug, Clone)]
pub(crate) struct GaitInstant {
    pub(crate) q: [f64; 9],
    pub(crate) qd: [f64; 9],
    pub(crate) qdd: [f64; 9],
    pub(crate) u: [f64; 6],
    pub(crate) forces: Vec<f64>,
    pub(crate) muscles: Option<MuscleInstant>,
}

/// The muscles at one instant.
#[derive(Debug, Clone)]
pub(crate) struct MuscleInstant {
    pub(crate) fibre_length: [f64; 10],
    /// Time derivative of the fibre length, 1/s.
    pub(crate) fibre_length_rate: [f64; 10],
    pub(crate) fibre_velocity: [f64; 10],
    pub(crate) activation: [f64; 10],
}

/// The gait at a fraction (0 to 1) of the duration of a well-formed domain.
pub(crate) fn instant(domain: &DomainTrajectory, share: f64) -> GaitInstant {
    let gaps = domain.q.len() - 1;
    let gap_length = domain.duration_s / gaps as f64;
    let position = share.clamp(0.0, 1.0) * gaps as f64;
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // 0 <= position <= gaps
    let gap = (position.floor() as usize).min(gaps - 1);
    let within = position - gap as f64;
    let mut result = GaitInstant {
        q: [0.0; 9],
        qd: [0.0; 9],
        qdd: [0.0; 9],
        u: [0.0; 6],
        forces: vec![0.0; domain.contact_rows.len()],
        muscles: None,
    };
    for i in 0..9 {
        let end = |k: usize| [domain.q[k][i], domain.qd[k][i] * gap_length, domain.qdd[k][i] * gap_length * gap_length];
        let [value, first, second] = quintic(end(gap), end(gap + 1), within);
        result.q[i] = value;
        result.qd[i] = first / gap_length;
        result.qdd[i] = second / (gap_length * gap_length);
    }
    let interval =
        MeshInterval { first: gap - gap % 2, share: 0.5 * ((gap % 2) as f64 + within), length: 2.0 * gap_length };
    for i in 0..6 {
        result.u[i] = interval.parabola(|k| domain.u[k][i]);
    }
    for (c, force) in result.forces.iter_mut().enumerate() {
        *force = interval.parabola(|k| domain.contact_forces[k][c]);
    }
    result.muscles = domain.muscles.as_ref().map(|muscles| interval.muscles(muscles));
    result
}

impl Gait {
    /// The gait with `parts` points for each node, for drawings. Coordinates and fibre lengths follow the continuous
    /// motion; the other quantities are interpolated linearly. A malformed gait is returned unchanged.
    #[must_use]
    pub fn refined(&self, parts: usize) -> Self {
        let mut refined = self.clone();
        if self.validate().is_ok() {
            refined.domains = self.domains.iter().map(|domain| refine(domain, parts.max(1))).collect();
        }
        refined
    }
}

fn refine(domain: &DomainTrajectory, parts: usize) -> DomainTrajectory {
    let gaps = domain.q.len() - 1;
    let places = || (0..=gaps * parts).map(|k| (k / parts, k % parts));
    let share = |part: usize| part as f64 / parts as f64;
    let linear = |value: &dyn Fn(usize) -> f64, (gap, part): (usize, usize)| {
        if part == 0 { value(gap) } else { value(gap) + share(part) * (value(gap + 1) - value(gap)) }
    };
    let instants: Vec<GaitInstant> =
        places().map(|(gap, part)| instant(domain, (gap as f64 + share(part)) / gaps as f64)).collect();
    DomainTrajectory {
        time_s: places().map(|place| linear(&|k| domain.time_s[k], place)).collect(),
        q: instants.iter().map(|instant| instant.q).collect(),
        qd: instants.iter().map(|instant| instant.qd).collect(),
        qdd: instants.iter().map(|instant| instant.qdd).collect(),
        u: places().map(|place| std::array::from_fn(|i| linear(&|k| domain.u[k][i], place))).collect(),
        contact_forces: places()
            .map(|place| {
                (0..domain.contact_rows.len()).map(|c| linear(&|k| domain.contact_forces[k][c], place)).collect()
            })
            .collect(),
        muscles: domain.muscles.as_ref().map(|muscles| MuscleTrajectory {
            fibre_length: instants.iter().filter_map(|instant| Some(instant.muscles.as_ref()?.fibre_length)).collect(),
            fibre_velocity: instants
                .iter()
                .filter_map(|instant| Some(instant.muscles.as_ref()?.fibre_length_rate))
                .collect(),
            activation: places()
                .map(|place| std::array::from_fn(|m| linear(&|k| muscles.activation[k][m], place)))
                .collect(),
        }),
        ..domain.clone()
    }
}

/// A mesh interval of three nodes, and a position in it.
struct MeshInterval {
    first: usize,
    share: f64,
    length: f64,
}

impl MeshInterval {
    fn parabola(&self, value: impl Fn(usize) -> f64) -> f64 {
        let [a, b, c] = [value(self.first), value(self.first + 1), value(self.first + 2)];
        let s = self.share;
        a * (1.0 - s) * (1.0 - 2.0 * s) + b * 4.0 * s * (1.0 - s) + c * s * (2.0 * s - 1.0)
    }

    fn muscles(&self, muscles: &MuscleTrajectory) -> MuscleInstant {
        let mut result = MuscleInstant {
            fibre_length: [0.0; 10],
            fibre_length_rate: [0.0; 10],
            fibre_velocity: [0.0; 10],
            activation: [0.0; 10],
        };
        for m in 0..10 {
            let end = |k: usize| [muscles.fibre_length[k][m], muscles.fibre_velocity[k][m] * self.length];
            let [value, first] = cubic(end(self.first), end(self.first + 2), self.share);
            result.fibre_length[m] = value;
            result.fibre_length_rate[m] = first / self.length;
            result.fibre_velocity[m] = self.parabola(|k| muscles.fibre_velocity[k][m]);
            result.activation[m] = self.parabola(|k| muscles.activation[k][m]);
        }
        result
    }
}

/// Value and two derivatives at `s` of the quintic on \[0, 1\] with the given value and two derivatives at both ends.
fn quintic(a: [f64; 3], b: [f64; 3], s: f64) -> [f64; 3] {
    let [value, slope, curvature] = [a[0], a[1], 0.5 * a[2]];
    let rest = [b[0] - value - slope - curvature, b[1] - slope - 2.0 * curvature, 0.5 * b[2] - curvature];
    let c3 = 10.0 * rest[0] - 4.0 * rest[1] + rest[2];
    let c4 = -15.0 * rest[0] + 7.0 * rest[1] - 2.0 * rest[2];
    let c5 = 6.0 * rest[0] - 3.0 * rest[1] + rest[2];
    [
        value + s * (slope + s * (curvature + s * (c3 + s * (c4 + s * c5)))),
        slope + s * (2.0 * curvature + s * (3.0 * c3 + s * (4.0 * c4 + s * 5.0 * c5))),
        2.0 * curvature + s * (6.0 * c3 + s * (12.0 * c4 + s * 20.0 * c5)),
    ]
}

/// Value and derivative at `s` of the cubic on \[0, 1\] with the given value and derivative at both ends.
fn cubic(a: [f64; 2], b: [f64; 2], s: f64) -> [f64; 2] {
    let change = b[0] - a[0];
    let c2 = 3.0 * change - 2.0 * a[1] - b[1];
    let c3 = -2.0 * change + a[1] + b[1];
    [a[0] + s * (a[1] + s * (c2 + s * c3)), a[1] + s * (2.0 * c2 + s * 3.0 * c3)]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `(1 - 2 t)^n` with two derivatives.
    fn power(n: i32, t: f64) -> [f64; 3] {
        let x = 1.0 - 2.0 * t;
        let n1 = f64::from(n);
        [x.powi(n), -2.0 * n1 * x.powi(n - 1), 4.0 * n1 * (n1 - 1.0) * x.powi(n - 2)]
    }

    #[test]
    fn refined_domain_keeps_its_nodes_and_is_smooth_between_them() {
        let points = 5;
        let at = |k: usize| power(5, k as f64 / (points - 1) as f64);
        let row = |value: f64| [value; 9];
        let domain = DomainTrajectory {
            name: "SS2_R".to_owned(),
            duration_s: 1.0,
            time_s: (0..points).map(|k| 0.25 * k as f64).collect(),
            q: (0..points).map(|k| row(at(k)[0])).collect(),
            qd: (0..points).map(|k| row(at(k)[1])).collect(),
            qdd: (0..points).map(|k| row(at(k)[2])).collect(),
            u: (0..points).map(|k| [k as f64; 6]).collect(),
            contact_rows: Vec::new(),
            contact_forces: vec![Vec::new(); points],
            muscles: None,
            outputs: Vec::new(),
            bezier: Vec::new(),
            phase_start_m: 0.0,
            phase_end_m: 1.0,
            impulse: None,
        };
        let refined = refine(&domain, 3);
        assert_eq!(refined.q.len(), 13);
        for k in 0..points {
            assert!((refined.q[3 * k][4] - domain.q[k][4]).abs() < 1e-12);
            assert_eq!(refined.u[3 * k], domain.u[k]);
        }
        for (time, (q, qd)) in refined.time_s.iter().zip(refined.q.iter().zip(&refined.qd)) {
            let wanted = power(5, *time);
            assert!((q[0] - wanted[0]).abs() < 1e-12 && (qd[0] - wanted[1]).abs() < 1e-11, "{time}");
        }
        assert!((refined.u[1][0] - 1.0 / 3.0).abs() < 1e-12);
    }

    #[test]
    fn interpolation_reproduces_polynomials_of_its_degree() {
        for s in [0.0, 0.13, 0.5, 0.77, 1.0] {
            let wanted = power(5, s);
            for (found, wanted) in quintic(power(5, 0.0), power(5, 1.0), s).into_iter().zip(wanted) {
                assert!((found - wanted).abs() < 1e-12, "{found} {wanted}");
            }
            let end = |t: f64| [power(3, t)[0], power(3, t)[1]];
            for (found, wanted) in cubic(end(0.0), end(1.0), s).into_iter().zip(power(3, s)) {
                assert!((found - wanted).abs() < 1e-12, "{found} {wanted}");
            }
            let interval = MeshInterval { first: 4, share: s, length: 2.0 };
            let found = interval.parabola(|k| power(2, (k as f64 - 4.0) / 2.0)[0]);
            assert!((found - power(2, s)[0]).abs() < 1e-12);
        }
    }
}
