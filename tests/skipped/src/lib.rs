//! Messages of skipped tests, and their list, which the test program `list` of this crate prints.
//!
//! Cargo runs the test programs of a workspace in the order of the names of their packages, so the name of this package must
//! be the last one. Only documentation tests come later.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use std::collections::BTreeSet;
use std::fs::{self, OpenOptions};
use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime};

/// Variable that names the list of skipped tests. The program that sets it prints the list.
pub const FILE: &str = "GAITWRIGHT_SKIPPED";

/// Start of the names of the lists in the folder `target/tmp`.
const NAME: &str = "skipped-tests-";
/// Lists of older runs were not printed, because these runs were interrupted or left out the program that prints them.
const KEPT: Duration = Duration::from_hours(24);

/// Reports on stderr, past the capture of the test harness, and in the list that the current test was skipped, and why.
///
/// # Panics
/// If the list cannot be written.
pub fn skipped(reason: &str) {
    let test = std::thread::current().name().unwrap_or("a test").to_owned();
    let line = format!("{}{test}: skipped: {reason}\n", program());
    // A closed stderr has no reader, so the error is ignored.
    let _ = std::io::stderr().write_all(line.as_bytes());
    let list = list();
    // One write for each line, because test programs may run at the same time.
    let written = fs::create_dir_all(list.parent().unwrap_or(Path::new("/")))
        .and_then(|()| OpenOptions::new().create(true).append(true).open(&list))
        .and_then(|mut file| file.write_all(line.as_bytes()));
    written.unwrap_or_else(|error| panic!("{}: {error}", list.display()));
}

/// [`skipped`], unless the environment variable `required` is set: then the current test fails.
///
/// # Panics
/// If the variable is set, and as [`skipped`].
pub fn skipped_unless_required(required: &str, reason: &str) {
    assert!(std::env::var_os(required).is_none(), "{reason}, and {required} is set");
    skipped(reason);
}

/// Whether the long tests are off. Then the current test is [`skipped`]; `except` says which part of it runs, if any.
///
/// # Panics
/// As [`skipped`].
pub fn long_tests_are_skipped(except: &str) -> bool {
    let are_off = std::env::var_os("GAITWRIGHT_LONG_TESTS").is_none();
    if are_off {
        skipped(&format!("set GAITWRIGHT_LONG_TESTS=1{except}"));
    }
    are_off
}

/// The lines of this run, each once and sorted. Deletes its list and those of runs that ended long ago.
///
/// # Panics
/// If the list cannot be read or deleted.
#[must_use]
pub fn take_lines() -> BTreeSet<String> {
    let list = list();
    let lines = lines(&list);
    if let Some(folder) = list.parent() {
        delete_old_lists(folder, SystemTime::now());
    }
    match fs::remove_file(&list) {
        Err(error) if error.kind() != ErrorKind::NotFound => panic!("{}: {error}", list.display()),
        _ => lines,
    }
}

fn lines(list: &Path) -> BTreeSet<String> {
    match fs::read_to_string(list) {
        Ok(lines) => lines.lines().map(str::to_owned).collect(),
        Err(error) if error.kind() == ErrorKind::NotFound => BTreeSet::new(),
        Err(error) => panic!("{}: {error}", list.display()),
    }
}

fn delete_old_lists(folder: &Path, present: SystemTime) {
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        let is_old = || present.duration_since(entry.metadata().ok()?.modified().ok()?).ok().map(|age| age > KEPT);
        if entry.file_name().to_string_lossy().starts_with(NAME) && is_old() == Some(true) {
            // Another run may have deleted it.
            let _ = fs::remove_file(entry.path());
        }
    }
}

/// The file to which skipped tests add their lines: the one that `GAITWRIGHT_SKIPPED` names, or one in the folder
/// `target/tmp` for each run of `cargo test`.
fn list() -> PathBuf {
    if let Some(file) = std::env::var_os(FILE) {
        return file.into();
    }
    let program = std::env::current_exe().expect("the path of the test program");
    let target = program.ancestors().nth(3).expect("a test program is in target/<profile>/deps");
    target.join("tmp").join(format!("{NAME}{}", run()))
}

/// The run of `cargo test`: its programs have the same parent, Cargo. Other runs can have its number, but not its start time
/// as well.
fn run() -> String {
    let parent = std::os::unix::process::parent_id();
    let about = fs::read_to_string(format!("/proc/{parent}/stat")).unwrap_or_default();
    format!("{parent}-{}", start_time(&about).unwrap_or("unknown"))
}

/// The start time of a process, field 22 of its `/proc/PID/stat`. Field 2, its name in parentheses, may contain both spaces
/// and parentheses.
fn start_time(about: &str) -> Option<&str> {
    about.rsplit_once(") ")?.1.split(' ').nth(22 - 3)
}

/// The name of the test program, without the hash that Cargo adds to it: `serve::`.
fn program() -> String {
    let path = std::env::current_exe().unwrap_or_default();
    let name = path.file_stem().unwrap_or_default().to_string_lossy();
    let name = name.rsplit_once('-').map_or(&*name, |(name, _)| name);
    if name.is_empty() { String::new() } else { format!("{name}::") }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs::File;

    #[test]
    fn test_program_is_named_without_the_hash() {
        assert_eq!(program(), "skipped_tests::");
    }

    #[test]
    fn start_time_is_found_behind_any_name_of_a_program() {
        let about = "7 (a ) b) S 1 7 7 0 -1 4194560 1 2 3 4 5 6 7 8 20 0 1 0 4711 1000 99";
        assert_eq!((start_time(about), start_time("")), (Some("4711"), None));
    }

    #[test]
    fn test_that_skips_twice_is_listed_once() {
        let list = std::env::temp_dir().join(format!("{NAME}unit-test-{}", std::process::id()));
        fs::write(&list, "b: skipped\na: skipped\nb: skipped\n").unwrap();
        assert_eq!(lines(&list).into_iter().collect::<Vec<_>>(), ["a: skipped", "b: skipped"]);
        fs::remove_file(&list).unwrap();
        assert!(lines(&list).is_empty());
    }

    #[test]
    fn only_lists_older_than_a_day_are_deleted() {
        let folder = std::env::temp_dir().join(format!("{NAME}folder-{}", std::process::id()));
        fs::create_dir_all(&folder).unwrap();
        let names = [format!("{NAME}1-1"), format!("{NAME}2-2"), "another".to_owned()];
        let present = SystemTime::now();
        for (name, age) in names.iter().zip([25, 23, 25]) {
            let file = File::create(folder.join(name)).unwrap();
            file.set_modified(present - Duration::from_hours(age)).unwrap();
        }
        delete_old_lists(&folder, present);
        let left: Vec<bool> = names.iter().map(|name| folder.join(name).exists()).collect();
        assert_eq!(left, [false, true, true]);
        fs::remove_dir_all(&folder).unwrap();
    }
}
