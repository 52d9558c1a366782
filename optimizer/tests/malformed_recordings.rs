//! Exact error messages of malformed recordings. `cargo test --workspace --locked --test malformed_recordings --
//! --nocapture` prints them as a table.

#![allow(clippy::unwrap_used)]

mod synthetic_recordings;

use gait_optimizer::ModelError;
use gait_optimizer::emg::EmgRecording;
use gait_optimizer::limit_cycle::JointRecording;
use gait_optimizer::reference::MotionRecording;
use synthetic_recordings::{camargo, electromyogram, opensim, own_table};

/// A malformed file: description, text and error message.
type Case = (&'static str, String, &'static str);

/// Checks the messages of a parser, and prints them.
fn check(kind: &str, read: impl Fn(&str) -> Option<ModelError>, cases: &[Case]) {
    let mut other = Vec::new();
    for (name, text, expected) in cases {
        let message = read(text).map_or_else(|| "imported.".to_owned(), |error| error.to_string());
        println!("| {kind} | {name} | {message} |");
        if message != format!("{expected}.") {
            other.push((*name, message));
        }
    }
    assert!(other.is_empty(), "{kind}: {other:#?}");
}

/// A file with the first `from` replaced by `to`.
fn changed(whole: &str, from: &str, to: &str) -> String {
    assert!(whole.contains(from), "{from}");
    whole.replacen(from, to, 1)
}

/// The line with this number, from 1.
fn line(text: &str, number: usize) -> String {
    text.lines().nth(number - 1).unwrap().to_owned()
}

/// A motion file with its angles converted to radians.
fn in_radians(whole: &str) -> String {
    let (header, rows) = whole.split_at(whole.find("\n0.0000").unwrap() + 1);
    let angle = |(column, cell): (usize, &str)| match column {
        1..=8 => cell.parse::<f64>().unwrap().to_radians().to_string(),
        _ => cell.to_owned(),
    };
    let rows: Vec<String> =
        rows.lines().map(|row| row.split('\t').enumerate().map(angle).collect::<Vec<_>>().join("\t")).collect();
    format!("{header}{}\n", rows.join("\n"))
}

#[test]
fn malformed_opensim_files_are_rejected_with_place_and_reason() {
    let whole = opensim(2);
    let read = |text: &str| MotionRecording::from_opensim("walk.mot", text, None, Some("right_vy")).err();
    assert_eq!(read(&whole), None);
    let change = |from: &str, to: &str| changed(&whole, from, to);
    let row = line(&whole, 11);
    let cells: Vec<&str> = row.split('\t').collect();
    let with = |column: usize, cell: &str| {
        let mut cells = cells.clone();
        cells[column - 1] = cell;
        change(&row, &cells.join("\t"))
    };
    let names = "the columns are time, pelvis_tilt, hip_flexion_r, knee_angle_r, ankle_angle_r, hip_flexion_l";
    let missing =
        |name: &str, rest: &str| format!("walk.mot, line 7: column {name:?} is missing; {rest}").leak() as &str;
    let cases = [
        ("empty", String::new(), "walk.mot, line 1: the line \"endheader\" is missing"),
        ("no endheader", change("endheader\n", ""), "walk.mot, line 227: the line \"endheader\" is missing"),
        ("binary", "\u{0}\u{1}\u{2}PNG\n\u{3}".to_owned(), "walk.mot, line 2: the line \"endheader\" is missing"),
        (
            "header alone",
            whole[..whole.find("time").unwrap()].to_owned(),
            "walk.mot, line 7: the line of column names is missing",
        ),
        (
            "no unit",
            change("inDegrees=yes\n", ""),
            "walk.mot, line 5: the header has neither inDegrees=yes nor inDegrees=no; give the unit",
        ),
        (
            "odd unit",
            change("inDegrees=yes", "inDegrees=grad"),
            "walk.mot, line 5: inDegrees=grad: the value must be yes or no",
        ),
        (
            "two units",
            change("inDegrees=yes\n", "inDegrees=yes\ninDegrees = no\n"),
            "walk.mot, line 6: this line gives angles in radians, but line 5 gives them in degrees",
        ),
        (
            "wrong unit",
            change("inDegrees=yes", "inDegrees=no"),
            "walk.mot, line 8: torso_rad is 7.0 rad; plausible angles are at most 3.14 rad in either direction; check the unit",
        ),
        (
            "radians under a header of degrees",
            in_radians(&whole),
            "walk.mot, line 8: knee_L_rad moves by only 0.012 rad, less than 0.1 rad; check the unit",
        ),
        ("an absurd sample", with(9, "120"), "walk.mot, line 11: torso_rad jumps by -2.16 rad in 0.0100 s"),
        (
            "cut in half",
            whole[..whole.len() / 2].to_owned(),
            "walk.mot, line 117: the number of cells is 7; it must be 10",
        ),
        (
            "a row taken out",
            change(&format!("{}\n", line(&whole, 50)), ""),
            "walk.mot, line 3: the header has nRows=221, but the file has 220; check that the file is complete",
        ),
        (
            "number of columns",
            change("nColumns=10", "nColumns=9"),
            "walk.mot, line 4: the header has nColumns=9, but the file has 10; check that the file is complete",
        ),
        (
            "number of rows no number",
            change("nRows=221", "nRows=many"),
            "walk.mot, line 3: the header has nRows=many, but the file has 221; check that the file is complete",
        ),
        (
            "no column names",
            change(&format!("{}\n", line(&whole, 7)), ""),
            "walk.mot, line 7: the first column is \"0.0000\"; it must be \"time\"",
        ),
        (
            "time not first",
            change("time\t", "frame\t"),
            "walk.mot, line 7: the first column is \"frame\"; it must be \"time\"",
        ),
        (
            "a name twice",
            change("hip_flexion_l", "hip_flexion_r"),
            "walk.mot, line 7, column 6: column \"hip_flexion_r\" occurs twice",
        ),
        (
            "knee missing",
            change("knee_angle_l", "knee_l"),
            missing("knee_angle_l", &format!("{names}, knee_l, ankle_angle_l, lumbar_extension, right_vy")),
        ),
        (
            "force missing",
            change("right_vy", "vy"),
            missing("right_vy", &format!("{names}, knee_angle_l, ankle_angle_l, lumbar_extension, vy")),
        ),
        ("a word", with(2, "abc"), "walk.mot, line 11, column 2: pelvis_tilt is \"abc\"; it must be a number"),
        ("not a number", with(5, "NaN"), "walk.mot, line 11, column 5: ankle_angle_r is \"NaN\"; it must be a number"),
        ("infinity", with(10, "inf"), "walk.mot, line 11, column 10: right_vy is \"inf\"; it must be a number"),
        (
            "decimal comma",
            with(3, "30,5"),
            "walk.mot, line 11, column 3: hip_flexion_r is \"30,5\"; it must be a number",
        ),
        (
            "a cell missing",
            change(&row, &cells[..9].join("\t")),
            "walk.mot, line 11: the number of cells is 9; it must be 10",
        ),
        (
            "a cell too many",
            change(&row, &format!("{row}\t1")),
            "walk.mot, line 11: the number of cells is 11; it must be 10",
        ),
        (
            "an empty line",
            change(&row, &format!("\n{row}")),
            "walk.mot, line 11: the number of cells is 0; it must be 10",
        ),
        (
            "time stands still",
            with(1, "0.0200"),
            "walk.mot, line 11, column 1: time 0.02 follows 0.02; times must increase",
        ),
        ("time goes back", with(1, "-1"), "walk.mot, line 11, column 1: time -1 follows 0.02; times must increase"),
        (
            "ten rows",
            changed(&whole.lines().take(17).collect::<Vec<_>>().join("\n"), "nRows=221\n", ""),
            "walk.mot, line 16: the number of rows is 10; it must be at least 20",
        ),
    ];
    check("motion file", read, &cases);
}

#[test]
fn malformed_tables_are_rejected_with_place_and_reason() {
    let (whole, own) = (camargo(2), own_table());
    let read = |text: &str| MotionRecording::from_camargo_csv("AB06.csv", text).err();
    assert_eq!(read(&whole), None);
    let row = line(&whole, 100);
    check(
        "Camargo table",
        read,
        &[
            ("empty", String::new(), "AB06.csv, line 1: the line of column names is missing"),
            (
                "another table of the data set",
                changed(&whole, "Header,", "HeelStrike,"),
                "AB06.csv, line 1: the first column is \"HeelStrike\"; it must be \"Header\"",
            ),
            (
                "semicolons",
                whole.replace(',', ";"),
                "AB06.csv, line 1: the first column is \"Header;pelvis_tilt;hip_flexion_r;knee_angle_r;ankle_angle_r;\
                 hip_flexion_l;knee_angle_l;ankle_angle_l;lumbar_extension;right_vy\"; it must be \"Header\"",
            ),
            (
                "a gap of the markers",
                changed(&whole, &row, &row.replacen("-3.000000000", "NaN", 1)),
                "AB06.csv, line 100, column 2: pelvis_tilt is \"NaN\"; it must be a number",
            ),
            (
                "cut off",
                whole[..whole.len() - 30].to_owned(),
                "AB06.csv, line 222: the number of cells is 8; it must be 10",
            ),
        ],
    );
    let read = |text: &str| MotionRecording::from_csv("own.csv", text).err();
    assert_eq!(read(&own), None);
    check(
        "own table",
        read,
        &[
            ("comments alone", "# one adult\n".to_owned(), "own.csv, line 2: the line of column names is missing"),
            (
                "degrees",
                own.replace(",0.400000,", ",23,"),
                "own.csv, line 3: knee_L_rad is 23.0 rad; plausible angles are at most 3.14 rad in either direction; check the unit",
            ),
            (
                "hip missing",
                changed(&own, "hip_R_rad", "hip_rad"),
                "own.csv, line 2: column \"hip_R_rad\" is missing; the columns are time_s, torso_rad, hip_L_rad, knee_L_rad, \
                 ankle_L_rad, hip_rad, knee_R_rad",
            ),
            (
                "an empty cell",
                changed(&own, "\n1,0.1,", "\n1,,"),
                "own.csv, line 103, column 2: torso_rad is \"\"; it must be a number",
            ),
            (
                "rows swapped",
                changed(&own, "\n0.5,", "\n0.47,"),
                "own.csv, line 53, column 1: time 0.47 follows 0.49; times must increase",
            ),
        ],
    );
}

#[test]
fn malformed_emg_files_are_rejected_with_place_and_reason() {
    let whole = electromyogram();
    let read = |text: &str| EmgRecording::from_csv("emg.csv", text, None).err();
    assert_eq!(read(&whole), None);
    check(
        "electromyogram",
        read,
        &[
            ("empty", String::new(), "emg.csv, line 1: the line of column names is missing"),
            (
                "no time",
                changed(&whole, "time_s", "t"),
                "emg.csv, line 1: the first column is \"t\"; it must be \"time_s\"",
            ),
            (
                "time alone",
                whole.lines().map(|l| l.split(',').next().unwrap()).collect::<Vec<_>>().join("\n"),
                "emg.csv, line 1: the file has a time column but no channels",
            ),
            (
                "a channel twice",
                changed(&whole, "BF_L", "TA_L"),
                "emg.csv, line 1, column 3: column \"TA_L\" occurs twice",
            ),
            (
                "a word",
                changed(&whole, "\n0.5,", "\n0.5,off"),
                "emg.csv, line 502, column 2: TA_L is \"off-0.866025\"; it must be a number",
            ),
            (
                "a sample at the wrong time",
                changed(&whole, "\n0.5,", "\n0.5009,"),
                "emg.csv, line 503, column 1: time 0.501 is 0.000100 s after 0.5009, but the usual spacing is 0.001000 s; rows \
                 must be evenly spaced",
            ),
            (
                "a pause",
                whole.replace("\n0.9", "\n7.9"),
                "emg.csv, line 902, column 1: time 7.9 is 7.001000 s after 0.899, but the usual spacing is 0.001000 s; rows \
                 must be evenly spaced",
            ),
            (
                "cut off",
                whole[..whole.len() - 6].to_owned(),
                "emg.csv, line 1001: the number of cells is 3; it must be 4",
            ),
            (
                "ten samples",
                whole.lines().take(11).collect::<Vec<_>>().join("\n"),
                "emg.csv, line 11: the number of rows is 10; it must be at least 20",
            ),
        ],
    );
    let recording = EmgRecording::from_csv("emg.csv", &whole, None).unwrap();
    let refused = [
        recording.select("emg.csv", [("RF_L", "EMG 1")]).unwrap_err(),
        recording.select("emg.csv", [("RF_L", "BF_L"), ("TA_L", "TA_L"), ("GAS_L", "BF_L")]).unwrap_err(),
        EmgRecording::from_csv("emg.csv", &whole, Some(1000.0)).unwrap_err(),
        recording.strikes_of_column("emg.csv", "toe", 0.5).unwrap_err(),
        recording.strikes_of_column("emg.csv", "heel", 2.0).unwrap_err(),
        recording.check_strikes("emg.csv", &[0.1, 9.0]).unwrap_err(),
        recording.check_strikes("emg.csv", &[0.5, 0.1]).unwrap_err(),
        EmgRecording::from_csv("emg.csv", &whole, Some(5.0)).unwrap_err(),
    ];
    let expected = [
        "emg.csv: column \"EMG 1\" (left rectus femoris) is missing; the columns are TA_L, BF_L, heel.",
        "emg.csv: column \"BF_L\" is selected for both RF_L and GAS_L; each channel needs its own column.",
        "emg.csv, line 1: the file has a time column, \"time_s\"; give a sampling rate only for a file without one.",
        "emg.csv: column \"toe\" is missing; the columns are TA_L, BF_L, heel.",
        "emg.csv: column \"heel\" has no heel strike; a stride needs two. A heel strike is a rise above 2 that lasts at least 0.05 s, after at least 0.1 s below.",
        "heel_strikes_s is 9; it must be 0 to 0.999.",
        "emg.csv: the heel-strike times must increase.",
        "rate_hz is 5; it must be 100 to 20000.",
    ];
    for error in &refused {
        println!("| electromyogram | invalid request | {error} |");
    }
    assert_eq!(refused.map(|error| error.to_string()), expected);
}

#[test]
fn malformed_joint_tables_are_rejected_with_place_and_reason() {
    let whole = own_table();
    let read = |text: &str| JointRecording::from_csv("angles.csv", text).err();
    assert_eq!(read(&whole), None);
    check(
        "joint angles",
        read,
        &[
            (
                "no joint",
                whole.replace("_rad", ""),
                "angles.csv, line 2: no column has the name of a joint angle; the columns are torso, hip_L, knee_L, ankle_L, hip_R, knee_R",
            ),
            (
                "degrees",
                whole.replace(",0.400000,", ",23,"),
                "angles.csv, line 3: knee_L is 23.0 rad; plausible angles are at most 3.14 rad in either direction; check the unit",
            ),
            (
                "a gap",
                whole
                    .lines()
                    .enumerate()
                    .filter(|(k, _)| !(50..70).contains(k))
                    .map(|(_, line)| line)
                    .collect::<Vec<_>>()
                    .join("\n"),
                "angles.csv, line 51, column 1: there is a gap of 0.210 s between rows; gaps may be at most 0.05 s long",
            ),
        ],
    );
}
