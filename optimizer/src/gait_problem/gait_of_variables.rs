//! Conversion of variables to a gait in physical units.

use super::problem_definition::GaitProblem;
use super::program_data::GaitProgram;
use crate::gait::{ContactRowName, DomainTrajectory, FORMAT_VERSION, Gait, MuscleTrajectory};
use crate::walking::BEZIER_COEFFICIENTS;

/// The gait of a vector of variables.
pub fn gait_of(problem: &GaitProblem, program: &GaitProgram, x: &[f64]) -> Gait {
    let layout = &program.layout;
    let value = |index: usize| layout.value(x, index);
    let mut elapsed = 0.0;
    let domains: Vec<DomainTrajectory> = layout
        .domains
        .iter()
        .enumerate()
        .map(|(d, domain)| {
            let points: Vec<_> = (0..domain.points).map(|k| layout.point_variables(x, d, k)).collect();
            let duration_s = value(domain.duration);
            let start = elapsed;
            elapsed += duration_s;
            let phase_start_m = value(domain.phase_start);
            let phase_end_m = match (domain.phase_end, domain.hip_velocity) {
                (Some(end), _) => value(end),
                (None, Some(hip_velocity)) => phase_start_m + value(hip_velocity) * duration_s,
                (None, None) => phase_start_m,
            };
            DomainTrajectory {
                name: domain.domain.name().to_owned(),
                duration_s,
                time_s: (0..domain.points).map(|k| start + domain.sigma(k) * duration_s).collect(),
                q: points.iter().map(|p| p.q).collect(),
                qd: points.iter().map(|p| p.qd).collect(),
                qdd: points.iter().map(|p| p.qdd).collect(),
                u: points.iter().map(|p| p.u).collect(),
                contact_rows: domain
                    .domain
                    .contact_rows()
                    .into_iter()
                    .map(|row| ContactRowName { point: row.point, side: row.side, axis: row.axis })
                    .collect(),
                contact_forces: points.iter().map(|p| p.force[..domain.contacts].to_vec()).collect(),
                muscles: layout.muscles.then(|| MuscleTrajectory {
                    fibre_length: points.iter().map(|p| p.fibre_length).collect(),
                    fibre_velocity: points.iter().map(|p| p.fibre_velocity).collect(),
                    activation: points.iter().map(|p| p.activation).collect(),
                }),
                outputs: domain.outputs.clone(),
                bezier: (0..domain.outputs.len())
                    .map(|j| (0..BEZIER_COEFFICIENTS).map(|i| value(domain.bezier_coefficient(j, i))).collect())
                    .collect(),
                phase_start_m,
                phase_end_m,
                impulse: domain.impulse.map(|first| (0..domain.contacts).map(|c| value(first + c)).collect()),
            }
        })
        .collect();
    let stride_length_m = value(layout.stride_length);
    Gait {
        format_version: FORMAT_VERSION,
        subject: problem.subject,
        device: problem.device.clone(),
        muscles: layout.muscles,
        bounds: problem.bounds,
        settings: problem.settings,
        speed_m_s: stride_length_m / elapsed,
        stride_length_m,
        right_step_length_m: value(layout.right_step_length),
        stride_time_s: elapsed,
        hip_velocity_m_s: std::array::from_fn(|i| value(layout.hip_velocities + i)),
        domains,
    }
}
