//! The command line: invalid input is refused, and a refusal changes nothing.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use gait_optimizer::TunedBounds;
use gaitwright_store::Store;
use gaitwright_tests::cli;
use std::path::Path;
use std::process::{Output, Stdio};

fn gaitwright(folder: &Path, arguments: &[&str]) -> Output {
    cli::run(env!("CARGO_BIN_EXE_gaitwright-cli"), folder, arguments)
}

/// The arguments are refused with exit code 2, a message that holds `expected`, nothing on stdout and no file left.
#[track_caller]
fn refused(arguments: &[&str], expected: &str) {
    let folder = tempfile::tempdir().unwrap();
    let output = gaitwright(folder.path(), arguments);
    let text = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{text}");
    assert!(text.contains(expected), "{text}");
    assert!(output.stdout.is_empty());
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0, "something was left behind");
}

#[test]
fn impossible_height_is_refused_with_the_allowed_range() {
    for command in ["tune", "solve"] {
        refused(
            &[command, "--height-m", "17.27", "--body-mass-kg", "65.7"],
            "--height-m is 17.27; it must be 1.4 to 2.2.",
        );
        refused(
            &[command, "--height-m", "1.727", "--body-mass-kg", "6570"],
            "--body-mass-kg is 6570; it must be 35 to 160.",
        );
        refused(&[command, "--height-m", "NaN", "--body-mass-kg", "65"], "--height-m is NaN;");
        refused(&[command, "--height-m", "1.727"], "--body-mass-kg");
    }
}

#[test]
fn unknown_subject_is_refused_with_the_known_ones() {
    refused(&["tune", "--subject", "3"], "--subject is \"3\"; it must be 1 or 2, the subjects from the paper.");
    refused(&["solve", "--subject", "0"], "it must be 1 or 2");
    refused(&["tune", "--subject", "1", "--height-m", "1.7", "--body-mass-kg", "70"], "cannot be used with");
}

#[test]
fn malformed_bounds_are_refused_by_name() {
    refused(&["solve", "--bounds", "a0=1"], "\"a0\" is not a bound; the bounds are a1, ");
    refused(&["solve", "--bounds", "a5"], "expected NAME=VALUE");
    refused(&["solve", "--bounds", "a1=20,"], "expected NAME=VALUE");
    refused(&["solve", "--bounds", "a5=high"], "the value is not a number");
    refused(&["solve", "--bounds", "a5=0.1,a5=0.2"], "given twice");
    refused(&["solve", "--bounds", "a1=1000"], "a1 is 1000; it must be 1 to 100 rad/s.");
    refused(&["solve", "--bounds", "a3=1.4,a4=1.2"], "a3 is 1.4; it must be 0.05 to 1.199 m/s, below a4.");
}

#[test]
fn other_invalid_arguments_are_refused() {
    for command in ["tune", "solve"] {
        refused(&[command, "--subject", "-1"], "must be 1 or 2");
        refused(&[command, "--height-m", "-1.7", "--body-mass-kg", "65"], "--height-m is -1.7; it must be 1.4 to 2.2.");
    }
    for number in ["0", "-1", "10001", "many"] {
        refused(&["tune", "--trials", number], "'--trials <NUMBER>': must be a whole number from 1 to 10000");
    }
    refused(&["tune", "--seed", "-1"], "'--seed <NUMBER>': must be a whole number from 0 to 9007199254740991");
    for number in ["0", "-2", "65"] {
        for command in [&["tune"][..], &["serve"], &["sweep", "--actions", "a.csv", "--out", "o.csv"]] {
            let arguments = [command, &["--workers", number]].concat();
            refused(&arguments, "'--workers <NUMBER>': must be a whole number from 1 to 64");
        }
    }
    refused(&["solve", "--max-iterations", "-1"], "--max-iterations");
    refused(&["solve", "--time-limit-s", "-1"], "--time-limit-s is -1; it must be");
    refused(&["tune", "--muscles", "maybe"], "possible values: on, off");
    refused(&["solve", "--mesh", "4,4"], "four whole numbers");
    refused(&["solve", "--mesh", "0,4,6,6"], "mesh.ds2 is 0;");
    refused(&["solve", "--tolerance", "5"], "--tolerance is 5; it must be 1e-10 to 0.01.");
    refused(
        &["solve", "--reference", "foo"],
        "There is no reference gait foo. Give the name of a built-in one (falisse-2019, fukuchi-2018) or an existing file.",
    );
    refused(&["solve", "--warm", "nowhere.json"], "Cannot read nowhere.json");
    refused(&["sweep", "--actions", "nowhere.csv", "--out", "x.csv"], "Cannot read nowhere.csv");
    refused(&["simulate", "nowhere.json"], "Cannot read nowhere.json");
    refused(&["simulate", "nowhere.json", "--simulated-walks", "0"], "must be a whole number from 1 to 100000");
    refused(&["simulate", "nowhere.json", "--ground", "-5"], "'--ground <MILLIMETRES>': must be a number from 0 to 50");
    refused(&["solve", "--height-m", "tall", "--body-mass-kg", "65"], "'--height-m <METRES>': must be a number");
    refused(&["emg", "nowhere.csv", "--order", "high"], "must be 2, 4, 6 or 8");
    refused(&["solve", "--warm", "nowhere.json", "--warm-local-optimum", "first"], "must be a whole number");
    refused(&["prune", "--older-than-days", "0"], "must be a whole number from 1 to 36500");
    refused(&["export", "first", "study.gait"], "must be the identifier of a study");
}

#[test]
fn action_table_is_checked_completely_before_the_first_solve() {
    let folder = tempfile::tempdir().unwrap();
    let sweep = |text: &str| {
        std::fs::write(folder.path().join("actions.csv"), text).unwrap();
        let output = gaitwright(folder.path(), &["sweep", "--actions", "actions.csv", "--out", "out.csv"]);
        assert_eq!(output.status.code(), Some(2));
        assert!(!folder.path().join("out.csv").exists());
        String::from_utf8(output.stderr).unwrap()
    };
    let header = format!("it must be \"{}\"", TunedBounds::NAMES.join(","));
    assert!(sweep("a1,a2\n1,2\n").contains(&header));
    assert!(sweep(&cli::actions(&[])).contains("has no rows"));
    let (good, row) = (cli::actions(&[""]), cli::action("a1=19"));
    let (shorter, _) = row.rsplit_once(',').unwrap();
    assert!(sweep(&format!("{good}{shorter}\n")).contains("line"));
    let with = |value: &str| format!("{good}{}\n", row.replacen("19", value, 1));
    assert!(sweep(&with("fast")).contains("line 3: a1 is \"fast\", which is not a number"));
    assert!(sweep(&with("400")).contains("line 3: a1 is 400;"));
}

#[test]
fn warm_start_file_other_than_a_gait_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    for other in [r#"{"report": 3}"#, "[1, 2, 3, 4]"] {
        std::fs::write(folder.path().join("x.json"), other).unwrap();
        let output = gaitwright(folder.path(), &["solve", "--warm", "x.json"]);
        assert_eq!(output.status.code(), Some(2));
        assert!(
            String::from_utf8_lossy(&output.stderr)
                .contains("x.json is not a file written by `gaitwright solve --out`")
        );
    }
}

#[test]
fn service_without_sign_in_listens_on_loopback_only() {
    refused(&["serve", "--no-sign-in", "--listen", "0.0.0.0:0"], "without sign-in");
    refused(&["serve", "--no-sign-in", "--listen", "127.0.0.1:0", "--trusted-proxy", "10.1.0.1"], "without sign-in");
    for name in ["gait.example", "localhost.example", "10.0.0.7"] {
        let names = format!("localhost,{name}");
        refused(&["serve", "--no-sign-in", "--listen", "127.0.0.1:0", "--host-name", &names], "without sign-in");
    }
    refused(&["serve", "--trusted-proxy", "proxy.example"], "addresses and networks such as 127.0.0.1");
    refused(&["serve", "--proxy-headers", "via"], "x-forwarded or forwarded");
    refused(&["serve", "--listen", "here"], "listen (flag)");
    refused(&["serve", "--tls-key", "k.pem"], "tls_certificate");
}

/// Every file of the folder stays as it is, and none is added.
#[track_caller]
fn refused_beside(files: &[&str], arguments: &[&str], expected: &str) {
    let folder = tempfile::tempdir().unwrap();
    for file in files {
        std::fs::write(folder.path().join(file), "this is no database").unwrap();
    }
    std::fs::create_dir(folder.path().join("folder")).unwrap();
    let before = cli::files(folder.path());
    let output = gaitwright(folder.path(), arguments);
    let text = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{text}");
    assert!(text.contains(expected), "{text}");
    assert_eq!(cli::files(folder.path()), before, "something was left behind");
    for file in files {
        assert_eq!(std::fs::read_to_string(folder.path().join(file)).unwrap(), "this is no database");
    }
}

#[test]
fn file_other_than_a_database_is_refused_by_name_and_unchanged() {
    for command in [&["tune"][..], &["serve", "--listen", "127.0.0.1:0"], &["audit", "verify"], &["backup", "copy.db"]]
    {
        let with = |file| [command, &["--database", file]].concat();
        refused_beside(&["notes.txt"], &with("notes.txt"), "notes.txt is not a Gaitwright database");
    }
    refused_beside(&[], &["tune", "--database", "folder"], "folder is not a Gaitwright database: it is a folder");
    refused_beside(&[], &["tune", "--database", "nowhere/a.db"], "Cannot open or write nowhere/a.db");
    // Only the first bytes are valid.
    let folder = tempfile::tempdir().unwrap();
    let mut bytes = b"SQLite format 3\0".to_vec();
    bytes.resize(8192, b'x');
    std::fs::write(folder.path().join("a.db"), bytes).unwrap();
    let output = gaitwright(folder.path(), &["tune", "--database", "a.db"]);
    let text = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{text}");
    assert!(text.contains("a.db is not a Gaitwright database"), "{text}");
    assert_eq!(cli::files(folder.path()), ["a.db"]);
}

#[test]
fn unwritable_output_file_is_refused_before_the_solve() {
    // Solved with muscles, this would take minutes.
    refused_beside(&[], &["solve", "--out", "nowhere/gait.json"], "Cannot write nowhere/gait.json");
    refused_beside(&[], &["solve", "--out", "folder"], "Cannot write folder: it is a folder");
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("actions.csv"), cli::actions(&[""])).unwrap();
    let output = gaitwright(folder.path(), &["sweep", "--actions", "actions.csv", "--out", "nowhere/out.csv"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&output.stderr).contains("Cannot write nowhere/out.csv"));
}

#[test]
fn solve_succeeds_if_its_reader_closes_the_pipe() {
    let folder = tempfile::tempdir().unwrap();
    let binary = env!("CARGO_BIN_EXE_gaitwright-cli");
    let fast = ["solve", "--muscles", "off", "--mesh", "2,2,2,2", "--max-iterations", "1"];
    for more in [&["--json"][..], &[]] {
        let mut child = cli::command(binary, folder.path(), &[&fast, more].concat())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        drop(child.stdout.take());
        let output = child.wait_with_output().unwrap();
        let text = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(0), "{text}");
        assert!(!text.contains("panicked"), "{text}");
    }
}

#[test]
fn service_with_a_taken_port_creates_no_files() {
    let taken = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
    let address = taken.local_addr().unwrap().to_string();
    refused(&["serve", "--no-sign-in", "--listen", &address], &format!("Cannot listen on {address}"));
    let missing = ["serve", "--tls-certificate", "c.pem", "--tls-key", "k.pem", "--listen", "127.0.0.1:0"];
    refused(&missing, "Cannot use the certificate c.pem");
}

#[tokio::test]
async fn error_for_a_read_only_database_names_the_missing_permission() {
    refused(&["tune", "--database", "missing/a.db"], "Cannot open or write missing/a.db");
    // Root may write everywhere, so a folder stands in the way of the write-ahead log.
    let folder = tempfile::tempdir().unwrap();
    Store::open(&folder.path().join("made.db")).await.unwrap().close().await;
    std::fs::copy(folder.path().join("made.db"), folder.path().join("a.db")).unwrap();
    std::fs::create_dir(folder.path().join("a.db-wal")).unwrap();
    let output = gaitwright(folder.path(), &["tune", "--database", "a.db"]);
    let text = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{text}");
    assert!(text.contains("Cannot open or write a.db") && text.contains("and its folder must be writable"), "{text}");
}

#[test]
fn unknown_and_invalid_environment_variables_are_reported() {
    let folder = tempfile::tempdir().unwrap();
    let with = |name: &str, value: &str| {
        cli::command(env!("CARGO_BIN_EXE_gaitwright-cli"), folder.path(), &["config", "show"])
            .env(name, value)
            .output()
            .unwrap()
    };
    let output = with("GAITWRIGHT_WORKER", "2");
    let text = String::from_utf8_lossy(&output.stderr);
    assert!(
        output.status.success() && text.contains("the environment variable GAITWRIGHT_WORKER is not a setting"),
        "{text}"
    );
    for (name, value) in
        [("GAITWRIGHT_LOG_FORMAT", "xml"), ("GAITWRIGHT_LOG", "gaitwright=loud"), ("RUST_LOG", "a=b=c")]
    {
        let output = with(name, value);
        let text = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{text}");
        assert!(text.contains(name) && text.contains(value), "{text}");
    }
}

#[test]
fn json_arrays_as_input_and_a_dash_as_output_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("array.json"), r#"["AMPRO3", 1.0, 0.1]"#).unwrap();
    for flag in ["--device", "--reference", "--settings", "--warm"] {
        let output = gaitwright(folder.path(), &["solve", flag, "array.json"]);
        let text = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{flag}: {text}");
        assert!(text.contains("array.json is not "), "{flag}: {text}");
    }
    refused(&["solve", "--out", "-"], "Cannot write to \"-\", which is not a file name. Give a file.");
}

#[test]
fn solver_settings_are_refused_with_field_value_and_range() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("actions.csv"), cli::actions(&[""])).unwrap();
    let commands = [&["solve"][..], &["tune"], &["sweep", "--actions", "actions.csv", "--out", "out.csv"]];
    for (settings, expected) in [
        (
            r#"{"required_reduction": 1.5}"#,
            "solver.json is not a file of solver settings: solver: setting required_reduction is 1.5; it must be 0",
        ),
        (r#"{"bound_psuh": 0.1}"#, "field bound_psuh is unknown (line 1, column 13). Known fields: tolerance, "),
        (r#"{"bound_push": "high"}"#, "field bound_push is \"high\" (line 1, column 21); it must be a number"),
        (r#"{"linear_solver": "ma57"}"#, "field linear_solver is \"ma57\""),
        (
            r#"{"max_iterations": 5}"#,
            "max_iterations cannot be set here, because each phase of a solve sets its own value; omit it",
        ),
        ("[]", "The document is not an object with named fields"),
    ] {
        std::fs::write(folder.path().join("solver.json"), settings).unwrap();
        for command in commands {
            let output = gaitwright(folder.path(), &[command, &["--solver-settings", "solver.json"]].concat());
            let text = String::from_utf8_lossy(&output.stderr);
            assert_eq!(output.status.code(), Some(2), "{command:?} {settings}: {text}");
            assert!(text.contains(expected), "{command:?} {settings}: {text}");
        }
    }
    assert_eq!(cli::files(folder.path()), ["actions.csv", "solver.json"]);
    refused(&["solve", "--problem", "p.json", "--solver-settings", "s.json"], "--solver-settings");
    refused(&["solve", "--solver-settings", "nowhere.json"], "Cannot read nowhere.json");
}

#[cfg(target_os = "linux")]
#[test]
fn printing_to_a_full_device_fails_with_a_message_and_code_1() {
    let folder = tempfile::tempdir().unwrap();
    let full = || std::fs::File::options().write(true).open("/dev/full").unwrap();
    for arguments in [&["openapi"][..], &["config", "show"]] {
        let output = cli::command(env!("CARGO_BIN_EXE_gaitwright-cli"), folder.path(), arguments)
            .stdout(full())
            .output()
            .unwrap();
        let text = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{arguments:?}: {text}");
        assert!(text.starts_with("gaitwright: Cannot write the output: ") && text.lines().count() == 1, "{text}");
    }
    // If stderr cannot be written either, only the exit code reports the error.
    let output = cli::command(env!("CARGO_BIN_EXE_gaitwright-cli"), folder.path(), &["openapi"])
        .stdout(full())
        .stderr(full())
        .output()
        .unwrap();
    assert_eq!(output.status.code(), Some(1));
    let refused = cli::command(env!("CARGO_BIN_EXE_gaitwright-cli"), folder.path(), &["certify", "none.json"])
        .stderr(full())
        .output()
        .unwrap();
    assert_eq!(refused.status.code(), Some(2));
}

#[test]
fn printing_commands_succeed_if_their_reader_closes_the_pipe() {
    let folder = tempfile::tempdir().unwrap();
    for arguments in [&["openapi"][..], &["config", "show"]] {
        let mut command = cli::command(env!("CARGO_BIN_EXE_gaitwright-cli"), folder.path(), arguments);
        let mut child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
        drop(child.stdout.take());
        let output = child.wait_with_output().unwrap();
        let text = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success() && text.is_empty(), "{arguments:?}: {text}");
    }
}
