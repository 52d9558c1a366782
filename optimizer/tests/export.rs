//! Tests of exported files of the golden gaits.

#![allow(clippy::unwrap_used)]

mod golden_gaits;

use gait_optimizer::ModelError;
use gait_optimizer::export::{ControllerFile, motion_file};
use golden_gaits::golden_gait;
use serde_json::Value;
use std::collections::BTreeSet;

#[test]
fn controller_file_reproduces_the_gait_at_domain_ends() {
    for (subject, muscles) in [(1, false), (1, true), (2, false), (2, true)] {
        let (_, gait) = golden_gait(subject, muscles);
        let text = serde_json::to_string_pretty(&ControllerFile::new(&gait, 200.0).unwrap()).unwrap();
        let file = ControllerFile::from_json(&text).unwrap();
        let angles = ["torso", "hip_L", "knee_L", "ankle_L", "hip_R", "knee_R", "ankle_R"];
        assert_eq!(file.domains.len(), gait.domains.len());
        for (domain, planned) in file.domains.iter().zip(&gait.domains) {
            assert!(!domain.outputs.is_empty(), "{}", domain.name);
            for (q, s) in [(&planned.q[0], 0.0), (planned.q.last().unwrap(), 1.0)] {
                let position: f64 =
                    angles.iter().enumerate().map(|(i, name)| domain.phase_gradient_m_per_rad[*name] * q[2 + i]).sum();
                let phase = (position - domain.phase_start_m) / (domain.phase_end_m - domain.phase_start_m);
                assert!((phase - s).abs() < 1e-6, "{} {phase}", domain.name);
                for output in &domain.outputs {
                    let index = 2 + angles.iter().position(|name| *name == output.joint).unwrap();
                    assert!((output.at(s) - q[index]).abs() < 1e-6, "{} {}", domain.name, output.joint);
                }
            }
        }
        let trajectory = &file.trajectory;
        let end = trajectory.time_s.len() - 1;
        assert!(trajectory.time_s[..end].iter().enumerate().all(|(k, time)| (time - k as f64 / 200.0).abs() < 1e-12));
        assert!((trajectory.time_s[end] - gait.stride_time_s).abs() < 1e-12);
        for (set_point, q) in [(&trajectory.knee_rad, 7), (&trajectory.ankle_rad, 8)] {
            assert!((set_point[0] - gait.domains[0].q[0][q]).abs() < 1e-12);
            assert!((set_point[end] - set_point[0]).abs() < 1e-9, "periodic");
        }
        // Velocities are the derivatives of the set points, except at impacts.
        for k in 1..end - 1 {
            let near = |start: &f64| (start - trajectory.time_s[k]).abs() < 0.006;
            if gait.domains.iter().any(|domain| near(&domain.time_s[0])) {
                continue;
            }
            let slope = (trajectory.knee_rad[k + 1] - trajectory.knee_rad[k - 1]) * 100.0;
            assert!((slope - trajectory.knee_rad_s[k]).abs() < 0.2, "{k}: {slope} {}", trajectory.knee_rad_s[k]);
        }
        let whole: Value = serde_json::from_str(&text).unwrap();
        for name in names("", &whole) {
            let explained = file.fields.get(&name).is_some_and(|words| !words.is_empty());
            assert!(explained, "{name} has no description");
        }
    }
}

/// The paths of all fields of a document, except keys that are names of joints or fields.
fn names(path: &str, value: &Value) -> BTreeSet<String> {
    match value {
        Value::Array(all) => all.iter().flat_map(|one| names(path, one)).collect(),
        Value::Object(fields) if !["fields", "domains.phase_gradient_m_per_rad"].contains(&path) => {
            let named = |(name, value): (&String, &Value)| {
                let path = if path.is_empty() { name.clone() } else { format!("{path}.{name}") };
                names(&path, value).into_iter().chain([path])
            };
            fields.iter().flat_map(named).collect()
        }
        _ => BTreeSet::new(),
    }
}

#[test]
fn malformed_controller_files_are_rejected_with_the_place() {
    let (_, gait) = golden_gait(1, false);
    let file = ControllerFile::new(&gait, 100.0).unwrap();
    let refused = |file: &ControllerFile| {
        ControllerFile::from_json(&serde_json::to_string(file).unwrap()).unwrap_err().to_string()
    };
    let mut other = file.clone();
    other.format_version = 9;
    assert!(refused(&other).contains("version 9"));
    let mut other = file.clone();
    other.domains.swap(1, 2);
    assert!(refused(&other).contains("in order"));
    let mut other = file;
    other.trajectory.ankle_rad.pop();
    assert!(refused(&other).contains("must have the same length"));
    assert!(ControllerFile::from_json("{\n \"format\": 3}").unwrap_err().to_string().contains("line 2"));
}

#[test]
fn sampling_rates_out_of_range_are_rejected_by_name() {
    let (_, gait) = golden_gait(1, false);
    for rate in [0.0, f64::NAN, 1e6] {
        assert!(matches!(motion_file(&gait, rate), Err(ModelError::OutOfRange { field, .. }) if field == "rate_hz"));
    }
}

#[test]
fn motion_file_has_the_header_and_signs_of_opensim() {
    let (_, gait) = golden_gait(1, false);
    let text = motion_file(&gait, 100.0).unwrap();
    let (header, body) = text.split_once("endheader\n").unwrap();
    let mut lines = body.lines();
    let names: Vec<&str> = lines.next().unwrap().split('\t').collect();
    let rows: Vec<Vec<f64>> = lines.map(|line| line.split('\t').map(|cell| cell.parse().unwrap()).collect()).collect();
    assert!(header.contains(&format!("nRows={}\nnColumns={}\ninDegrees=yes", rows.len(), names.len())));
    assert!(rows.iter().all(|row| row.len() == names.len()));
    let column = |name: &str| names.iter().position(|n| *n == name).unwrap();
    let first = gait.domains[0].q[0];
    assert!((rows[0][column("knee_angle_l")] + first[4].to_degrees()).abs() < 1e-7);
    assert!((rows[0][column("pelvis_tilt")] + first[2].to_degrees()).abs() < 1e-7);
    assert!((rows[0][column("pelvis_ty")] - first[1]).abs() < 1e-7);
    assert!((rows.last().unwrap()[0] - gait.stride_time_s).abs() < 1e-7);
}
