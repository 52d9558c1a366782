//! Tests of reference gaits from recordings: file formats, segmentation of strides, and rejected recordings.

#![allow(clippy::unwrap_used)]

mod golden_gaits;
mod noise;
mod synthetic_recordings;

use gait_optimizer::export::motion_file;
use gait_optimizer::reference::{
    AngleUnit, HeelStrikes, MeasuredPerson, MotionRecording, VerticalForce, distance, nearest,
};
use gait_optimizer::{ModelError, ReferenceGait, Subject};
use golden_gaits::golden_gait;
use noise::noise;
use std::f64::consts::TAU;
use std::fmt::Write;
use synthetic_recordings::{opensim, opensim_rows};

fn read(text: &str) -> Result<MotionRecording, ModelError> {
    MotionRecording::from_opensim("walk.mot", text, None, Some("right_vy"))
}

#[test]
fn opensim_signs_are_converted_to_those_of_the_walker() {
    let recording = read(&opensim(2)).unwrap();
    let [torso, hip_l, knee_l, ankle_l, hip_r] = recording.angles_rad[0];
    assert!((torso - 7.0_f64.to_radians()).abs() < 1e-9, "lean = -(tilt + lumbar)");
    assert!((hip_r - 39.0_f64.to_radians()).abs() < 1e-9, "hip from the torso = hip - lumbar");
    assert!((hip_l + 11.0_f64.to_radians()).abs() < 1e-9);
    assert!((knee_l - 45.0_f64.to_radians()).abs() < 1e-9, "flexion positive");
    assert!(ankle_l.abs() < 1e-9);
    let radians = opensim(2).replace("inDegrees=yes", "inDegrees=no");
    assert!(read(&radians).unwrap_err().to_string().contains("check the unit"));
}

#[test]
fn three_methods_find_the_same_heel_strikes() {
    let recording = read(&opensim(5)).unwrap();
    let by_force = recording.heel_strikes(&HeelStrikes::Force).unwrap();
    assert_eq!(by_force.len(), 4, "{by_force:?}");
    for (k, time) in by_force.iter().enumerate() {
        assert!((time - 1.1 * (k + 1) as f64).abs() < 0.011, "{time}");
    }
    let by_kinematics = recording.heel_strikes(&HeelStrikes::Kinematics).unwrap();
    assert_eq!(by_kinematics.len(), 4, "{by_kinematics:?}");
    for pair in by_kinematics.windows(2) {
        assert!((pair[1] - pair[0] - 1.1).abs() < 0.011, "{pair:?}");
    }
    let given = HeelStrikes::Given(vec![0.0, 1.1, 2.2]);
    assert_eq!(recording.heel_strikes(&given).unwrap(), [0.0, 1.1, 2.2]);
}

#[test]
fn every_variant_of_opensim_files_gives_the_same_recording() {
    let names = "time\tpelvis_tilt\thip_flexion_r\tknee_angle_r\tankle_angle_r\thip_flexion_l\tknee_angle_l\tankle_angle_l\t\
                 lumbar_extension\tright_vy";
    let rows = opensim_rows(2, 1.0);
    let whole = read(&opensim(2)).unwrap();
    let same = |form: &str, text: &str, unit: Option<AngleUnit>| {
        let found = MotionRecording::from_opensim(form, text, unit, Some("right_vy")).unwrap();
        assert_eq!(found.angles_rad.len(), whole.angles_rad.len(), "{form}");
        for (ours, theirs) in found.angles_rad.iter().flatten().zip(whole.angles_rad.iter().flatten()) {
            assert!((ours - theirs).abs() < 1e-7, "{form}: {ours} {theirs}");
        }
        assert_eq!(found.right_force, whole.right_force, "{form}");
    };
    // Inverse kinematics of OpenSim 3 and 4, whose header explains inDegrees.
    let explained = "Units are S.I. units (second, meters, Newtons, ...)\nIf the header above contains a line with \
                     'inDegrees', this indicates whether rotational values are in degrees (yes) or radians (no).\n";
    let ik = format!(
        "Coordinates\nversion=1\nnRows=221\nnColumns=10\ninDegrees=yes\n\n{explained}\nendheader\n{names}\n{rows}"
    );
    same("inverse kinematics", &ik, None);
    same("lines as Windows ends them", &ik.replace('\n', "\r\n"), None);
    let padded = ik.replace('\n', "\t\n");
    same("a tab at the end of each line", &padded, None);
    let spaced = format!(
        "walk\nnRows = 221\nnColumns = 10\ninDegrees = yes\nendheader\n{}\n{}",
        names.replace('\t', "  "),
        rows.replace('\t', "   ")
    );
    same("blanks in place of tabs", &spaced, None);
    // A table of OpenSim 4 in radians, without numbers of rows.
    let radians = opensim_rows(2, std::f64::consts::PI / 180.0);
    let table = format!(
        "inDegrees=no\nDataType=double\nversion=3\nOpenSimVersion=4.5-2024-01-10\nendheader\n{names}\n{radians}"
    );
    same("storage file of OpenSim 4", &table, None);
    // States of OpenSim Moco, with paths as names.
    let path = |name: &str| match name {
        "time" | "right_vy" => name.to_owned(),
        other => format!("/jointset/somewhere/{other}/value"),
    };
    let paths: Vec<String> = names.split('\t').map(path).collect();
    same("states by path", &table.replace(names, &paths.join("\t")), None);
    // SIMM: the header has no unit.
    let simm = format!("name walk.mot\ndatacolumns 10\ndatarows 221\nrange 0 2.2\nendheader\n{names}\n{rows}");
    assert!(MotionRecording::from_opensim("walk.mot", &simm, None, None).is_err());
    same("motion file of SIMM", &simm, Some(AngleUnit::Degrees));
    // A unit that contradicts the header is an error.
    let refused = MotionRecording::from_opensim("walk.mot", &opensim(2), Some(AngleUnit::Radians), None);
    let refused = refused.unwrap_err().to_string();
    assert!(refused.contains("the header gives angles in degrees, but the unit given is radians"), "{refused}");
    let half = simm.replace("datarows 221", "datarows 220");
    let refused =
        MotionRecording::from_opensim("walk.mot", &half, Some(AngleUnit::Degrees), None).unwrap_err().to_string();
    assert!(refused.contains("line 3: the header has datarows=220, but the file has 221"), "{refused}");
}

#[test]
fn forces_from_a_separate_file_have_their_own_rate() {
    // As in OpenSim's examples: two plates, ten times the sampling rate, and an earlier start.
    let mut forces =
        "walk_grf.mot\nversion=1\nnRows=6001\nnColumns=4\ninDegrees=yes\nendheader\ntime\tground_force_vx\t\
                      ground_force_vy\t1_ground_force_vy\n"
            .to_owned();
    for k in 0..6001 {
        let time = f64::from(k) / 1000.0 - 0.3;
        let force = if (time / 1.1).rem_euclid(1.0) < 0.6 { 700.0 } else { 0.0 };
        writeln!(forces, "{time:.3}\t0\t{force}\t{}", 700.0 - force).unwrap();
    }
    let motion = MotionRecording::from_opensim("walk.mot", &opensim(5), None, None).unwrap();
    let recording = motion.clone().with_force_file("walk_grf.mot", &forces, "ground_force_vy").unwrap();
    let strikes = recording.heel_strikes(&HeelStrikes::Force).unwrap();
    assert_eq!(strikes.len(), 5, "those within the motion: {strikes:?}");
    for (k, strike) in strikes.iter().enumerate() {
        assert!((strike - 1.1 * k as f64).abs() < 2e-3 || (strike - 1.1 * (k + 1) as f64).abs() < 2e-3, "{strikes:?}");
    }
    let reference = recording.reference("x", &HeelStrikes::Force, MeasuredPerson::default()).unwrap();
    assert!(
        reference.provenance.contains("walk_grf.mot: 6001 rows, ground_force_vy is the force under the right foot")
    );
    let refused = motion.with_force_file("walk_grf.mot", &forces, "fy").unwrap_err().to_string();
    assert!(refused.starts_with("walk_grf.mot, line 7: column \"fy\" is missing; the columns are time, "), "{refused}");
}

#[test]
fn camargo_forces_segment_the_strides() {
    let mut forces = "Header,Treadmill_R_vx,Treadmill_R_vy\n".to_owned();
    for k in 0..5501 {
        let time = f64::from(k) / 1000.0;
        let force = if (time / 1.1).rem_euclid(1.0) < 0.6 { 700.0 } else { 0.0 };
        writeln!(forces, "{time:.3},0,{force}").unwrap();
    }
    let motion = MotionRecording::from_camargo_csv("ik.csv", &synthetic_recordings::camargo(5)).unwrap();
    let recording = motion.with_camargo_forces("fp.csv", &forces, "Treadmill_R_vy").unwrap();
    let strikes = recording.heel_strikes(&HeelStrikes::Force).unwrap();
    for (k, strike) in strikes.iter().enumerate() {
        assert!((strike - 1.1 * (k + 1) as f64).abs() < 2e-3, "{strikes:?}");
    }
    let provenance = recording.reference("x", &HeelStrikes::Force, MeasuredPerson::default()).unwrap().provenance;
    assert!(provenance.contains("fp.csv: 5501 rows, Treadmill_R_vy"), "{provenance}");
}

#[test]
fn strides_with_gaps_are_dropped() {
    let whole = opensim(5);
    let (header, body) = whole.split_once("lumbar_extension\tright_vy\n").unwrap();
    let kept: Vec<&str> =
        body.lines().filter(|row| !(2.5..2.65).contains(&row.split('\t').next().unwrap().parse().unwrap())).collect();
    let header = header.replace("nRows=551", &format!("nRows={}", kept.len()));
    let text = format!("{header}lumbar_extension\tright_vy\n{}\n", kept.join("\n"));
    let given = HeelStrikes::Given(vec![0.0, 1.1, 2.2, 3.3, 4.4]);
    let reference = read(&text).unwrap().reference("x", &given, MeasuredPerson::default()).unwrap();
    assert!(
        reference.provenance.contains("mean of 3 strides of 0.8 to 1.6 s, without gaps longer than 0.1 s (1 dropped)")
    );
    assert!(reference.provenance.contains("5 right heel strikes given: 0.0000, 1.1000, 2.2000, 3.3000, 4.4000 s"));
    let of_whole = read(&whole).unwrap().reference("x", &given, MeasuredPerson::default()).unwrap();
    for (ours, theirs) in reference.angles_rad.iter().flatten().zip(of_whole.angles_rad.iter().flatten()) {
        assert!((ours - theirs).abs() < 1e-9);
    }
    let only_that = HeelStrikes::Given(vec![2.2, 3.3]);
    let refused = read(&text).unwrap().reference("x", &only_that, MeasuredPerson::default()).unwrap_err().to_string();
    assert!(refused.contains("no stride of 0.8 to 1.6 s is free of gaps longer than 0.1 s"), "{refused}");
}

type Change = fn(&mut ReferenceGait);

#[test]
fn implausible_reference_is_rejected_with_the_field() {
    let whole = ReferenceGait::builtin().unwrap();
    let changes: [(Change, &str); 5] = [
        (|r| r.angles_rad.iter_mut().flatten().for_each(|a| *a = a.to_degrees()), "angles_rad[0][0] is 7"),
        (|r| r.standard_deviation_rad = Some(vec![[-0.1; 5]; 101]), "standard_deviation_rad[0][0] is -0.1;"),
        (
            |r| r.standard_deviation_rad = Some(vec![[0.1; 5]; 50]),
            "standard_deviation_rad: the number of rows is 50; it must be 101",
        ),
        (|r| r.height_m = Some(175.0), "height_m is 175;"),
        (|r| r.body_mass_kg = Some(f64::NAN), "body_mass_kg is NaN;"),
    ];
    for (change, expected) in changes {
        let mut reference = whole.clone();
        change(&mut reference);
        let refused = reference.validate().unwrap_err().to_string();
        assert!(refused.starts_with(expected), "{expected}: {refused}");
    }
}

#[test]
fn strides_are_averaged_with_standard_deviation_and_provenance() {
    let recording = read(&opensim(5)).unwrap();
    let walker = MeasuredPerson { height_m: Some(1.75), body_mass_kg: Some(70.0) };
    // The stride between the other two is too long.
    let strikes = HeelStrikes::Given(vec![0.0, 1.1, 3.3, 4.4]);
    let reference = recording.reference("synthetic", &strikes, walker).unwrap();
    for row in [0, 25, 100] {
        let wanted = (25.0 - 20.0 * (TAU * f64::from(row) / 100.0 + 0.5 * TAU).cos()).to_radians();
        let found = reference.angles_rad[usize::try_from(row).unwrap()][2];
        assert!((found - wanted).abs() < 1e-3, "row {row}: {found} {wanted}");
    }
    let deviation = reference.standard_deviation_rad.as_ref().unwrap();
    assert!(deviation.iter().flatten().all(|d| *d < 1e-9), "equal strides");
    for word in ["inDegrees", "OpenSim motion file", "knee flexion = -knee_angle", "mean of 2 strides", "(1 dropped)"] {
        let found = reference.provenance.contains(word) || word == "inDegrees";
        assert!(found, "{word}: {}", reference.provenance);
    }
    assert_eq!(reference.height_m, Some(1.75));
    let json = serde_json::to_string(&reference).unwrap();
    assert_eq!(reference, serde_json::from_str(&json).unwrap());
}

#[test]
fn exported_gait_is_imported_with_the_same_curves() {
    for (subject, muscles) in [(1, false), (2, true)] {
        let (_, gait) = golden_gait(subject, muscles);
        let text = motion_file(&gait, 2000.0).unwrap();
        let recording = MotionRecording::from_opensim("gait.mot", &text, None, None).unwrap();
        // Linear interpolation has an error of h²/8 qdd = 3e-6 rad at 90 rad/s². An impact that changes a velocity by
        // 10 rad/s between two rows gives h/4 times that: 1.3e-3 rad.
        let end = recording.time_s[recording.time_s.len() - 1];
        let reference = recording.reference("gait", &HeelStrikes::Ends, MeasuredPerson::default()).unwrap();
        assert!(
            reference
                .provenance
                .contains(&format!("2 right heel strikes at the ends of the recording: 0.0000, {end:.4} s"))
        );
        let within = recording.heel_strikes(&HeelStrikes::Kinematics).unwrap_err().to_string();
        assert!(
            within.ends_with(
                "if the recording is exactly one stride, such as an exported gait, use its first and last rows as heel \
                 strikes."
            ),
            "{within}"
        );
        for (domain, name) in gait.domains.iter().zip(0..) {
            for ((time, q), k) in domain.time_s.iter().zip(&domain.q).zip(0..) {
                let at_an_impact = k == 0 || k + 1 == domain.time_s.len();
                let tolerance = if at_an_impact { 1.3e-3 } else { 3e-6 };
                let found = recording_at(&recording, *time);
                for i in 0..5 {
                    let difference = (found[i] - q[2 + i]).abs();
                    assert!(difference < tolerance, "domain {name}, coordinate {i} at {time} s: {difference}");
                }
            }
        }
        let middle = recording_at(&recording, 0.5 * end);
        for i in 0..5 {
            assert!((reference.angles_rad[50][i] - middle[i]).abs() < 1e-5, "coordinate {i}");
        }
    }
}

fn recording_at(recording: &MotionRecording, time: f64) -> [f64; 5] {
    let after = recording.time_s.partition_point(|&t| t < time).clamp(1, recording.time_s.len() - 1);
    let (t0, t1) = (recording.time_s[after - 1], recording.time_s[after]);
    let share = (time - t0) / (t1 - t0);
    let (a, b) = (recording.angles_rad[after - 1], recording.angles_rad[after]);
    std::array::from_fn(|i| a[i] + share * (b[i] - a[i]))
}

#[test]
fn columns_of_tables_are_found_by_name() {
    let mut camargo = "Header,knee_angle_l,knee_angle_r,hip_flexion_l,hip_flexion_r,ankle_angle_l,ankle_angle_r,\
                       pelvis_tilt,lumbar_extension\n"
        .to_owned();
    let mut own = "# one adult\ntime_s,torso_rad,hip_L_rad,knee_L_rad,ankle_L_rad,hip_R_rad\n".to_owned();
    for k in 0..40 {
        let time = f64::from(k) / 200.0;
        camargo.extend([format!("{time},{},-10,20,5,3,4,-2,-6\n", k - 37)]);
        own.extend([format!("{time},0.1,0.2,{},0.4,0.5\n", f64::from(k) / 100.0)]);
    }
    let recording = MotionRecording::from_camargo_csv("AB06.csv", &camargo).unwrap();
    let wanted = [8.0, 26.0, 30.0, 3.0, 11.0_f64].map(f64::to_radians);
    for (found, wanted) in recording.angles_rad[7].iter().zip(wanted) {
        assert!((found - wanted).abs() < 1e-12, "{found} {wanted}");
    }
    let marked = MotionRecording::from_csv("own.csv", &format!("\u{feff}{own}")).unwrap();
    let recording = MotionRecording::from_csv("own.csv", &own).unwrap();
    assert_eq!(marked, recording, "with a byte order mark as without");
    assert_eq!(recording.angles_rad[39], [0.1, 0.2, 0.39, 0.4, 0.5]);
    assert_eq!(recording.steps[0], "one adult");
}

#[test]
fn exchanged_hips_are_rejected() {
    let recording = read(&opensim(5)).unwrap();
    let given = HeelStrikes::Given(vec![0.0, 1.1, 2.2]);
    let refused = |change: fn(&mut [f64; 5]), how: &HeelStrikes| {
        let mut other = recording.clone();
        other.angles_rad.iter_mut().for_each(change);
        other.reference("x", how, MeasuredPerson::default()).unwrap_err().to_string()
    };
    let behind = "at right heel strike the right thigh is 50° behind the left one";
    for change in [
        |angles: &mut [f64; 5]| angles.swap(1, 4),
        |angles: &mut [f64; 5]| (angles[1], angles[4]) = (-angles[1], -angles[4]),
    ] {
        let reason = refused(change, &given);
        assert!(reason.contains(behind), "{reason}");
    }
    // Heel strikes of the left foot.
    let left = recording.reference("x", &HeelStrikes::Given(vec![0.55, 1.65, 2.75]), MeasuredPerson::default());
    assert!(left.unwrap_err().to_string().contains(behind));
}

#[test]
fn built_in_reference_has_the_published_deviations() {
    let reference = ReferenceGait::builtin().unwrap();
    let deviation = reference.standard_deviation_rad.unwrap();
    // Falisse 2019: torso 0.77°, hip 0.53°, knee 1.08°, ankle 1.43° at heel strike; the left leg is half a cycle later.
    for (found, wanted) in [deviation[0][0], deviation[0][4], deviation[50][2], deviation[50][3]].into_iter().zip([
        0.773_924,
        0.532_748,
        1.078_66,
        1.429_88_f64,
    ]) {
        assert!((found - wanted.to_radians()).abs() < 1e-6, "{found} {wanted}");
    }
    let half = "torso_sd_rad,hip_L_sd_rad,knee_L_sd_rad,ankle_L_sd_rad";
    let columns = format!("pct_rhs,torso_rad,hip_L_rad,knee_L_rad,ankle_L_rad,hip_R_rad,{half}\n");
    let refused = ReferenceGait::from_csv("half", &columns).unwrap_err().to_string();
    assert!(refused.contains("line 1: column hip_R_sd_rad is missing"), "{refused}");
    let negative = format!("{},hip_R_sd_rad\n0,.1,.1,.1,.1,.1,.01,.01,-.01,.01,.01\n", columns.trim_end());
    let refused = ReferenceGait::from_csv("negative", &negative).unwrap_err().to_string();
    assert!(
        refused.contains("line 2: knee_L_sd_rad is \"-.01\"; it must be an angle from 0.00 to 3.14 rad"),
        "{refused}"
    );
}

#[test]
fn nearest_reference_in_height_and_mass_is_chosen() {
    let reference = |name: &str, height_m, body_mass_kg| ReferenceGait {
        name: name.to_owned(),
        height_m,
        body_mass_kg,
        ..ReferenceGait::builtin().unwrap()
    };
    let all = [
        reference("nobody's", None, None),
        reference("tall", Some(1.85), Some(70.0)),
        reference("near", Some(1.72), Some(72.0)),
    ];
    let subject = Subject::new(1.75, 70.0).unwrap();
    let (found, away) = nearest(&subject, &all).unwrap();
    assert_eq!(found.name, "near");
    assert!((away - 0.3_f64.hypot(2.0 / 15.0)).abs() < 1e-12);
    assert_eq!(distance(&subject, &all[0]), None);
    assert!(nearest(&subject, &all[..1]).is_none());
}

#[test]
fn recordings_without_a_stride_are_rejected_with_the_reason() {
    let recording = read(&opensim(2)).unwrap();
    let refused = |strikes: Vec<f64>| {
        recording.reference("x", &HeelStrikes::Given(strikes), MeasuredPerson::default()).unwrap_err().to_string()
    };
    assert!(refused(vec![0.5]).contains("right heel strikes found: 1; a stride needs two"));
    assert!(refused(vec![0.5, 0.9]).contains("no stride of 0.8 to 1.6 s is free of gaps longer than 0.1 s"));
    assert!(refused(vec![1.5, 0.5]).contains("must increase"));
    assert!(refused(vec![0.5, 9.0]).contains("heel_strikes_s is 9; it must be"));
    // Forces that end before the first stride.
    let force = VerticalForce { time_s: vec![0.0, 0.1, 0.2], force_n: vec![0.0; 3] };
    let early = MotionRecording { right_force: Some(force), ..recording.clone() };
    let early = early.reference("x", &HeelStrikes::Force, MeasuredPerson::default()).unwrap_err().to_string();
    let expected =
        "right heel strikes found: 0 (angles from 0.000 to 2.200 s, forces from 0.000 to 0.200 s); a stride needs two";
    assert!(early.contains(expected), "{early}");
    let unforced = MotionRecording::from_opensim("x", &opensim(2), None, None).unwrap();
    assert!(unforced.heel_strikes(&HeelStrikes::Force).unwrap_err().to_string().contains("no force"));
    let short = MeasuredPerson { height_m: Some(0.5), ..MeasuredPerson::default() };
    let error = recording.reference("x", &HeelStrikes::Given(vec![0.0, 1.1]), short).unwrap_err();
    assert!(error.to_string().contains("height_m is 0.5;"));
}

/// Five strides of 1.1 s of the built-in reference as a recording, with angles modified by `change` and delayed by the
/// fraction `late` of a stride after the heel strikes at 0 s, 1.1 s, ...
fn walk(late: f64, change: impl Fn([f64; 7]) -> [f64; 7]) -> MotionRecording {
    let builtin = ReferenceGait::builtin().unwrap();
    of_fractions(|fraction| change(builtin.seven_angles(fraction + late)))
}

fn of_fractions(angles_at: impl Fn(f64) -> [f64; 7]) -> MotionRecording {
    let mut text = "time_s,torso_rad,hip_L_rad,knee_L_rad,ankle_L_rad,hip_R_rad,knee_R_rad\n".to_owned();
    for k in 0..=550 {
        let time_s = f64::from(k) / 100.0;
        let angles = angles_at(time_s / 1.1).map(|angle| format!("{angle:.6}"));
        writeln!(text, "{time_s},{}", angles[..6].join(",")).unwrap();
    }
    MotionRecording::from_csv("walk.csv", &text).unwrap()
}

/// The error or the warning for a recording that is segmented at 0 s, 1.1 s, ...; empty if there is neither.
fn said_of(recording: &MotionRecording) -> String {
    let given = HeelStrikes::Given((0..5).map(|k| 1.1 * f64::from(k)).collect());
    match recording.reference("walk", &given, MeasuredPerson::default()) {
        Ok(reference) => warning_of(&reference),
        Err(refused) => format!("refused: {refused}"),
    }
}

fn warning_of(reference: &ReferenceGait) -> String {
    let said = reference.provenance.lines().find(|line| line.contains("from the built-in reference"));
    said.unwrap_or_default().to_owned()
}

type Angles = fn([f64; 7]) -> [f64; 7];

#[test]
fn impossible_mean_strides_are_rejected() {
    let unaltered = walk(0.0, |angles| angles);
    assert_eq!(said_of(&unaltered), "", "the walk as it is");
    // The right heel is farthest ahead slightly before heel strike.
    let found = unaltered.reference("walk", &HeelStrikes::Kinematics, MeasuredPerson::default()).unwrap();
    assert_eq!(warning_of(&found), "", "{}", found.provenance);
    let cases: [(Angles, &str); 6] = [
        (
            |[torso, rest @ ..]| with_torso(torso + 0.8, rest),
            "torso_rad is 52° on average over the stride; plausible averages are at most 45° in either direction; check the sign, and that upright is 0°",
        ),
        (
            |[torso, rest @ ..]| with_torso(torso - 1.0, rest),
            "torso_rad is -51° on average over the stride; plausible averages are at most 45° in either direction; check the sign, and that upright is 0°",
        ),
        (
            |angles| with_knee(angles, 0.25 * angles[2]),
            "knee_L_rad has a peak flexion of only 16.5° in the stride; at least 20° is expected; check the sign and the unit",
        ),
        (
            |angles| with_knee(angles, angles[2] + 0.8),
            "knee_L_rad shows at least 57° of flexion throughout the stride; its minimum must be at most 40°",
        ),
        (
            |angles| with_ankle(angles, angles[3] + std::f64::consts::FRAC_PI_2),
            "ankle_L_rad is 92° on average over the stride; plausible averages are at most 30° in either direction; check that the angle is 0° when \
             foot and shank are perpendicular",
        ),
        (
            |angles| with_ankle(angles, angles[3].to_radians()),
            "ankle_L_rad moves by only 0.57° in the stride, less than 2°; check the unit",
        ),
    ];
    for (change, expected) in cases {
        let said = said_of(&walk(0.0, change));
        assert!(said == format!("refused: walk.csv: {expected}."), "{expected}: {said}");
    }
}

fn with_torso(torso: f64, rest: [f64; 6]) -> [f64; 7] {
    let [hip_l, knee_l, ankle_l, hip_r, knee_r, ankle_r] = rest;
    [torso, hip_l, knee_l, ankle_l, hip_r, knee_r, ankle_r]
}

fn with_knee(angles: [f64; 7], knee_l: f64) -> [f64; 7] {
    let [torso, hip_l, _, rest @ ..] = angles;
    let [ankle_l, hip_r, knee_r, ankle_r] = rest;
    [torso, hip_l, knee_l, ankle_l, hip_r, knee_r, ankle_r]
}

fn with_ankle(angles: [f64; 7], ankle_l: f64) -> [f64; 7] {
    let [torso, hip_l, knee_l, _, rest @ ..] = angles;
    let [hip_r, knee_r, ankle_r] = rest;
    [torso, hip_l, knee_l, ankle_l, hip_r, knee_r, ankle_r]
}

#[test]
fn unusual_mean_strides_get_a_warning() {
    let swapped = |pairs: &'static [(usize, usize)]| {
        move |mut angles: [f64; 7]| {
            for &(left, right) in pairs {
                angles.swap(left, right);
            }
            angles
        }
    };
    let builtin = ReferenceGait::builtin().unwrap();
    // A wrong sign of the lumbar joint: the torso leans in the other direction relative to a pelvis that leans by 0.2
    // rad.
    let lumbar = |[torso, hip_l, knee_l, ankle_l, hip_r, knee_r, ankle_r]: [f64; 7]| {
        let twice = 2.0 * (torso - 0.2);
        [torso - twice, hip_l - twice, knee_l, ankle_l, hip_r - twice, knee_r, ankle_r]
    };
    let cases = [
        ("ankle sign", said_of(&walk(0.0, |a| with_ankle(a, -a[3]))), "left ankle (correlation −1.00)"),
        (
            "knees swapped",
            said_of(&walk(0.0, swapped(&[(2, 5)]))),
            "the left leg should swing in the first half of the stride from right heel strike, but the left knee bends less in that half (28°) than in the second half (66°)",
        ),
        ("ankles swapped", said_of(&walk(0.0, swapped(&[(3, 6)]))), "left ankle (correlation 0.00)"),
        (
            "legs swapped",
            said_of(&walk(0.0, swapped(&[(1, 4), (2, 5), (3, 6)]))),
            "at right heel strike the right thigh is 44° behind the left one",
        ),
        (
            "strikes of the left foot",
            said_of(&walk(0.5, |a| a)),
            "at right heel strike the right thigh is 44° behind the left one",
        ),
        (
            "strikes 0.3 s late",
            said_of(&walk(0.3 / 1.1, |a| a)),
            "at right heel strike the right thigh is 8° behind the left one",
        ),
        (
            "strikes 0.15 s late",
            said_of(&walk(0.15 / 1.1, |a| a)),
            "left knee (correlation 0.24), left ankle (correlation 0.09)",
        ),
        (
            "reversed in time",
            said_of(&of_fractions(|fraction| builtin.seven_angles(-fraction))),
            "the left leg should swing in the first half of the stride from right heel strike, but the left knee bends less in that half (28°) than in the second half (66°)",
        ),
        // Undetectable: the lean of the torso is plausible, and the shapes of the hip curves do not change.
        ("lumbar sign", said_of(&walk(0.0, lumbar)), ""),
    ];
    let mut other = Vec::new();
    for (name, said, expected) in cases {
        println!("| {name} | {said} |");
        if !said.contains(expected) || said.is_empty() != expected.is_empty() {
            other.push((name, said));
        }
    }
    assert!(other.is_empty(), "{other:#?}");
}

#[test]
fn computed_gaits_can_become_reference_gaits() {
    for (subject, muscles) in [(1, false), (1, true), (2, false), (2, true)] {
        let (_, gait) = golden_gait(subject, muscles);
        let recording =
            MotionRecording::from_opensim("gait.mot", &motion_file(&gait, 200.0).unwrap(), None, None).unwrap();
        let reference = recording.reference("gait", &HeelStrikes::Ends, MeasuredPerson::default()).unwrap();
        println!("| subject {subject}, muscles {muscles} | {} |", warning_of(&reference));
    }
}

/// Forces at 1000 Hz for the strides of [`opensim`]: 700 N for 0.66 s of each 1.1 s with edges of 20 ms, plus a
/// disturbance of the plate.
fn plate(disturbance: impl Fn(usize) -> f64) -> VerticalForce {
    let time_s: Vec<f64> = (0..5500).map(|k| f64::from(k) / 1000.0).collect();
    let force = |time: f64| {
        let since = (time + 0.3).rem_euclid(1.1) - 0.3;
        700.0 * (since / 0.02).clamp(0.0, 1.0) * ((0.66 - since) / 0.02).clamp(0.0, 1.0)
    };
    let force_n = time_s.iter().enumerate().map(|(k, time)| force(*time) + disturbance(k)).collect();
    VerticalForce { time_s, force_n }
}

#[test]
fn noise_and_offset_of_a_force_plate_cause_no_heel_strikes() {
    let normal = noise(5500);
    for (offset_n, noise_n) in [(0.0, 0.0), (0.0, 8.0), (0.0, 10.0), (15.0, 4.0)] {
        let force = plate(|k| offset_n + noise_n * normal[k]);
        let recording = MotionRecording { right_force: Some(force), ..read(&opensim(5)).unwrap() };
        let strikes = recording.heel_strikes(&HeelStrikes::Force).unwrap();
        assert_eq!(strikes.len(), 4, "{offset_n} N, noise of {noise_n} N: {strikes:?}");
        for (k, strike) in strikes.iter().enumerate() {
            let off = strike - 1.1 * (k + 1) as f64;
            assert!(off.abs() < 0.003, "{offset_n} N, noise of {noise_n} N: {off}");
        }
    }
    // With an offset above the threshold the contact never ends.
    let lifted = MotionRecording { right_force: Some(plate(|_| 25.0)), ..read(&opensim(5)).unwrap() };
    let refused = lifted.heel_strikes(&HeelStrikes::Force).unwrap_err().to_string();
    assert!(refused.starts_with("walk.mot: right heel strikes found: 0"), "{refused}");
}
