//! Tests of limit cycles: velocities of a known motion, columns and signs of both formats, and rejected files.

#![allow(clippy::unwrap_used, clippy::panic)]

use gait_optimizer::limit_cycle::JointRecording;
use gait_optimizer::reference::AngleUnit;
use std::f64::consts::TAU;
use std::fmt::Write;

/// 10 s at 100 Hz of a knee that oscillates with amplitude 0.5 rad and frequency 0.9 Hz.
fn csv() -> String {
    let mut text = "# site A\ntime_s,knee_R_rad\n".to_owned();
    for k in 0..1000 {
        let time = f64::from(k) / 100.0;
        writeln!(text, "{time},{}", knee_at(time)).unwrap();
    }
    text
}

fn knee_at(time: f64) -> f64 {
    0.5 + 0.5 * (TAU * 0.9 * time).sin()
}

#[test]
fn velocity_matches_the_motion() {
    let limit_cycles = JointRecording::from_csv("walk.csv", &csv()).unwrap().limit_cycles(6.0).unwrap();
    let [knee] = &limit_cycles[..] else { panic!("{limit_cycles:?}") };
    assert_eq!((knee.joint.as_str(), knee.angle_rad.len(), knee.velocity_rad_s.len()), ("knee_R", 998, 998));
    // Away from the ends, where the filter extrapolates. The limit cycle begins with sample 1.
    for k in 100..900 {
        let time = (k + 1) as f64 / 100.0;
        let (angle, velocity) = (knee_at(time), 0.5 * TAU * 0.9 * (TAU * 0.9 * time).cos());
        assert!((knee.angle_rad[k] - angle).abs() < 1e-4, "{k}");
        assert!((knee.velocity_rad_s[k] - velocity).abs() < 2e-3, "{k}: {} {velocity}", knee.velocity_rad_s[k]);
    }
}

#[test]
fn unevenly_spaced_rows_are_interpolated_on_an_even_grid() {
    // A last row at the end of the stride, as in exported motion files, and one extra row.
    let text = csv() + "9.993,0.5\n";
    let text = text.replace("\n0.5,", "\n0.494,0.1\n0.5,");
    let recording = JointRecording::from_csv("walk.csv", &text).unwrap();
    assert_eq!(recording.joints[0].1.len(), 1002);
    assert!((recording.rate_hz - 1001.0 / 9.993).abs() < 1e-9);
    let knee = &recording.joints[0].1;
    let time = 700.0 / recording.rate_hz;
    // Linear interpolation over 10 ms has an error of at most h^2/8 times the second derivative.
    assert!((knee[700] - knee_at(time)).abs() < 0.5 * (TAU * 0.9 * 0.01).powi(2) / 8.0 + 1e-12);
    assert!((knee[1001] - 0.5).abs() < 1e-12);
}

fn opensim(unit: &str) -> String {
    let mut text = format!("walk\nversion=1\nnRows=60\nnColumns=6\n{unit}endheader\n");
    text.push_str("time pelvis_tilt lumbar_extension hip_flexion_r knee_angle_r ankle_angle_r\n");
    for k in 0..60 {
        writeln!(text, "{} -3 -2 20 -10 {k}", f64::from(k) / 100.0).unwrap();
    }
    text
}

#[test]
fn opensim_columns_get_the_signs_of_the_walker() {
    let recording = JointRecording::from_opensim("walk.mot", &opensim("inDegrees=yes\n"), None).unwrap();
    let first: Vec<(&str, f64)> =
        recording.joints.iter().map(|(name, angles)| (*name, angles[1].to_degrees().round())).collect();
    assert_eq!(first, [("torso", 5.0), ("hip_R", 22.0), ("knee_R", 10.0), ("ankle_R", 1.0)]);
    let silent = JointRecording::from_opensim("walk.mot", &opensim(""), None).unwrap_err().to_string();
    assert!(silent.contains("neither inDegrees=yes nor inDegrees=no"), "{silent}");
    assert!(JointRecording::from_opensim("walk.mot", &opensim(""), Some(AngleUnit::Degrees)).is_ok());
}

#[test]
fn incomplete_recordings_are_rejected_with_their_place() {
    let refusal = |text: &str| JointRecording::from_csv("walk.csv", text).unwrap_err().to_string();
    assert!(refusal(&csv().replace("\n0.5,", "\n0.5,x")).contains("walk.csv, line 53, column 2"));
    assert!(refusal(&csv().replace("\n0.5,", "\n0.5,9")).contains("walk.csv, line 53"), "an angle of more than pi");
    let unnamed = refusal(&csv().replace("knee_R_rad", "knee"));
    assert!(unnamed.contains("no column has the name of a joint angle; the columns are knee"), "{unnamed}");
    let gap: Vec<String> = csv().lines().filter(|line| !line.starts_with("0.5")).map(str::to_owned).collect();
    assert!(
        refusal(&gap.join("\n")).contains("walk.csv, line 53, column 1: there is a gap of 0.110 s between rows"),
        "0.49 s, then 0.6 s"
    );
    let short: Vec<String> = csv().lines().take(62).map(str::to_owned).collect();
    let short = JointRecording::from_csv("walk.csv", &short.join("\n")).unwrap().check_walking("walk.csv");
    let reason = "walk.csv: the recording lasts 0.590 s; a limit cycle needs at least 2 s.";
    assert_eq!(short.unwrap_err().to_string(), reason);
    let recording = JointRecording::from_csv("walk.csv", &csv()).unwrap();
    assert_eq!(recording.check_walking("walk.csv"), Ok(()));
    assert!(recording.limit_cycles(60.0).unwrap_err().to_string().starts_with("cutoff_hz is 60; it must be"));
}

/// A table of joints over time with a given spacing of rows in s.
fn table(names: &str, rows: usize, step_s: f64, at: impl Fn(f64) -> Vec<f64>) -> String {
    let mut text = format!("time_s,{names}\n");
    for k in 0..rows {
        let time = step_s * k as f64;
        let cells: Vec<String> = at(time).iter().map(ToString::to_string).collect();
        writeln!(text, "{time},{}", cells.join(",")).unwrap();
    }
    text
}

#[test]
fn recordings_without_walking_are_rejected() {
    let swing = |time: f64| (TAU * 0.9 * time).sin();
    let check = |text: &str| JointRecording::from_csv("walk.csv", text).unwrap().check_walking("walk.csv");
    let refused = |text: &str| check(text).unwrap_err().to_string();
    let still = refused(&table("torso_rad,ankle_R_rad", 300, 0.01, |time| vec![0.1, 0.024 * swing(time)]));
    let expected = "walk.csv: no joint moves by more than 0.05 rad (the largest range is 0.048 rad); check the unit.";
    assert_eq!(still, expected);
    let backward = refused(&table("hip_R_rad,knee_R_rad", 300, 0.01, |time| vec![swing(time), -knee_at(time)]));
    assert_eq!(
        backward,
        "walk.csv: knee_R ranges from -1.00 to -0.00 rad, but flexion must be positive; check the sign of the knee angle."
    );
    let stiff = refused(&table("hip_R_rad,knee_L_rad", 300, 0.01, |time| vec![swing(time), 0.04 * knee_at(time)]));
    assert_eq!(stiff, "walk.csv: knee_L moves by only 0.040 rad, less than 0.1 rad; check the unit.");
    let jump = |time: f64| if time > 1.5005 { 0.9 } else { 0.0 };
    let jumps = refused(&table("hip_R_rad,ankle_R_rad", 300, 0.01, |time| vec![swing(time), jump(time)]));
    assert_eq!(jumps, "walk.csv: ankle_R jumps by 0.90 rad in 0.0100 s, 1.510 s after the first row.");
    // Trunk and ankle may move little if other joints walk.
    assert_eq!(check(&table("torso_rad,hip_R_rad", 300, 0.01, |time| vec![0.1, swing(time)])), Ok(()));
}

#[test]
fn two_seconds_at_twenty_hertz_are_sufficient() {
    let text = table("knee_R_rad", 41, 0.05, |time| vec![knee_at(time)]);
    let recording = JointRecording::from_csv("walk.csv", &text).unwrap();
    assert_eq!(recording.check_walking("walk.csv"), Ok(()));
    assert!(recording.limit_cycles(6.0).is_ok());
    let later = table("knee_R_rad", 400, 0.05, |time| vec![knee_at(time)]);
    assert!(JointRecording::from_csv("walk.csv", &later).is_ok());
    let slower = JointRecording::from_csv("walk.csv", &table("knee_R_rad", 41, 0.0501, |time| vec![knee_at(time)]));
    assert!(slower.unwrap_err().to_string().contains("a gap of 0.050 s between rows; gaps may be at most 0.05 s long"));
}
