//! Messages of skipped tests, as `tests/src/skipped.rs` writes them for the tests of the whole system.

use std::fs::{self, OpenOptions};
use std::io::Write;
use std::path::PathBuf;

/// Whether the long tests are off. Then reports on stderr, past the capture of the test harness, and in the list of
/// skipped tests that the current test skips `what`.
pub(crate) fn long_tests_are_skipped(what: &str) -> bool {
    if std::env::var_os("GAITWRIGHT_LONG_TESTS").is_some() {
        return false;
    }
    let test = std::thread::current().name().unwrap_or("a test").to_owned();
    let line = format!("{test}: skipped{what}: set GAITWRIGHT_LONG_TESTS=1\n");
    // A closed stderr has no reader, so the error is ignored.
    let _ = std::io::stderr().write_all(line.as_bytes());
    let list = list();
    fs::create_dir_all(list.parent().unwrap()).unwrap();
    OpenOptions::new().create(true).append(true).open(list).unwrap().write_all(line.as_bytes()).unwrap();
    true
}

/// The list of skipped tests: `gaitwright_tests::skipped::list`.
fn list() -> PathBuf {
    if let Some(file) = std::env::var_os("GAITWRIGHT_SKIPPED") {
        return file.into();
    }
    let program = std::env::current_exe().unwrap();
    let target = program.ancestors().nth(3).unwrap();
    target.join("tmp").join(format!("skipped-tests-{}", std::os::unix::process::parent_id()))
}
